// The plots of a page of `rcs report`: node page_test.mjs FOLDER [PICTURES]. FOLDER has page.html, and
// nav.csv and truth.csv of the log, with which the values under the pointer are compared.

import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Chromium } from "../../support/devtools.mjs";

const [folder, pictures] = process.argv.slice(2);
const [WIDTH, HEIGHT] = [1000, 900];
const CTRL = 2, SHIFT = 8;

let failures = 0;
function check(ok, text) {
  console.log(`${ok ? "ok  " : "FAIL"} ${text}`);
  if (!ok) failures += 1;
}

function csv(name) {
  const [head, ...lines] = readFileSync(join(folder, name), "utf8").trim().split("\n");
  const names = head.split(",");
  return lines.map((line) => Object.fromEntries(line.split(",").map((v, i) => [names[i], Number(v)])));
}

const browser = new Chromium();
const page = await browser.page(WIDTH, HEIGHT);
const drawn = () => page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
const svgOf = (title) => `document.querySelector('svg[aria-label="${title}"]')`;
async function keepPicture(name) {
  if (!pictures) return;
  mkdirSync(pictures, { recursive: true });
  writeFileSync(join(pictures, `${name}.png`), await page.picture());
}

/** Scrolls to a plot. @return its frame and the scale of its drawing, in pixels of the window */
async function frameOf(title) {
  await page.evaluate(`${svgOf(title)}.scrollIntoView({ block: "center" })`);
  await drawn();
  return page.evaluate(`(() => {
    const svg = ${svgOf(title)}, rect = svg.getBoundingClientRect(), scale = rect.width / svg.viewBox.baseVal.width;
    const [left, top, right, bottom] = svg.dataset.frame.split(" ").map(Number);
    return { left: rect.left + left * scale, right: rect.left + right * scale, top: rect.top + top * scale, bottom: rect.top + bottom * scale };
  })()`);
}
const mouse = (type, x, y, more = {}) => page.call("Input.dispatchMouseEvent", { type, x, y, ...more });
async function drag([x0, y0], [x1, y1]) {
  const held = { button: "left", buttons: 1, clickCount: 1 };
  await mouse("mouseMoved", x0, y0);
  await mouse("mousePressed", x0, y0, held);
  await mouse("mouseMoved", (x0 + x1) / 2, (y0 + y1) / 2, held);
  await mouse("mouseMoved", x1, y1, held);
  await mouse("mouseReleased", x1, y1, { ...held, buttons: 0 });
  await drawn();
}
const wheel = (x, y, deltaY, modifiers = 0) => mouse("mouseWheel", x, y, { deltaX: 0, deltaY, modifiers }).then(drawn);
/** The lines of the box of a plot; null: it is hidden. */
const boxOf = (title) => page.evaluate(`(() => {
  const box = ${svgOf(title)}.parentElement.querySelector(".values");
  return box.hidden ? null : [...box.children].map((line) => line.textContent);
})()`);
const ticksOf = (title, axis = "x") => page.evaluate(`[...${svgOf(title)}.querySelectorAll(".${axis}-ticks text")].map((t) => t.textContent)`);
const zoomed = (title) => page.evaluate(`${svgOf(title)}.classList.contains("zoomed")`);
const numberIn = (line) => Number(line.match(/-?[\d.]+(?= |$)(?!.*\d)/)?.[0] ?? NaN);
const middle = (a, b) => (a + b) / 2;

const SPEED = "Speed of WM", BOUNDS = "Horizontal position: bounds", COURSE = "Course from above", MAP = "Map: points of SP";

async function checkValues() {
  const nav = csv("nav.csv"), zero = csv("truth.csv")[0].utime;
  const frame = await frameOf(SPEED);
  for (const part of [0.3, 0.6, 0.9]) {
    const x = frame.left + part * (frame.right - frame.left);
    await mouse("mouseMoved", x, middle(frame.top, frame.bottom));
    const [time, speed] = (await boxOf(SPEED)) ?? ["", ""];
    const t = numberIn(time.replace(" s", ""));
    const row = nav.reduce((best, r) => (Math.abs((r.utime - zero) / 1e6 - t) < Math.abs((best.utime - zero) / 1e6 - t) ? r : best));
    const expected = Math.hypot(row.v_world_mps_0, row.v_world_mps_1, row.v_world_mps_2);
    check(Math.abs((row.utime - zero) / 1e6 - t) < 0.011 && time.startsWith("time ") && time.endsWith(" s"), `time under the pointer: ${time}`);
    check(Math.abs(numberIn(speed.replace(" m/s", "")) - expected) < 0.01, `${speed} at ${t} s, of the log ${expected.toFixed(3)} m/s`);
  }
  check(await page.evaluate(`${svgOf(SPEED)}.querySelectorAll(".cursor").length`) === 1, "a vertical line at the cursor");
  await keepPicture("hover");
  await mouse("mouseMoved", frame.left, frame.top - 60);
  check((await boxOf(SPEED)) === null, "outside of the frame there are no values");
}

