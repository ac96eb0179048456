// The status: mode, integrity, sources, driving, nodes and the last events.

import { palette } from "./colors.js";

/** An element with attributes and children; texts are never interpreted as HTML. */
export function el(name, attributes = {}, ...children) {
  const e = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "class") e.className = value;
    else if (key.startsWith("on")) e.addEventListener(key.slice(2), value);
    else e.setAttribute(key, value);
  }
  e.append(...children.filter((c) => c !== null && c !== undefined));
  return e;
}

const number = (v, digits = 2) => (v === null || v === undefined ? "–" : v.toFixed(digits));
const age = (s) => (s === null || s === undefined ? "never"
  : s < 1 ? `${Math.round(1000 * s)} ms` : s < 100 ? `${s.toFixed(1)} s` : `${Math.round(s)} s`);
const MODE_TEXT = {
  ALIGN: "attitude and velocity are being initialized", GPS_INS: "GPS and INS",
  GPS_INS_LADAR: "GPS, INS and LADAR", INS_LADAR: "INS and LADAR, without GPS",
  INS_DR: "dead reckoning: INS and odometry", GPS_LADAR: "GPS without INS",
  LADAR: "LADAR alone", LOST: "no source: the pose is not usable",
};
const SOURCE_CLASS = {
  accepted: "good", none: "off", quarantine: "bad", probation: "warn", suspect: "warn", readmitting: "warn",
};

/** A bar of `value` against `limit`, on a logarithmic scale from 1 cm. */
function meter(value, limit, color) {
  const scale = (v) => Math.min(100, Math.max(1, (100 * Math.log10(v / 0.01)) / Math.log10((2 * limit) / 0.01)));
  const bar = el("i");
  bar.style.width = value === null ? "100%" : `${scale(value)}%`;
  bar.style.background = value === null ? "repeating-linear-gradient(45deg, #8886 0 6px, transparent 6px 12px)" : color;
  const mark = el("b", { title: `alert limit ${limit} m` });
  mark.style.left = `${scale(limit)}%`;
  return el("div", { class: "meter" }, bar, mark);
}

function modeBlock(s) {
  if (!s.nav) return el("div", { class: "block" }, el("h2", {}, "mode"), el("div", { class: "faint" }, "no WM_NAV_STATE received"));
  const n = s.nav;
  const stale = n.age_s > 0.5;
  return el("div", { class: "block" }, el("h2", {}, "mode"),
    el("div", { class: `mode ${n.mode === "LOST" || stale ? "error" : ""}` }, n.mode),
    el("div", { class: "faint" }, MODE_TEXT[n.mode] ?? ""),
    stale ? el("div", { class: "error" }, `WM has been silent for ${age(n.age_s)}`) : null,
    el("table", {},
      row("pose", n.pose_valid ? (n.world_valid ? "valid, georeferenced" : "valid in frame local") : "invalid"),
      row("speed", `${number(n.speed_mps)} m/s`),
      row("heading", `${number(n.heading_deg, 1)}° from north`),
      row("east, north, up", n.p_world_m.map((v) => number(v)).join(", ") + " m"),
      n.world_valid ? row("lat, lon", `${number(n.lat_deg, 7)}°, ${number(n.lon_deg, 7)}°`) : null,
      row("driven since a fix", `${number(n.distance_since_gps_m, 1)} m`)));
}

const row = (name, ...cells) => el("tr", {}, el("td", {}, name), ...cells.map((c) => el("td", {}, c)));

function integrityBlock(s, colors) {
  const i = s.integrity;
  if (!i) return null;
  const bar = (label, value, limit) => [
    el("div", {}, `${label}: `, el("b", {}, value === null ? "no bound" : `${number(value)} m`),
      el("span", { class: "faint" }, ` limit ${number(limit, 1)} m`)),
    meter(value, limit, value !== null && value <= limit ? colors.level : colors.rejected)];
  const sigma = s.nav?.sigma_m;
  return el("div", { class: "block" }, el("h2", {}, "integrity"),
    ...bar("protection level, horizontal", i.protection_horizontal_m, i.limit_horizontal_m),
    ...bar("vertical", i.protection_vertical_m, i.limit_vertical_m),
    sigma ? el("div", { class: "faint" }, `1 σ forward ${number(sigma[0], 3)}, left ${number(sigma[1], 3)}, up ${number(sigma[2], 3)} m`) : null,
    i.alerts === "none" ? null : el("div", { class: "error" }, `alert: ${i.alerts}`));
}

