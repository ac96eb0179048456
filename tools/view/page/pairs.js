// The pairs panel, as figures 2 and 3 of Madhavan and Messina: each point of a scan (DATA) joined to
// the closest point of an earlier one (MODEL), before and after their registration.

import { palette } from "./colors.js";
import { niceStep } from "./overlay.js";
import { FONT } from "./plot.js";
import { el } from "./status.js";

const BINS = 40;

/** @param m 16 numbers by rows */
function moved(m, xyz) {
  const out = new Float32Array(xyz.length);
  for (let i = 0; i < xyz.length; i += 3) {
    for (let r = 0; r < 3; ++r) {
      out[i + r] = m[4 * r] * xyz[i] + m[4 * r + 1] * xyz[i + 1] + m[4 * r + 2] * xyz[i + 2] + m[4 * r + 3];
    }
  }
  return out;
}

function quantile(values, q) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];
}

/** The rectangle of the dense part of the model from above. */
function windowOf(pair) {
  const axis = (k) => pair.model.xyz.filter((_, i) => i % 3 === k);
  const range = (v) => [quantile(v, 0.01), quantile(v, 0.97)];
  const [x, y] = [range(axis(0)), range(axis(1))];
  const half = Math.max(x[1] - x[0], y[1] - y[0]) * 0.56;
  const [cx, cy] = [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2];
  return { cx, cy, half };
}

/** The 3 m around the pair in the middle of the dense part, magnified. */
function detailOf(pair) {
  const axis = (k) => pair.data.xyz.filter((_, i) => i % 3 === k);
  return { cx: quantile(axis(0), 0.5), cy: quantile(axis(1), 0.5), half: 2.5 };
}

function prepare(canvas, ratio) {
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  const c = canvas.getContext("2d");
  c.scale(ratio, ratio);
  c.font = FONT;
  return c;
}

function drawCloud(canvas, pair, stage, pose, area, colors, ratio) {
  const c = prepare(canvas, ratio);
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  const k = Math.min(w, h) / (2 * area.half);
  const X = (x) => w / 2 + (x - area.cx) * k;
  const Y = (y) => h / 2 - (y - area.cy) * k;
  const model = pair.model.xyz;
  const data = moved(pose, pair.data.xyz);
  const size = area.half < 5 ? 4 : 1.6;
  c.lineWidth = area.half < 5 ? 1.3 : 0.7;
  c.strokeStyle = colors.path;
  c.beginPath();
  stage.index.forEach((j, i) => {
    c.moveTo(X(data[3 * i]), Y(data[3 * i + 1]));
    c.lineTo(X(model[3 * j]), Y(model[3 * j + 1]));
  });
  c.stroke();
  c.fillStyle = colors.faint;
  for (let i = 0; i < model.length; i += 3) c.fillRect(X(model[i]) - size / 2, Y(model[i + 1]) - size / 2, size, size);
  c.fillStyle = colors.sigma;
  for (let i = 0; i < data.length; i += 3) {
    c.beginPath();
    c.arc(X(data[i]), Y(data[i + 1]), 0.62 * size, 0, 2 * Math.PI);
    c.fill();
  }
  const step = niceStep(area.half / 2.5);
  c.fillStyle = colors.panel;
  c.globalAlpha = 0.85;
  c.fillRect(4, h - 38, step * k + 22, 34);
  c.globalAlpha = 1;
  c.strokeStyle = c.fillStyle = colors.text;
  c.lineWidth = 2;
  c.beginPath();
  c.moveTo(14, h - 18); c.lineTo(14, h - 14); c.lineTo(14 + step * k, h - 14); c.lineTo(14 + step * k, h - 18);
  c.stroke();
  c.fillText(`${step} m`, 18, h - 20);
}

function drawHistogram(canvas, pair, colors, ratio) {
  const c = prepare(canvas, ratio);
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  const [left, right, top, bottom] = [46, w - 10, 20, h - 34];
  const high = Math.max(0.05, quantile(pair.before.distance_m, 0.97), quantile(pair.after.distance_m, 0.97));
  const bins = (d) => {
    const n = new Array(BINS).fill(0);
    for (const v of d) if (v < high) n[Math.floor((v / high) * BINS)] += 1;
    return n;
  };
  const [before, after] = [bins(pair.before.distance_m), bins(pair.after.distance_m)];
  const most = Math.max(...before, ...after);
  const X = (v) => left + ((right - left) * v) / high;
  const Y = (n) => bottom - ((bottom - top) * n) / most;
  c.strokeStyle = colors.line;
  c.fillStyle = colors.faint;
  c.textAlign = "right";
  const countStep = niceStep(most / 4);
  for (let n = 0; n <= most; n += countStep) {
    c.beginPath(); c.moveTo(left, Y(n)); c.lineTo(right, Y(n)); c.stroke();
    c.fillText(String(n), left - 5, Y(n) + 4);
  }
  c.textAlign = "center";
  for (let v = 0; v <= high; v += niceStep(high / 6)) c.fillText(String(Number(v.toFixed(6))), X(v), bottom + 14);
  c.fillText("distance to the closest point of MODEL [m]", (left + right) / 2, bottom + 29);
  const bars = (n, color, fill) => {
    c.beginPath();
    c.moveTo(left, bottom);
    n.forEach((count, i) => {
      c.lineTo(X((i * high) / BINS), Y(count));
      c.lineTo(X(((i + 1) * high) / BINS), Y(count));
    });
    c.lineTo(right, bottom);
    if (fill) { c.globalAlpha = 0.55; c.fillStyle = color; c.fill(); c.globalAlpha = 1; }
    c.strokeStyle = color;
    c.lineWidth = 1.8;
    c.stroke();
  };
  bars(after, colors.sigma, true);
  bars(before, colors.outage, false);
  c.textAlign = "left";
  c.fillStyle = colors.text;
  c.fillText("number of points", left, 12);
  const legend = (x, color, text, fill) => {
    c.fillStyle = c.strokeStyle = color;
    if (fill) c.fillRect(x, 4, 16, 9); else c.strokeRect(x, 4, 16, 9);
    c.fillStyle = colors.text;
    c.fillText(text, x + 21, 12);
  };
  legend(right - 190, colors.outage, "before", false);
  legend(right - 90, colors.sigma, "after", true);
}