async function checkLinkedCursor() {
  const frame = await frameOf(BOUNDS);
  await mouse("mouseMoved", middle(frame.left, frame.right), middle(frame.top, frame.bottom));
  const [time, ...rows] = await boxOf(BOUNDS);
  check(rows.some((r) => r.startsWith("protection level ") && r.endsWith(" m")) && rows.some((r) => r.startsWith("error ")), `values of all lines: ${rows.join(", ")}`);
  const others = await page.evaluate(`[...document.querySelectorAll("figure")].filter((f) => f.querySelector(".values") && !f.querySelector(".values").hidden)
    .map((f) => f.querySelector(".values").firstChild.textContent)`);
  // With the digits of their own scale.
  const seconds = (text) => Number(text.match(/[-\d.]+(?= s)/)[0]);
  check(others.length > 1 && others.every((t) => Math.abs(seconds(t) - seconds(time)) < 0.006), `other plots on the screen have the same cursor: ${others.join(", ")}`);
  await keepPicture("linked");
  await mouse("mouseMoved", 2, 2);
}

async function checkZoom() {
  const whole = await ticksOf(SPEED), path = await page.evaluate(`${svgOf(SPEED)}.querySelector(".data path").getAttribute("d")`);
  const frame = await frameOf(SPEED), y = middle(frame.top, frame.bottom), wide = frame.right - frame.left;
  await drag([frame.left + 0.4 * wide, y], [frame.left + 0.5 * wide, y]);
  const part = (await ticksOf(SPEED)).map(Number), [low, high] = await page.evaluate(`${svgOf(SPEED)}.dataset.x.split(" ").map(Number)`);
  const within = (t) => t >= low + 0.39 * (high - low) && t <= low + 0.51 * (high - low);
  check(await zoomed(SPEED) && part.length >= 3 && part.every(within), `a drag from 40 % to 50 % shows ${part.join(", ")} s, of ${whole.join(", ")}`);
  const steps = part.slice(1).map((t, i) => (t - part[i]).toPrecision(4));
  check(new Set(steps).size === 1 && /^0?\.?0*(1|2|25|5)0*$/.test(String(Number(steps[0]))), `round steps of ${steps[0]} s`);
  check(await page.evaluate(`getComputedStyle(${svgOf(SPEED)}.querySelector(".data path")).vectorEffect`) === "non-scaling-stroke", "lines keep their width");
  await mouse("mouseMoved", middle(frame.left, frame.right), y);
  check(within(numberIn(((await boxOf(SPEED))?.[0] ?? "").replace(" s", ""))), `values of the part that is shown: ${await boxOf(SPEED)}`);
  await keepPicture("zoomed");
  await page.key("Escape", 27);
  check(!(await zoomed(SPEED)) && (await ticksOf(SPEED)).join() === whole.join(), "Escape shows everything again");
  check(await page.evaluate(`${svgOf(SPEED)}.querySelector(".data path").getAttribute("d")`) === path, "the path is as it was written");
  await page.evaluate(`${svgOf(SPEED)}.blur()`);

  const before = await page.evaluate("scrollY");
  await wheel(middle(frame.left, frame.right), y, 40);
  await page.until(`scrollY !== ${before}`, 5).catch(() => {});
  check(!(await zoomed(SPEED)) && (await page.evaluate("scrollY")) !== before, "the wheel alone scrolls the page");
  await frameOf(SPEED);
  await wheel(middle(frame.left, frame.right), y, -100, CTRL);
  check(await zoomed(SPEED), "Ctrl and the wheel magnify");
  for (const clickCount of [1, 2]) {
    for (const type of ["mousePressed", "mouseReleased"]) await mouse(type, middle(frame.left, frame.right), y, { button: "left", clickCount });
  }
  await drawn();
  check(!(await zoomed(SPEED)), "a double click shows everything again");
  await wheel(middle(frame.left, frame.right), y, -100);
  check(await zoomed(SPEED), "the wheel magnifies a plot that was clicked");
  await page.key("0", 48);
  check(!(await zoomed(SPEED)), "0 shows everything again");
}

async function checkKeys() {
  await page.evaluate(`${svgOf(SPEED)}.focus()`);
  await page.key("ArrowRight", 39);
  const first = numberIn((await boxOf(SPEED))[0].replace(" s", ""));
  await page.key("ArrowRight", 39);
  const second = numberIn((await boxOf(SPEED))[0].replace(" s", ""));
  check(second > first, `the arrow moves the cursor from ${first} s to ${second} s`);
  await page.key("+", 187);
  await page.key("+", 187);
  check(await zoomed(SPEED) && (await boxOf(SPEED)) !== null, "+ magnifies about the cursor");
  const ticks = await ticksOf(SPEED);
  for (let i = 0; i < 3; ++i) await page.key("ArrowRight", 39, SHIFT);
  check((await ticksOf(SPEED)).join() !== ticks.join(), "Shift and an arrow move the view");
  for (let i = 0; i < 3; ++i) await page.key("-", 189);
  check(!(await zoomed(SPEED)), "- shows more");
}

