// Axes and curves on a 2D canvas.

import { niceStep } from "./overlay.js";

export const FONT = '11px system-ui, "Liberation Sans", "DejaVu Sans", sans-serif';

/** A rectangle with a value axis. */
export class Plot {
  /** @param o {top, height, left, right, title, unit, log, low, high} */
  constructor(o) { Object.assign(this, o); }

  y(value) {
    const [a, b, v] = this.log
      ? [Math.log10(this.low), Math.log10(this.high), Math.log10(Math.max(value, this.low))]
      : [this.low, this.high, value];
    const share = Math.min(1, Math.max(0, (v - a) / (b - a)));
    return this.top + this.height * (1 - share);
  }
  ticks() {
    if (this.log) {
      const out = [];
      for (let e = Math.ceil(Math.log10(this.low) - 1e-9); 10 ** e <= this.high * 1.0001; ++e) out.push(10 ** e);
      return out;
    }
    const step = niceStep((this.high - this.low) / Math.max(1, this.height / 22));
    const out = [];
    for (let v = Math.ceil(this.low / step) * step; v <= this.high + 1e-9; v += step) out.push(Number(v.toFixed(9)));
    return out;
  }
  drawAxes(c, colors) {
    c.font = FONT;
    c.lineWidth = 1;
    c.textAlign = "right";
    c.textBaseline = "middle";
    for (const v of this.ticks()) {
      const y = Math.round(this.y(v)) + 0.5;
      c.strokeStyle = colors.line;
      c.globalAlpha = 0.6;
      c.beginPath(); c.moveTo(this.left, y); c.lineTo(this.right, y); c.stroke();
      c.globalAlpha = 1;
      c.fillStyle = colors.faint;
      c.fillText(v >= 1e4 ? v.toExponential(0) : String(v), this.left - 5, y);
    }
    c.textAlign = "left";
    c.textBaseline = "alphabetic";
  }
  /** @param x function of time to pixels; @param o {color, width, dash} */
  drawCurve(c, series, x, from, to, o) {
    const { t, v } = series;
    let i = lowerBound(t, from);
    i = Math.max(0, i - 1);
    c.save();
    c.beginPath();
    c.rect(this.left, this.top - 1, this.right - this.left, this.height + 2);
    c.clip();
    c.strokeStyle = o.color;
    c.lineWidth = o.width ?? 1.5;
    c.setLineDash(o.dash ?? []);
    c.beginPath();
    let last = null;
    for (; i < t.length; ++i) {
      const [px, py] = [x(t[i]), this.y(v[i])];
      // A gap in the data is a gap in the curve.
      if (last === null || t[i] - last > (o.gap_s ?? 2)) c.moveTo(px, py);
      else c.lineTo(px, py);
      last = t[i];
      if (t[i] > to) break;
    }
    c.stroke();
    c.restore();
  }
}

export function lowerBound(sorted, value) {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const mid = (low + high) >> 1;
    if (sorted[mid] < value) low = mid + 1;
    else high = mid;
  }
  return low;
}

/** The value at or before t, if it is not older than `within`; else null. */
export function valueBefore(series, t, within = 2) {
  const i = lowerBound(series.t, t + 1e-6) - 1;
  return i >= 0 && t - series.t[i] <= within ? series.v[i] : null;
}

/** Times of an axis: "97.5", "1:37". */
export function timeText(t) {
  if (t < 600) return `${Number(t.toFixed(2))} s`;
  const minutes = Math.floor(t / 60);
  return `${minutes} min ${Number((t - 60 * minutes).toFixed(1))} s`;
}
