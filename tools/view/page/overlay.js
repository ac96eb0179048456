// Drawn over the 3D view: fixes of the GPS receiver, names of routes, scale bar, axes, the color bar
// and its values.

import { palette, rampCss } from "./colors.js";
import { project } from "./math.js";
import { drawRouteNames } from "./routes.js";

export function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  const m = rough / power;
  return (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10) * power;
}

const FIXES_S = 40; // before the moment; in the view of the whole run all

function fixesNow(view) {
  if (!view.timeline || !view.show.fixes) return [];
  const whole = !view.camera.view.follow;
  return view.timeline.fixes.filter((f) => f.t <= view.time + 1e-6 && (whole || f.t > view.time - FIXES_S));
}

function drawFixes(c, view, colors) {
  const m = view.lastView.matrix;
  for (const fix of fixesNow(view)) {
    const at = view.camera.toScreen(m, fix.p);
    if (!at) continue;
    const [x, y] = at;
    c.lineWidth = 1.6;
    c.beginPath();
    if (fix.verdict === 1) { // accepted: a circle
      c.strokeStyle = colors.accepted;
      c.arc(x, y, 3.2, 0, 2 * Math.PI);
    } else if (fix.verdict === 0) { // rejected: a cross
      c.strokeStyle = colors.rejected;
      c.lineWidth = 2.2;
      c.moveTo(x - 4, y - 4); c.lineTo(x + 4, y + 4);
      c.moveTo(x + 4, y - 4); c.lineTo(x - 4, y + 4);
    } else { // not tested: a square
      c.strokeStyle = colors.untested;
      c.rect(x - 2.5, y - 2.5, 5, 5);
    }
    c.stroke();
  }
}

function drawScaleBar(c, view, colors, w, h) {
  const perPixel = view.lastView.metersPerPixel;
  const length = niceStep(120 * perPixel);
  const pixels = length / perPixel;
  const [x, y] = [w - 18 - pixels, h - 18];
  c.strokeStyle = c.fillStyle = colors.text;
  c.lineWidth = 2;
  c.beginPath();
  c.moveTo(x, y - 4); c.lineTo(x, y); c.lineTo(x + pixels, y); c.lineTo(x + pixels, y - 4);
  c.stroke();
  const at = view.camera.view.flat ? "" : " at the vehicle";
  c.textAlign = "right";
  c.fillText(`${length < 1 ? length.toPrecision(1) : length} m${at}`, x + pixels, y - 8);
}

function drawAxes(c, view, colors, h) {
  const m = view.lastView.matrix;
  const center = view.camera.center;
  const size = view.lastView.metersPerPixel * 40;
  const o = project(m, center);
  const [cx, cy] = [44, h - 44];
  const axis = (d, label) => {
    const p = project(m, [center[0] + d[0] * size, center[1] + d[1] * size, center[2] + d[2] * size]);
    let dx = (p[0] - o[0]) * 0.5 * view.canvas.clientWidth;
    let dy = -(p[1] - o[1]) * 0.5 * view.canvas.clientHeight;
    const l = Math.hypot(dx, dy);
    if (l < 6) return;
    const k = Math.min(1, 30 / l);
    dx *= k; dy *= k;
    c.beginPath(); c.moveTo(cx, cy); c.lineTo(cx + dx, cy + dy); c.stroke();
    c.fillText(label, cx + dx * 1.28, cy + dy * 1.28 + 4);
  };
  c.strokeStyle = c.fillStyle = colors.text;
  c.lineWidth = 1.8;
  c.textAlign = "center";
  axis([1, 0, 0], "E"); axis([0, 1, 0], "N"); axis([0, 0, 1], "up");
}

export function drawOverlay(canvas, view, ratio) {
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.max(1, Math.round(w * ratio));
  canvas.height = Math.max(1, Math.round(h * ratio));
  const c = canvas.getContext("2d");
  c.scale(ratio, ratio);
  c.font = '12px system-ui, "Liberation Sans", "DejaVu Sans", sans-serif';
  const colors = palette(view.dark);
  drawFixes(c, view, colors);
  drawRouteNames(c, view, colors);
  drawAxes(c, view, colors, h);
  drawScaleBar(c, view, colors, w, h);
  if (view.show.grid && view.gridStep) {
    c.fillStyle = colors.faint;
    c.textAlign = "right";
    c.fillText(`grid ${view.gridStep} m`, w - 18, h - 42);
  }
}

/** Rebuilds the color bar only when it changes. */
export function showColorBar(element, scale) {
  const key = JSON.stringify(scale && [scale.title, scale.from, scale.to]);
  if (element.dataset.key === key) return;
  element.dataset.key = key;
  element.replaceChildren();
  if (!scale) return;
  const title = document.createElement("div");
  title.textContent = scale.title + (scale.unit ? ` [${scale.unit}]` : "");
  title.style.cssText = "text-align: right; width: 130px";
  const ramp = document.createElement("div");
  ramp.className = "ramp";
  ramp.style.background = rampCss(scale.ramp);
  const span = scale.to - scale.from;
  const step = niceStep(Math.abs(span) / 5);
  const [low, high] = [Math.min(scale.from, scale.to), Math.max(scale.from, scale.to)];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9; v += step) {
    const tick = document.createElement("span");
    tick.textContent = Number(v.toFixed(6)).toString();
    tick.style.bottom = `${(100 * (v - scale.from)) / span}%`;
    ramp.append(tick);
  }
  element.append(title, ramp);
}
