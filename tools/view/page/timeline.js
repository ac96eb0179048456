// The timeline: what the system was in (lanes), what it reported (events), bounds against errors,
// registration, ages and computing times. A click goes to the moment.

import {
  palette, FAILURE, FIX_COLORS, MODE_COLORS, SERIES_COLORS, STATE_COLORS, STATUS_COLORS, textOn,
} from "./colors.js";
import { maxOf } from "./math.js";
import { FONT, Plot, timeText, valueBefore } from "./plot.js";
import { niceStep } from "./overlay.js";

const LEFT = 112;
const RIGHT = 14;
const LANE = 15;
const byStatus = { color: (v) => STATUS_COLORS[v] ?? "#888888", failure: (v) => v === "quarantine" };
const byState = { color: (v) => STATE_COLORS[v] ?? FAILURE, failure: (v) => !STATE_COLORS[v] };
/** `failure`: such values are hatched. */
const LANES = [
  { key: "mode", label: "mode of WM", color: (v) => MODE_COLORS[v] ?? "#888888", failure: (v) => v === "LOST" },
  { key: "gps", label: "GPS", ...byStatus },
  { key: "ladar", label: "LADAR", ...byStatus },
  { key: "ins", label: "INS", ...byStatus },
  { key: "fix", label: "type of fix", color: (v) => FIX_COLORS[v] ?? "#888888", failure: () => false },
  { key: "alerts", label: "alerts", color: (v) => (v === "none" ? "#b8bec6" : FAILURE), failure: (v) => v !== "none" },
  { key: "mission", label: "state of mission", ...byState },
  { key: "bg", label: "state of BG", ...byState },
];
const SEVERITY = ["info", "warning", "error"];

/** Curves of a plot: key of the series, label, color (a name of the palette or an index), width. */
const bounds = (axis) => [
  [`protection_${axis}_m`, "protection level", "level", 2], [`sigma3_${axis}_m`, "3 σ", "sigma", 1.6],
  [`error_${axis}_m`, "true error", "error", 1.6], [`limit_${axis}_m`, "alert limit", "limit", 1.2],
];
const REGISTRATION = [
  ["overlap", "overlap of the scan", 0], ["observability", "observability", 1],
  ["mean_distance_m", "mean distance [m]", 3],
];
const AGES = [
  ["age_gps_s", "GPS", 0], ["age_rolling_map_s", "LADAR", 1], ["age_odometry_s", "odometry", 2],
  ["age_ins_s", "INS", 3], ["age_prior_map_s", "a priori map", 4],
];
const TESTS = [
  ["gps_test_ratio", "GPS", 0], ["ladar_test_ratio", "LADAR", 1],
  ["degrade_level", "degrade level of SP", 3],
];
const NODES = ["sp", "wm", "bg", "mission", "gateway", "ros2_bridge"]
  .map((node, i) => [`cycle_${node}_ms`, node, i]);
const meters = { unit: "m", log: true, low: 0.01, high: 100 };
const PLOTS = [
  { title: "horizontal position [m]", ...meters, list: bounds("horizontal") },
  { title: "vertical position [m]", ...meters, list: bounds("vertical") },
  { title: "registration", unit: "", log: true, low: 1e-4, high: 1, list: REGISTRATION },
  { title: "age of measurements [s]", unit: "s", log: true, low: 0.01, high: 100, list: AGES },
  { title: "computing time [ms]", unit: "ms", log: true, low: 0.1, high: 1000, list: NODES },
  { title: "test ratios (limit 1), degrade level", unit: "", log: false, low: 0, least: 1.5, list: TESTS },
  { title: "speed [m/s]", unit: "m/s", log: false, low: 0, least: 1, list: [["speed_mps", "speed", 0]] },
];
/** Each curve of a plot has its own. */
const DASHES = [[], [7, 3], [2, 2], [9, 3, 2, 3], [14, 4], [4, 6]];
const SAMPLE = 34; // of a curve, in the legend [px]
const MIN_PLOT = 52; // with its title [px]

