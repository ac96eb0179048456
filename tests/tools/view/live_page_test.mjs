// The live page of `rcs view`: node live_page_test.mjs BIN_DIR CONFIG_DIR FOLDER [PICTURES]. The nodes
// are started by `rcs up` and driven by the simulator. Nodes end and return, and a client never reads.

import { spawn } from "node:child_process";
import { createWriteStream, mkdirSync, writeFileSync } from "node:fs";
import net from "node:net";
import { join } from "node:path";
import { Chromium } from "../../support/devtools.mjs";

const [bin, config, folder, pictures] = process.argv.slice(2);
const MAX_FIRST_PICTURE_MS = 1000; // checked with RCS_CHECK_LIMITS alone

let failures = 0;
function check(ok, text) {
  console.log(`${ok ? "ok  " : "FAIL"} ${text}`);
  if (!ok) failures += 1;
}

const wait = (ms) => new Promise((done) => setTimeout(done, ms));
const children = [];

/** Starts a program; what it says is kept in FOLDER. @return {child, said(pattern, seconds)} */
function start(name, args) {
  const child = spawn(join(bin, name), args, { stdio: ["ignore", "pipe", "pipe"] });
  children.push(child);
  let text = "";
  const log = createWriteStream(join(folder, `${name}.txt`), { flags: "a" });
  for (const stream of [child.stdout, child.stderr]) {
    stream.on("data", (part) => { text += part; log.write(part); });
  }
  child.over = new Promise((done) => child.on("exit", done));
  const said = async (pattern, seconds = 30) => {
    for (const begin = Date.now(); Date.now() - begin < 1000 * seconds; await wait(50)) {
      const found = text.match(pattern);
      if (found) return found;
    }
    throw new Error(`${name} has not said ${pattern}:\n${text}`);
  };
  return { child, said };
}

async function end({ child }) {
  child.kill("SIGINT");
  await child.over;
}

async function startNodes() {
  const up = start("rcs", ["up", join(config, "demo3.toml")]);
  for (const node of ["sp", "wm", "bg"]) await up.said(new RegExp(`\\[${node}\\] ${node}: running`));
  return up;
}

/** A client of the WebSocket that subscribes to the points and never reads. */
function deafClient(url) {
  const { hostname, port } = new URL(url);
  const socket = net.connect(Number(port), hostname);
  socket.on("error", () => {});
  socket.write(`GET / HTTP/1.1\r\nHost: ${hostname}:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n` +
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n" +
    "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n");
  socket.pause();
  // A masked text frame; the numbers of the topics are not known to it.
  const wanted = Buffer.from(JSON.stringify({
    op: "subscribe", subscriptions: Array.from({ length: 60 }, (_, i) => ({ id: i, channelId: i })),
  }));
  const head = Buffer.from([0x81, 0xfe, wanted.length >> 8, wanted.length & 255, 0, 0, 0, 0]);
  setTimeout(() => socket.write(Buffer.concat([head, wanted])), 300);
  return socket;
}

async function keepPicture(page, name) {
  if (!pictures) return;
  mkdirSync(pictures, { recursive: true });
  writeFileSync(join(pictures, `${name}.png`), await page.picture());
}

const STATUS = "document.getElementById('panel-status').innerText";

/** Stamps of the scans that the page draws within some seconds. */
async function scansWithin(page, seconds) {
  const stamps = new Set();
  for (const begin = Date.now(); Date.now() - begin < 1000 * seconds; await wait(40)) {
    stamps.add(await page.evaluate("rcsView.world.scan?.stamp ?? null"));
  }
  stamps.delete(null);
  return [...stamps].sort();
}

async function run(browser) {
  let up = await startNodes();
  const sim = start("sim", [join(config, "sim/demo.toml")]);
  const view = start("rcs_view", ["--port=0"]);
  const [url] = await view.said(/http:\/\/\S+/);
  const page = await browser.page(1280, 800);
  await page.open(`${url}?theme=light`);
  await page.until("window.rcsView && rcsView.world?.firstPicture_ms", 30);
  const first = await page.evaluate("rcsView.world.firstPicture_ms");
  if (process.env.RCS_CHECK_LIMITS) check(first <= MAX_FIRST_PICTURE_MS, `first picture after ${first.toFixed(0)} ms`);
  else console.log(`     first picture after ${first.toFixed(0)} ms`);

  check(await page.evaluate("document.body.classList.contains('live')"), "the page is live");
  await page.until(`/GPS_INS/.test(${STATUS})`, 60);
  const stamps = await scansWithin(page, 5);
  check(stamps.length >= 10, `scans of the bus are drawn: ${stamps.length} in 5 s`);
  const begun = await page.evaluate("rcsView.app.timeline.end_s");
  await page.until(`rcsView.app.timeline.end_s > ${begun} + 2`, 10);
  check(true, "the timeline grows");
  const nodes = await page.evaluate("[...document.querySelectorAll('#panel-status tr')].map((r) => r.innerText).join('\\n')");
  check(["sp", "wm", "bg"].every((n) => new RegExp(`^${n}\\b(?!.*†)`, "m").test(nodes)), "sp, wm and bg are shown as alive");
  await keepPicture(page, "live");

  // Whoever never reads delays nobody, and is dropped.
  const deaf = deafClient(url);
  const beside = await scansWithin(page, 5);
  check(beside.length >= 10, `beside a client that never reads: ${beside.length} scans in 5 s`);
  deaf.destroy();

  // The nodes end: the page says so, and shows them again when they are back.
  await end(up);
  await page.until(`/WM has been silent/.test(${STATUS})`, 15);
  check(true, "the end of the nodes is shown");
  await keepPicture(page, "silent");
  const last = await page.evaluate("rcsView.world.scan?.stamp ?? 0");
  up = await startNodes();
  await page.until(`rcsView.world.scan && rcsView.world.scan.stamp > ${last} + 1 && !/WM has been silent/.test(${STATUS})`, 60);
  check(true, "their return is shown, without a reload");

  // So does the page when the viewer returns.
  await end(view);
  const port = new URL(url).port;
  await page.until("document.getElementById('connection').textContent !== ''", 10);
  const again = start("rcs_view", [`--port=${port}`]);
  await again.said(/http:\/\/\S+/);
  await page.until("document.getElementById('connection').textContent === ''", 20);
  const after = await scansWithin(page, 5);
  check(after.length >= 10, `after the return of the viewer: ${after.length} scans in 5 s`);

  const foreign = page.addresses.filter((a) => !/^(about:|data:|blob:)/.test(a) && !/^(http|ws):\/\/127\.0\.0\.1:/.test(a));
  check(foreign.length === 0, `no request to another host ${foreign.slice(0, 3).join(" ")}`);
  const errors = page.problems.filter((p) => !/WebSocket|ERR_CONNECTION/.test(p)); // while the viewer was off
  check(errors.length === 0, `no error on the console ${errors.slice(0, 3).join(" | ")}`);
  await end(again);
  await end(up);
  await end(sim);
}

const browser = new Chromium();
try {
  await run(browser);
} catch (error) {
  check(false, error.message);
} finally {
  browser.end();
  for (const child of children) child.kill("SIGKILL");
}
console.log(failures === 0 ? "live page test passed" : `live page test: ${failures} checks failed`);
process.exit(failures === 0 ? 0 : 1);
