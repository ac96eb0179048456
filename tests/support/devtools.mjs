// A headless Chromium, commanded over two pipes (--remote-debugging-pipe): needs no package.

import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const ARGUMENTS = [
  "--headless=new", "--remote-debugging-pipe", "--use-gl=angle", "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--disable-extensions", "--no-proxy-server",
  "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--force-device-scale-factor=1",
];

export class Chromium {
  constructor() {
    this.profile = mkdtempSync(join(tmpdir(), "rcs_page_test_"));
    const root = process.getuid() === 0 ? ["--no-sandbox"] : [];
    this.child = spawn("chromium", [...ARGUMENTS, ...root, `--user-data-dir=${this.profile}`, "about:blank"],
      { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"], detached: true });
    this.waiting = new Map();
    this.handlers = [];
    this.next = 1;
    let text = "";
    this.child.stdio[4].setEncoding("utf8");
    this.child.stdio[4].on("data", (part) => {
      text += part;
      for (let end = text.indexOf("\0"); end >= 0; end = text.indexOf("\0")) {
        this.take(JSON.parse(text.slice(0, end)));
        text = text.slice(end + 1);
      }
    });
    this.child.stdio[3].on("error", () => {});
  }
  take(message) {
    if (message.id === undefined) return this.handlers.forEach((h) => h(message));
    const { resolve, reject } = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    return message.error ? reject(new Error(message.error.message)) : resolve(message.result);
  }
  call(method, params = {}, sessionId = undefined) {
    const id = this.next++;
    this.child.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }
  /** Opens an empty page. */
  async page(width, height) {
    const { targetId } = await this.call("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.call("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this, sessionId);
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await page.call(`${domain}.enable`);
    await page.call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    return page;
  }
  end() {
    try { process.kill(-this.child.pid, "SIGKILL"); } catch { /* it has ended */ }
    rmSync(this.profile, { recursive: true, force: true });
  }
}

class Page {
  constructor(browser, session) {
    this.browser = browser;
    this.session = session;
    this.problems = []; // of the console
    this.addresses = [];
    browser.handlers.push(({ method, params, sessionId }) => {
      if (sessionId !== session) return;
      if (method === "Runtime.exceptionThrown") {
        this.problems.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      }
      if (method === "Runtime.consoleAPICalled" && params.type === "error") {
        this.problems.push(params.args.map((a) => a.value).join(" "));
      }
      if (method === "Log.entryAdded" && params.entry.level === "error") this.problems.push(params.entry.text);
      if (method === "Network.requestWillBeSent") this.addresses.push(params.request.url);
      if (method === "Network.webSocketCreated") this.addresses.push(params.url);
    });
  }
  call(method, params = {}) { return this.browser.call(method, params, this.session); }
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.call("Runtime.evaluate",
      { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description}`);
    return result.value;
  }
  async until(expression, seconds = 60) {
    for (const begin = Date.now(); Date.now() - begin < 1000 * seconds;) {
      // While a page is replaced by another one, nothing can be evaluated.
      const value = await this.evaluate(expression).catch(() => false);
      if (value) return value;
      await new Promise((done) => setTimeout(done, 50));
    }
    throw new Error(`not within ${seconds} s: ${expression}`);
  }
  async open(url) {
    const { errorText } = await this.call("Page.navigate", { url });
    if (errorText) throw new Error(`${url}: ${errorText}`);
  }
  async key(key, code = 0, modifiers = 0) {
    const text = key.length === 1 ? key : key === "Enter" ? "\r" : undefined;
    await this.call("Input.dispatchKeyEvent", { type: "keyDown", key, text, windowsVirtualKeyCode: code, modifiers });
    await this.call("Input.dispatchKeyEvent", { type: "keyUp", key, windowsVirtualKeyCode: code, modifiers });
  }
  async move(x, y) { await this.call("Input.dispatchMouseEvent", { type: "mouseMoved", x, y }); }
  async click(x, y) {
    const at = { x, y, button: "left", clickCount: 1 };
    await this.move(x, y);
    await this.call("Input.dispatchMouseEvent", { type: "mousePressed", ...at });
    await this.call("Input.dispatchMouseEvent", { type: "mouseReleased", ...at });
  }
  async picture() {
    const { data } = await this.call("Page.captureScreenshot", { format: "png" });
    return Buffer.from(data, "base64");
  }
}
