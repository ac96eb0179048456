// The candidate routes of the mission: the chosen one solid, the others dashed, with their names.

import { palette, rgba } from "./colors.js";
import { lineDistance } from "./math.js";

export const CHOSEN = 0; // VERDICT_* of route_t
const VERDICTS = ["chosen", "rejected: its cost is higher",
  "rejected: the protection level would exceed the alert limit", "not judged yet"];
const NAMES = ["chosen route", "rejected: cost", "rejected: alert limit", "not judged yet"];

/** The point of a route that is farthest from the other ones: there its name is seen best. */
function namePoint(at, others) {
  const clearance = ([x, y]) => Math.min(...others.flatMap((o) => o.slice(1).map((p, i) => lineDistance(o[i], p, x, y))));
  const distances = at.map(clearance);
  return at[distances.indexOf(Math.max(...distances))];
}

/** The routes have no heights: they are drawn at the height of the ground below the vehicle. */
export function updateRoutes(view) {
  const z = Math.round(((view.T_world_vehicle?.p[2] ?? 0) - 0.75) * 4) / 4;
  const key = [z, view.dark].join();
  if (!view.routesDirty && key === view.routesKey) return;
  view.routesDirty = false;
  view.routesKey = key;
  for (const set of [view.chosenSet, view.rejectedSet]) view.renderer.free(set);
  view.routeLines = (view.routes?.route ?? []).map((route) =>
    ({ route, at: Array.from(route.x_m, (x, i) => [x, route.y_m[i], z]) }));
  for (const line of view.routeLines) {
    line.name = namePoint(line.at, view.routeLines.filter((l) => l !== line).map((l) => l.at));
  }
  const tint = rgba(palette(view.dark).route);
  const lines = (wanted) => view.renderer.makeLines(view.routeLines.filter(({ route }) => wanted(route))
    .flatMap(({ at }) => at.slice(1).map((p, i) => [at[i], p, tint])));
  view.chosenSet = lines((route) => route.verdict === CHOSEN);
  view.rejectedSet = lines((route) => route.verdict !== CHOSEN);
}

export function drawRouteNames(c, view, colors) {
  if (!view.show.routes) return;
  c.fillStyle = colors.text;
  c.strokeStyle = colors.panel;
  c.lineWidth = 3;
  c.textAlign = "left";
  for (const { route, name } of view.routeLines ?? []) {
    const at = name ? view.camera.toScreen(view.lastView.matrix, name) : null;
    if (!at) continue;
    const text = [NAMES[route.verdict] ?? "?", at[0] + 7, at[1] - 5];
    c.strokeText(...text);
    c.fillText(...text);
  }
}

const value = (v, digits, unit) => (v < 1e6 ? `${v.toFixed(digits)} ${unit}` : "not predicted");

export function routeText(routes, route) {
  return `route ${routes.route.indexOf(route) + 1} of ${routes.route.length}: ${VERDICTS[route.verdict] ?? "?"}\n` +
    `length ${route.length_m.toFixed(0)} m, time ${route.time_s.toFixed(0)} s, cost ${value(route.cost_s, 0, "s")}\n` +
    `without GPS: protection level ${value(route.level_max_m, 1, "m")}, alert limit ${routes.alert_limit_m.toFixed(1)} m`;
}