function table(pair) {
  const cm = (v) => `${(100 * v).toFixed(1)} cm`;
  const share = (d, limit) => `${((100 * d.filter((v) => v < limit).length) / d.length).toFixed(0)} %`;
  const m = pair.T_model_data;
  const yaw = (Math.atan2(m[4], m[0]) * 180) / Math.PI;
  const row = (name, ...v) => el("tr", {}, el("td", {}, name), ...v.map((x) => el("td", {}, x)));
  return el("table", {},
    el("tr", {}, ...["distance to the closest point", "before", "after"].map((t) => el("th", {}, t))),
    row("mean", cm(pair.before.mean_m), cm(pair.after.mean_m)),
    row("median", cm(quantile(pair.before.distance_m, 0.5)), cm(quantile(pair.after.distance_m, 0.5))),
    row("points within 10 cm", share(pair.before.distance_m, 0.1), share(pair.after.distance_m, 0.1)),
    row("motion", "", `${Math.hypot(m[3], m[7], m[11]).toFixed(3)} m, yaw ${yaw.toFixed(2)}°`),
    row("registration", "", `${pair.stop}, ${pair.iterations} iterations, ${pair.cpu_ms.toFixed(0)} ms`),
    row("points MODEL, DATA; pairs", `${pair.model.points}, ${pair.data.points}`, String(pair.pairs)),
    row("verdict", "", pair.accepted ? "accepted" : "rejected"));
}

export class PairsPanel {
  constructor(panel, isDark) {
    this.panel = panel;
    this.isDark = isDark;
    this.apart = 5;
    this.byWm = 0;
    this.time = null;
    this.state = "loading";
    this.requests = 0;
  }
  /** Computes and shows the pair of a moment. */
  async show(t) {
    this.time = t;
    this.state = "loading";
    const request = ++this.requests;
    const response = await fetch(`api/pairs?t=${t}&apart=${this.apart}&wm=${this.byWm}`);
    const content = response.ok ? await response.json() : (await response.text()).trim();
    if (request !== this.requests) return;
    if (!response.ok) {
      this.state = content;
      this.panel.replaceChildren(this.controls(), el("p", { class: "warn" }, content));
      return;
    }
    this.pair = content;
    this.build();
    this.draw();
    this.state = "ready";
  }
  controls() {
    const select = (values, texts, current, set) => {
      const s = el("select", {}, ...values.map((v, i) => el("option", { value: v }, texts[i])));
      s.value = String(current);
      s.addEventListener("change", () => { set(Number(s.value)); this.show(this.time); });
      return s;
    };
    return el("div", { class: "controls" }, el("b", {}, "Two scans and their registration"),
      el("label", {}, "MODEL is ", select([1, 5, 10, 20], ["1 scan", "5 scans", "10 scans", "20 scans"], this.apart, (v) => { this.apart = v; }), " before DATA"),
      el("label", {}, "guess ", select([0, 1], ["none (identity)", "motion by WM"], this.byWm, (v) => { this.byWm = v; })),
      el("span", { class: "faint" }, "the production method, as `rcs register`"));
  }
  build() {
    const { data, model } = this.pair;
    const figure = (name, text) => {
      const canvas = el("canvas", { class: "figure", role: "img", "aria-label": text });
      this[name] = canvas;
      return el("figure", {}, canvas, el("figcaption", {}, text));
    };
    const legend = el("div", { class: "legend faint" },
      `gray squares: MODEL, scan ${model.scan_id}; blue dots: DATA, scan ${data.scan_id}; magenta: a point and its closest point; from above, x forward to the right`);
    this.panel.replaceChildren(this.controls(), legend,
      el("div", { class: "figures" },
        figure("before", "(a) before"), figure("after", "(b) after"),
        figure("beforeDetail", "(c) before, 5 m magnified"), figure("afterDetail", "(d) after, 5 m magnified")),
      el("div", { class: "numbers" }, figure("histogram", "(e) distances"), el("div", { class: "block" }, table(this.pair))));
  }
  draw() {
    if (!this.pair || this.panel.offsetParent === null) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    const colors = palette(this.isDark());
    const { pair } = this;
    const [area, detail] = [windowOf(pair), detailOf(pair)];
    drawCloud(this.before, pair, pair.before, pair.guess, area, colors, ratio);
    drawCloud(this.after, pair, pair.after, pair.T_model_data, area, colors, ratio);
    drawCloud(this.beforeDetail, pair, pair.before, pair.guess, detail, colors, ratio);
    drawCloud(this.afterDetail, pair, pair.after, pair.T_model_data, detail, colors, ratio);
    drawHistogram(this.histogram, pair, colors, ratio);
  }
}