export class Timeline {
  /** @param onSeek called with the time of a click; onRange when the shown interval changes */
  constructor(canvas, onSeek, onChange) {
    this.canvas = canvas;
    this.onSeek = onSeek;
    this.onChange = onChange;
    this.data = null;
    this.time = 0;
    this.from = 0;
    this.to = 10;
    this.end = 10;
    this.zoomed = false;
    this.first = 0; // of the plots, if there is no room for all
    this.dark = false;
    this.hover = null;
    this.layer = document.createElement("canvas");
    this.listen();
  }
  /** What does not change with the time is drawn once. */
  get key() {
    return [this.from, this.to, this.end, this.dark, this.canvas.clientWidth, this.canvas.clientHeight,
      devicePixelRatio, this.version, this.first].join();
  }
  setData(data, end) {
    this.data = data;
    this.version = (this.version ?? 0) + 1;
    this.end = Math.max(1, end);
    if (!this.zoomed) [this.from, this.to] = [0, this.end];
    this.onChange();
  }
  setTime(t) { this.time = t; this.onChange(); }
  x(t) { return LEFT + ((t - this.from) / (this.to - this.from)) * (this.width - LEFT - RIGHT); }
  timeAt(px) {
    const share = (px - LEFT) / (this.width - LEFT - RIGHT);
    return Math.min(this.end, Math.max(0, this.from + share * (this.to - this.from)));
  }
  listen() {
    const c = this.canvas;
    let pressed = false;
    const seek = (e) => this.onSeek(this.timeAt(e.offsetX), e.type === "pointerdown");
    c.addEventListener("pointerdown", (e) => {
      if (e.offsetX < LEFT - 4) return;
      pressed = true;
      c.setPointerCapture(e.pointerId);
      seek(e);
    });
    c.addEventListener("pointermove", (e) => {
      this.hover = [e.offsetX, e.offsetY];
      if (pressed) seek(e);
      this.onChange();
    });
    c.addEventListener("pointerup", () => { pressed = false; });
    c.addEventListener("pointerleave", () => { this.hover = null; this.onChange(); });
    c.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(Math.exp(e.deltaY * 0.0015), this.timeAt(e.offsetX));
    }, { passive: false });
    c.addEventListener("dblclick", () => this.setRange(0, this.end));
  }
  /** The shown interval becomes k times as long; the time `at`, else the moment, stays where it is. */
  zoom(k, at = this.time >= this.from && this.time <= this.to ? this.time : 0.5 * (this.from + this.to)) {
    this.setRange(at - (at - this.from) * k, at + (this.to - at) * k);
  }
  nextPlots() {
    this.first = this.hidden ? this.first + this.plots.length : 0;
    this.onChange();
  }
  setRange(from, to) {
    const span = Math.min(this.end, Math.max(0.5, to - from));
    this.from = Math.min(Math.max(0, from), this.end - span);
    this.to = this.from + span;
    this.zoomed = span < this.end - 1e-6;
    this.onChange();
  }

  draw(ratio) {
    const canvas = this.canvas;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    this.width = w;
    canvas.width = Math.max(1, Math.round(w * ratio));
    canvas.height = Math.max(1, Math.round(h * ratio));
    const colors = palette(this.dark);
    const c = canvas.getContext("2d");
    if (this.key !== this.layerKey) {
      this.layerKey = this.key;
      this.drawLayer(ratio, w, h, colors);
    }
    c.drawImage(this.layer, 0, 0);
    if (!this.data) return;
    c.scale(ratio, ratio);
    this.drawPlayhead(c, colors, h - 18);
    if (this.hover) this.drawHover(c, colors, w, h);
  }
  drawLayer(ratio, w, h, colors) {
    this.layer.width = this.canvas.width;
    this.layer.height = this.canvas.height;
    const c = this.layer.getContext("2d");
    c.scale(ratio, ratio);
    c.fillStyle = colors.panel;
    c.fillRect(0, 0, w, h);
    if (!this.data) return;
    let top = 6;
    const lanes = LANES.filter((lane) => this.data.lanes[lane.key]?.length);
    for (const lane of lanes) {
      this.drawLane(c, colors, lane, top);
      top += LANE + 2;
    }
    this.eventsTop = top;
    this.drawEvents(c, colors, top);
    top += 20;
    this.plots = this.layoutPlots(top, h - 20);
    for (const plot of this.plots) this.drawPlot(c, colors, plot);
    if (this.plots.length < this.total) {
      c.fillStyle = colors.faint;
      c.textAlign = "right";
      c.fillText(`plots ${this.first + 1}–${this.first + this.plots.length} of ${this.total} (g)`, LEFT - 16, h - 3);
      c.textAlign = "left";
    }
    this.drawTimeAxis(c, colors, h - 18);
  }
  drawLane(c, colors, lane, top) {
    c.font = FONT;
    c.fillStyle = colors.text;
    c.textAlign = "right";
    c.fillText(lane.label, LEFT - 6, top + 11.5);
    c.textAlign = "left";
    const changes = this.data.lanes[lane.key];
    c.save();
    c.beginPath();
    c.rect(LEFT, top, this.width - LEFT - RIGHT, LANE);
    c.clip();
    for (let i = 0; i < changes.length; ++i) {
      const [t, value] = changes[i];
      const until = i + 1 < changes.length ? changes[i + 1][0] : this.end;
      if (until < this.from || t > this.to) continue;
      const [a, b] = [this.x(t), this.x(until)];
      const color = lane.color(value);
      const [left, right] = [Math.max(a, LEFT), Math.min(Math.max(b, a + 1), this.width - RIGHT)];
      c.fillStyle = color;
      c.fillRect(left, top, right - left, LANE);
      if (lane.failure(value)) hatch(c, textOn(color), left, top, right - left, LANE);
      const width = c.measureText(value).width;
      if (width < right - left - 7) {
        c.fillStyle = color;
        c.fillRect(left + 2, top, width + 4, LANE);
        c.fillStyle = textOn(color);
        c.fillText(value, left + 4, top + 11.5);
      }
    }
    c.restore();
  }
  drawEvents(c, colors, top) {
    c.font = FONT;
    c.fillStyle = colors.text;
    c.textAlign = "right";
    c.fillText("events", LEFT - 6, top + 12);
    c.textAlign = "left";
    for (const e of this.data.events) {
      if (e.t < this.from || e.t > this.to) continue;
      const x = this.x(e.t);
      const y = top + 8;
      c.beginPath();
      if (e.severity === 0) {
        c.fillStyle = colors.faint;
        c.arc(x, y, 2.6, 0, 2 * Math.PI);
      } else if (e.severity === 1) {
        c.fillStyle = colors.level;
        c.moveTo(x, y - 5); c.lineTo(x + 5, y + 4); c.lineTo(x - 5, y + 4);
      } else {
        c.fillStyle = colors.rejected;
        c.moveTo(x, y - 6); c.lineTo(x + 6, y); c.lineTo(x, y + 6); c.lineTo(x - 6, y);
      }
      c.fill();
    }
  }
  layoutPlots(top, bottom) {
    const series = this.data.series;
    const light = SERIES_COLORS[this.dark ? "dark" : "light"];
    const colors = palette(this.dark);
    const curves = (list) => list.map(([key, label, color, width], i) =>
      ({ key, label, color: typeof color === "number" ? light[color] : colors[color], dash: DASHES[i], width }))
      .filter(({ key }) => series[key]?.t.length);
    const specs = PLOTS.map((plot) => ({ ...plot, curves: curves(plot.list) })).filter((s) => s.curves.length);
    const room = bottom - top;
    const count = Math.max(1, Math.min(specs.length, Math.floor(room / MIN_PLOT)));
    const height = room / count;
    this.first = Math.max(0, Math.min(this.first, specs.length - count));
    this.hidden = specs.length - this.first - count; // after the shown ones
    this.total = specs.length;
    return specs.slice(this.first, this.first + count).map((spec, i) => {
      if (spec.log) this.fitLog(spec, series);
      else spec.high = Math.max(spec.least, 1.1 * Math.max(...spec.curves.map((k) => maxOf(series[k.key].v))));
      return new Plot({ ...spec, top: top + i * height + 15, height: height - 21, left: LEFT, right: this.width - RIGHT });
    });
  }
  /** Whole decades around the values. */
  fitLog(spec, series) {
    let [low, high] = [Infinity, 0];
    for (const curve of spec.curves) {
      for (const v of series[curve.key].v) {
        if (v > 0) { low = Math.min(low, v); high = Math.max(high, v); }
      }
    }
    if (!(high > 0)) return;
    spec.high = Math.max(spec.low * 100, 10 ** Math.ceil(Math.log10(high)));
    spec.low = Math.max(spec.low, Math.min(spec.high / 100, 10 ** Math.floor(Math.log10(low))));
  }
  drawPlot(c, colors, plot) {
    plot.drawAxes(c, colors);
    for (const curve of plot.curves) {
      plot.drawCurve(c, this.data.series[curve.key], (t) => this.x(t), this.from, this.to, curve);
    }
    c.font = FONT;
    c.textAlign = "left";
    let x = LEFT;
    c.fillStyle = colors.text;
    c.font = `bold ${FONT}`;
    c.fillText(plot.title, x, plot.top - 4);
    x += c.measureText(plot.title).width + 14;
    c.font = FONT;
    for (const curve of plot.curves) {
      c.strokeStyle = curve.color;
      c.lineWidth = 2;
      c.setLineDash(curve.dash);
      c.beginPath(); c.moveTo(x, plot.top - 8); c.lineTo(x + SAMPLE, plot.top - 8); c.stroke();
      c.setLineDash([]);
      c.fillStyle = colors.text;
      c.fillText(curve.label, x + SAMPLE + 4, plot.top - 4);
      x += SAMPLE + c.measureText(curve.label).width + 16;
    }
  }
  drawTimeAxis(c, colors, y) {
    c.font = FONT;
    c.strokeStyle = colors.faint;
    c.fillStyle = colors.faint;
    c.lineWidth = 1;
    c.textAlign = "center";
    const step = niceStep((this.to - this.from) / Math.max(2, (this.width - LEFT) / 110));
    c.beginPath(); c.moveTo(LEFT, y + 0.5); c.lineTo(this.width - RIGHT, y + 0.5); c.stroke();
    for (let t = Math.ceil(this.from / step) * step; t <= this.to + 1e-9; t += step) {
      const x = Math.round(this.x(t)) + 0.5;
      c.beginPath(); c.moveTo(x, y); c.lineTo(x, y + 4); c.stroke();
      c.fillText(timeText(Number(t.toFixed(6))), x, y + 15);
    }
    c.textAlign = "left";
  }
  drawPlayhead(c, colors, bottom) {
    const x = this.x(this.time);
    if (x < LEFT - 1 || x > this.width - RIGHT + 1) return;
    c.strokeStyle = colors.text;
    c.lineWidth = 1.5;
    c.beginPath(); c.moveTo(x, 2); c.lineTo(x, bottom); c.stroke();
    c.fillStyle = colors.text;
    c.beginPath(); c.moveTo(x - 5, 0); c.lineTo(x + 5, 0); c.lineTo(x, 6); c.fill();
  }
  drawHover(c, colors, w, h) {
    const [px, py] = this.hover;
    if (px < LEFT || px > w - RIGHT) return;
    const t = this.timeAt(px);
    c.strokeStyle = colors.faint;
    c.setLineDash([3, 3]);
    c.lineWidth = 1;
    c.beginPath(); c.moveTo(px, 2); c.lineTo(px, h - 18); c.stroke();
    c.setLineDash([]);
    const lines = [timeText(t), ...this.hoverLines(t, px, py)];
    c.font = FONT;
    const width = Math.min(430, Math.max(...lines.map((l) => c.measureText(l).width)) + 14);
    const height = 15 * lines.length + 8;
    const x = px + width + 16 < w ? px + 10 : px - width - 10;
    const y = Math.min(Math.max(2, py - height / 2), h - height - 2);
    c.fillStyle = colors.panel;
    c.strokeStyle = colors.faint;
    c.fillRect(x, y, width, height);
    c.strokeRect(x + 0.5, y + 0.5, width, height);
    c.fillStyle = colors.text;
    c.textAlign = "left";
    lines.forEach((line, i) => {
      c.font = i === 0 ? `bold ${FONT}` : FONT;
      c.fillText(line, x + 7, y + 15 + 15 * i, 416);
    });
  }
  hoverLines(t, px, py) {
    if (py >= this.eventsTop && py < this.eventsTop + 18) {
      return this.data.events.filter((e) => Math.abs(this.x(e.t) - px) < 6).slice(0, 8)
        .map((e) => `${SEVERITY[e.severity] ?? "?"}: ${e.node} ${e.code}: ${e.text}`);
    }
    const plot = this.plots?.find((p) => py >= p.top - 16 && py <= p.top + p.height);
    if (plot) {
      return plot.curves.map((k) => {
        const v = valueBefore(this.data.series[k.key], t);
        return `${k.label}: ${v === null ? "–" : `${Number(v.toPrecision(3))} ${plot.unit}`}`;
      });
    }
    return LANES.filter((lane) => this.data.lanes[lane.key]?.length).map((lane) => {
      const change = this.data.lanes[lane.key].filter(([at]) => at <= t).pop();
      return change ? `${lane.label}: ${change[1]}${change[2] ? ` (${change[2]})` : ""}` : "";
    }).filter((line) => line);
  }
}

function hatch(c, color, x, y, w, h) {
  c.save();
  c.beginPath();
  c.rect(x, y, w, h);
  c.clip();
  c.strokeStyle = color;
  c.lineWidth = 1;
  c.beginPath();
  for (let at = x - h; at < x + w; at += 6) { c.moveTo(at, y + h); c.lineTo(at + h, y); }
  c.stroke();
  c.restore();
}