async function checkViewFromAbove() {
  const frame = await frameOf(COURSE);
  const [x, y] = [middle(frame.left, frame.right), middle(frame.top, frame.bottom)], ticks = (await ticksOf(COURSE)).map(Number);
  await mouse("mouseMoved", x, y);
  check(/^east -?[\d.]+ m, north -?[\d.]+ m$/.test((await boxOf(COURSE))?.[0] ?? ""), `position: ${await boxOf(COURSE)}`);
  const [cx, cy] = await page.evaluate(`(() => {
    const svg = ${svgOf(COURSE)}, p = svg.querySelector(".data path").getPointAtLength(0).matrixTransform(svg.getScreenCTM());
    return [p.x, p.y];
  })()`);
  await mouse("mouseMoved", cx + 2, cy + 2);
  check((await boxOf(COURSE)).length === 2, `the line near the pointer is named: ${await boxOf(COURSE)}`);
  await keepPicture("course");
  await drag([x - 60, y - 20], [x + 60, y + 20]);
  const step = async (axis) => { const t = (await ticksOf(COURSE, axis)).map(Number); return Math.abs(t[1] - t[0]); };
  const [kx, ky] = await page.evaluate(`(({ a, d }) => [a, d])(${svgOf(COURSE)}.querySelector(".data").transform.baseVal.consolidate().matrix)`);
  check(Math.abs(kx - ky) < 1e-6 && kx > 3, `equal scales after a drag: ${kx}, ${ky}`);
  check(await step("x") < Math.abs(ticks[1] - ticks[0]), `finer ticks: ${await ticksOf(COURSE)}; ${await ticksOf(COURSE, "y")}`);
  await keepPicture("course_zoomed");
  await page.key("Escape", 27);
}

async function checkMap() {
  const title = await page.evaluate(`[...document.querySelectorAll("svg.plot")].map((s) => s.getAttribute("aria-label")).find((l) => l.startsWith("${MAP}"))`);
  await frameOf(title);
  const [x, y] = await page.evaluate(`(() => {
    const svg = ${svgOf(title)}, cells = [...svg.querySelectorAll("[data-value]")].sort((a, b) => b.getAttribute("d").length - a.getAttribute("d").length)[0];
    const [, i, j] = cells.getAttribute("d").match(/^M(-?\\d+) (-?\\d+)/).map(Number);
    const p = new DOMPoint(i + 0.5, j + 0.5).matrixTransform(cells.getScreenCTM());
    return [p.x, p.y];
  })()`);
  await mouse("mouseMoved", x, y);
  check((await boxOf(title))?.some((l) => /^height -?[\d.]+ to -?[\d.]+ m$/.test(l)), `height of a cell: ${await boxOf(title)}`);
  await keepPicture("map");
}

async function run() {
  const url = `file://${join(folder, "page.html")}`;
  await page.open(url);
  await page.until("document.readyState === 'complete'");
  await checkValues();
  await checkLinkedCursor();
  await checkZoom();
  await checkKeys();
  await checkViewFromAbove();
  await checkMap();
  await page.call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: "dark" }] });
  const frame = await frameOf(BOUNDS);
  await mouse("mouseMoved", middle(frame.left, frame.right), middle(frame.top, frame.bottom));
  const colors = await page.evaluate(`(({ color, backgroundColor }) => [color, backgroundColor])(getComputedStyle(${svgOf(BOUNDS)}.parentElement.querySelector(".values")))`);
  check(colors.join() === "rgb(232, 236, 241),rgb(22, 27, 34)", `dark: ${colors.join(" on ")}`);
  await keepPicture("dark");
  check(page.problems.length === 0, `no error on the console: ${page.problems.join("; ")}`);
  check(page.addresses.every((a) => a === url), `no request but the page: ${page.addresses.filter((a) => a !== url).join(", ")}`);

  await page.call("Emulation.setScriptExecutionDisabled", { value: true });
  const loaded = new Promise((done) => browser.handlers.push(({ method, sessionId }) => {
    if (method === "Page.loadEventFired" && sessionId === page.session) done();
  }));
  await page.open(url);
  await loaded;
  const { root } = await page.call("DOM.getDocument", { depth: -1 });
  const { nodeIds } = await page.call("DOM.querySelectorAll", { nodeId: root.nodeId, selector: "svg.plot .data path" });
  const { nodeIds: boxes } = await page.call("DOM.querySelectorAll", { nodeId: root.nodeId, selector: ".values, [tabindex]" });
  check(nodeIds.length > 10 && boxes.length === 0, `without scripts: ${nodeIds.length} paths, nothing to point at`);
}

try {
  await run();
} catch (error) {
  check(false, error.stack);
} finally {
  browser.end();
}
if (failures > 0) console.log(`${failures} failures`);
process.exit(failures > 0 ? 1 : 0);