function sourcesBlock(s) {
  if (!s.integrity && !s.nav) return null;
  const ages = s.nav?.source_age_s ?? {};
  const pill = (status) => el("span", { class: `pill ${SOURCE_CLASS[status] ?? "off"}` }, status);
  const line = (name, status, key) => row(name, status ? pill(status) : "", age(ages[key]));
  const fix = s.fix ? `GPS, ${s.fix.type.replace("_", " ")}, ${s.fix.satellites} satellites` : "GPS";
  return el("div", { class: "block" }, el("h2", {}, "sources"),
    el("table", {},
      el("tr", {}, el("th", {}, "source"), el("th", {}, "status"), el("th", {}, "accepted before")),
      line(fix, s.integrity?.gps, "gps"), line("INS", s.integrity?.ins, "ins"),
      line("LADAR", s.integrity?.ladar, "rolling"), line("odometry", null, "odometry"),
      ages["prior map"] === null || ages["prior map"] === undefined ? null : line("a priori map", null, "prior map")));
}

function routesLine(r) {
  const c = r.chosen;
  const level = c && c.level_max_m !== null ? `${number(c.level_max_m, 1)} m` : "infinite";
  return el("div", { class: "faint" }, `routes: ${r.candidates}; ` + (c
    ? `chosen: ${number(c.length_m, 0)} m, ${number(c.time_s, 0)} s, protection level ${level}, limit ${number(r.alert_limit_m, 1)} m`
    : "none is chosen"));
}

/** @param node BG or the mission: {state, status, reason, emergency_stop} */
function stateBlock(title, node, more = null) {
  if (!node) return null;
  return el("div", { class: "block" }, el("h2", {}, title),
    el("div", {}, el("b", {}, node.state), ` (${node.status.toLowerCase()})`),
    node.reason ? el("div", { class: "warn" }, node.reason) : null,
    node.emergency_stop && node.emergency_stop !== "none" ? el("div", { class: "error" }, `emergency stop: ${node.emergency_stop}`) : null,
    more);
}

function nodesBlock(s) {
  if (!s.nodes.length) {
    return el("div", { class: "block" }, el("h2", {}, "nodes"),
      el("div", { class: "faint" }, "no computing times: a replay has none, only a live run"));
  }
  const over = (v, limit) => (v !== null && limit !== null && v > limit ? "over" : "");
  return el("div", { class: "block" }, el("h2", {}, "nodes: computing time of the last 5 s [ms]"),
    el("table", {},
      el("tr", {}, ...["node", "p50", "p99", "max", "overruns", "CPU", "MB"].map((h) => el("th", {}, h))),
      ...s.nodes.map((n) => el("tr", { title: n.note || (n.alive ? "" : "no statistics for 3 s") },
        el("td", { class: n.alive ? "" : "error" }, n.node + (n.degrade_level ? ` L${n.degrade_level}` : "") + (n.alive ? "" : " †")),
        el("td", {}, number(n.p50_ms, 1)), el("td", { class: over(n.p99_ms, n.budget_ms) }, number(n.p99_ms, 1)),
        el("td", { class: over(n.max_ms, n.budget_ms) }, number(n.max_ms, 1)),
        el("td", { class: n.overruns ? "over" : "" }, String(n.overruns)),
        el("td", {}, n.cpu_percent === null ? "–" : `${Math.round(n.cpu_percent)} %`),
        el("td", {}, n.rss_mb ? n.rss_mb.toFixed(0) : "–")))));
}

function eventsBlock(events, t, onSeek) {
  const list = events.filter((e) => e.t <= t + 1e-6).slice(-14).reverse();
  const marks = ["·", "▲", "◆"];
  const classes = ["faint", "warn", "error"];
  return el("div", { class: "block" }, el("h2", {}, "last events"),
    list.length === 0 ? el("div", { class: "faint" }, "none") : el("ul", { class: "events" },
      ...list.map((e) => el("li", {}, el("button", { onclick: () => onSeek(e.t), title: "Go to this moment", "data-key": `${e.t} ${e.code}` },
        el("span", { class: classes[e.severity] ?? "" }, `${marks[e.severity] ?? "?"} `),
        el("span", { class: "faint" }, `${e.t.toFixed(1)} s ${e.node} `), el("span", { class: "code" }, e.code),
        `: ${e.text}`)))));
}

/** Rebuilds the panel. @param state of the control connection; events of the timeline */
export function showStatus(panel, state, events, dark, onSeek) {
  const s = state.status;
  const scroll = panel.scrollTop;
  const focused = panel.contains(document.activeElement) ? document.activeElement.dataset.key : null;
  panel.replaceChildren(...[
    modeBlock(s), integrityBlock(s, palette(dark)), sourcesBlock(s),
    stateBlock("mission", s.mission, s.routes ? routesLine(s.routes) : null), stateBlock("driving", s.bg), nodesBlock(s),
    eventsBlock(events, state.t, onSeek),
  ].filter((b) => b));
  panel.scrollTop = scroll;
  if (focused) [...panel.querySelectorAll("button")].find((b) => b.dataset.key === focused)?.focus({ preventScroll: true });
}
