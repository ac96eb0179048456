// The values of the route, the point or the terrain cell under the pointer.

import { lineDistance, rotation, rotate } from "./math.js";
import { routeText } from "./routes.js";
import { FLOATS } from "./shapes.js";

const REACH_PX = 8;
const LINE_PX = 5;

function routeAt(view, x, y) {
  if (!view.show.routes) return null;
  return (view.routeLines ?? []).find(({ at }) => {
    const s = at.map((p) => view.camera.toScreen(view.lastView.matrix, p));
    return s.some((p, i) => i > 0 && p && s[i - 1] && lineDistance(s[i - 1], p, x, y) < LINE_PX);
  })?.route ?? null;
}

/** @returns text for the route, else the point of the scan, else the cell at a position, or "" */
export function valueAt(view, x, y) {
  if (!view.lastView) return "";
  const route = routeAt(view, x, y);
  if (route) return routeText(view.routes, route);
  const m = view.lastView.matrix;
  let best = { d: REACH_PX ** 2, text: null };
  const look = (p, text) => {
    const s = view.camera.toScreen(m, p);
    if (!s) return;
    const d = (s[0] - x) ** 2 + (s[1] - y) ** 2;
    if (d < best.d) best = { d, text };
  };
  if (view.show.scan && view.scan?.world) {
    const { world, n } = view.scan;
    for (let i = 0; i < n; ++i) look([world[3 * i], world[3 * i + 1], world[3 * i + 2]], () => pointText(view.scan, i));
  }
  if (best.text === null && view.show.terrain && view.terrain && view.T_world_local) {
    const R = rotation(view.T_world_local.q);
    const t = view.T_world_local.p;
    const v = view.terrain.vertices;
    for (let i = 0; i < v.length; i += FLOATS) {
      const p = rotate(R, [v[i], v[i + 1], v[i + 2]]);
      look([p[0] + t[0], p[1] + t[1], p[2] + t[2]], () => cellText(view.patch, v[i], v[i + 1]));
    }
  }
  return best.text === null ? "" : best.text();
}

function pointText({ xyz, ring }, i) {
  const [x, y, z] = xyz.slice(3 * i, 3 * i + 3);
  return `point of the scan\nforward ${x.toFixed(2)} m, left ${y.toFixed(2)} m, up ${z.toFixed(2)} m\n` +
    `range ${Math.hypot(x, y, z).toFixed(2)} m${ring ? `, row ${ring[i]}` : ""}`;
}

function cellText(p, x, y) {
  const k = (Math.floor(y / p.cell_m) - p.first_j) * p.width + Math.floor(x / p.cell_m) - p.first_i;
  return `terrain cell: ${p.flags[k] & 2 ? "obstacle" : "passable"}\nslope ${p.slope_deg[k]}°, ` +
    `roughness ${p.roughness_cm[k]} cm, step ${p.step_cm[k]} cm\n` +
    `height ${(p.base_m + p.height_cm[k] / 100).toFixed(2)} m (frame local)`;
}
