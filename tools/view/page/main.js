// Connects the panels with the server, the keyboard and the address.

import { ControlConnection, DataConnection } from "./connection.js";
import { palette } from "./colors.js";
import { VIEWS } from "./camera.js";
import { WorldView } from "./world_view.js";
import { drawOverlay, showColorBar } from "./overlay.js";
import { valueAt } from "./picking.js";
import { Timeline } from "./timeline.js";
import { el, showStatus } from "./status.js";
import { layerControls } from "./layers.js";
import { PairsPanel } from "./pairs.js";

const $ = (id) => document.getElementById(id);
const query = new URLSearchParams(location.search);
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];
const KEYS = [
  ["space", "play or pause"], ["← →", "1 s back or on; with shift 10 s"], [", .", "0.1 s back or on"],
  ["Home End", "begin or end of the log"], ["[ ]", "slower or faster"],
  ["z Z 0", "timeline: shorter, longer, whole run"], ["g", "timeline: the next plots, if there is no room for all"],
  ...Object.entries(VIEWS).map(([n, v]) => [n, `view: ${v.name}`]),
  ["j k ↑ ↓", "3D: turn; with shift move"], ["+ -", "nearer or farther"],
  ["c", "color of the points: height, age, row, range"], ["t", "terrain: classes, height, none"],
  ["x", "magnify the 3 σ ellipsoid: 1, 10, 100"], ["l", "show or hide the layers"],
  ["e", "explanation of this moment"],
  ["p", "one panel or all"], ["d", "light or dark"], ["Tab Enter", "next control or event; use it"], ["?", "these keys"],
];
const PANELS = ["all", "3d", "timeline", "status", "pairs"];
const STEP_PX = 40; // a key moves the camera as the mouse by so much

const app = {
  source: null, state: null, timeline: emptyTimeline(), generation: -1, status: {},
  dirty3d: true, dirtyTimeline: true, statusDirty: true, frames: 0, shownTime: null,
  world: null, linkOpened: false, opening: null, explained: null,
};

function emptyTimeline() {
  return { series: {}, lanes: {}, events: [], track: [], truth: [], fixes: [] };
}
/** The address: #t=97.5&log=NAME, a moment and the log to which it belongs; null: not stated. */
function link() {
  const parts = new URLSearchParams(location.hash.slice(1));
  const t = Number.parseFloat(parts.get("t"));
  return { t: Number.isFinite(t) ? t : null, log: parts.get("log") };
}
const fileName = (path) => path.split("/").pop();

// ---- light and dark ---------------------------------------------------------------------------
function setTheme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  app.dark = dark;
  app.world?.setDark(dark);
  timeline.dark = dark;
  app.dirtyTimeline = app.statusDirty = true;
  app.layers?.refresh();
  pairs.draw();
}
function initialTheme() {
  const wanted = query.get("theme") ?? localStorage.getItem("rcs-theme");
  return wanted ? wanted === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

// ---- panels -------------------------------------------------------------------------------------
const timeline = new Timeline($("timeline"), (t, begun) => { seek(t); if (begun) explain(t); },
  () => { app.dirtyTimeline = true; });
try {
  app.world = new WorldView($("gl"), () => { app.dirty3d = true; });
} catch (error) {
  notice(error.message);
  app.failure = error.message;
}
function notice(text) {
  $("notice").textContent = text;
  $("notice").hidden = text === "";
}
document.body.dataset.panel = query.get("panel") ?? "all";
const pairs = new PairsPanel($("panel-pairs"), () => app.dark);
if (app.world) app.layers = layerControls($("layers"), app.world, () => { app.dirty3d = true; });

// ---- server -------------------------------------------------------------------------------------
/** A message of the server is shown for some seconds, a lost connection until it is back. */
function connectionStatus(text, lasting = true) {
  $("connection").textContent = text;
  clearTimeout(app.statusTimer);
  if (!lasting) app.statusTimer = setTimeout(() => { $("connection").textContent = ""; }, 6000);
}
const control = new ControlConnection(onControl, connectionStatus);
const handlers = app.world ? {
  "/rcs/WM_NAV_STATE": (m) => app.world.onNav(m),
  "/rcs/WM_INTEGRITY": (m) => app.world.onIntegrity(m),
  "/rcs/WM_MAP_PATCH": (m) => app.world.onPatch(m),
  "/rcs/BG_PLAN": (m) => app.world.onPlan(m),
  "/rcs/MISSION_ROUTES": (m) => app.world.onRoutes(m),
  "/sp/points": (m) => app.world.onCloud("sp", m),
  "/ladar/points": (m) => app.world.onCloud("ladar", m),
  "/view/scan_pose": (m) => app.world.onScanPose(m),
  "/tf": (m) => app.world.onTf(m),
} : {};
const data = new DataConnection(handlers, connectionStatus);

function onControl(m) {
  if (m.op === "source") {
    app.source = m;
    document.body.classList.toggle("live", m.live);
    $("source").textContent = m.live ? `live: ${m.name}` : fileName(m.name);
    $("source").title = m.name;
    document.title = `rcs view: ${m.live ? "live" : fileName(m.name)}`;
    app.generation = -1;
    loadTimeline();
    // After a lost connection the moment is that of the server: a seek would move all clients.
    if (!app.linkOpened) openLink();
  } else if (m.op === "state") {
    const jumped = app.state && (m.t < app.state.t - 0.01 || m.t > app.state.t + 3 * m.speed);
    app.state = m;
    if (app.opening !== null && Math.abs(m.t - app.opening) < 0.05) app.opening = null;
    app.stateAt = performance.now();
    app.statusDirty = true;
    if (jumped) onJump();
    setTime(m.t);
    $("play").textContent = m.playing ? "⏸" : "▶";
    $("speed").value = String(m.speed);
  } else if (m.op === "error") {
    connectionStatus(m.message, false);
  }
}

/** A moment of another log is not opened: here it would be any moment. */
function openLink() {
  app.linkOpened = true;
  const { t, log } = link();
  const other = log !== null && (app.source.live || fileName(log) !== fileName(app.source.name));
  $("other-log").hidden = !other;
  if (other) {
    $("other-log").firstElementChild.textContent = `The link is to a moment of the log ${fileName(log)}. This viewer shows ` +
      `${app.source.live ? "the bus" : fileName(app.source.name)}; the moment was not opened.`;
  } else if (t !== null && !app.source.live) {
    seek(t);
    app.opening = app.wanted;
  }
}

/** What was shown before a jump is not of this moment. */
function onJump() {
  loadRecent();
}
async function loadRecent() {
  if (!app.world || !app.source || app.source.live) return;
  const t = app.state.t;
  const response = await fetch(`api/scans?t=${t}`);
  if (!response.ok || Math.abs(app.state.t - t) > 1) return;
  const buffer = await response.arrayBuffer();
  const view = new DataView(buffer);
  const parts = [];
  for (let at = 0; at + 16 <= buffer.byteLength;) {
    const [stamp, n] = [view.getFloat64(at, true), view.getUint32(at + 8, true)];
    parts.push({ stamp, xyz: new Float32Array(buffer, at + 16, 3 * n) });
    at += 16 + 12 * n;
  }
  app.world.setRecent(parts);
}

async function loadTimeline() {
  const live = app.source.live;
  const since = live && app.generation >= 0 ? `?since=${app.timeline.end_s ?? 0}` : "";
  try {
    const part = await (await fetch(`api/timeline${since}`)).json();
    if (since && part.generation === app.generation) merge(app.timeline, part);
    else if (since) app.generation = -1; // earlier content changed: from the begin, next time
    else { app.timeline = part; app.generation = part.generation; }
    if (!since) app.generation = part.generation;
    timeline.setData(app.timeline, live ? app.timeline.end_s : app.source.duration_s);
    app.world?.setTimeline(app.timeline);
    app.statusDirty = true;
    app.timelineLoaded = true;
  } catch { /* the server is gone; the connection says so */ }
  clearTimeout(app.timelineTimer);
  if (live) app.timelineTimer = setTimeout(loadTimeline, 1000);
}
function merge(whole, part) {
  for (const [name, s] of Object.entries(part.series)) {
    const to = (whole.series[name] ??= { t: [], v: [] });
    to.t.push(...s.t);
    to.v.push(...s.v);
  }
  for (const [lane, changes] of Object.entries(part.lanes)) (whole.lanes[lane] ??= []).push(...changes);
  whole.events.push(...part.events);
  whole.track.push(...part.track);
  whole.truth.push(...part.truth);
  const from = part.fixes.length ? part.fixes[0].t : Infinity;
  whole.fixes = whole.fixes.filter((f) => f.t < from - 1e-6).concat(part.fixes);
  whole.end_s = part.end_s;
}

// ---- time -----------------------------------------------------------------------------------------
function setTime(t) {
  timeline.setTime(t);
  app.world?.setTime(t);
  const utc = new Date((app.source?.begin_utime ?? 0) / 1000 + 1000 * t);
  const clock = el("span", {}, el("b", {}, `${t.toFixed(2)} s`),
    ` ${app.source?.live ? "" : `of ${app.source?.duration_s.toFixed(1)} s, `}${utc.toISOString().slice(11, 23)} UTC`);
  $("clock").replaceChildren(clock);
}
let seekTimer = null;
function seek(t) {
  if (!app.source || app.source.live) return;
  const to = Math.min(app.source.duration_s, Math.max(0, t));
  // One request for each frame is enough while the mouse drags.
  app.wanted = to;
  app.opening = null;
  if (seekTimer !== null) return;
  seekTimer = setTimeout(() => { seekTimer = null; }, 40);
  send();
  function send() {
    const sent = app.wanted;
    app.world?.jump();
    control.send({ op: "seek", t: sent });
    clearTimeout(app.afterSeek);
    app.afterSeek = setTimeout(() => {
      if (app.wanted !== sent) send();
      history.replaceState(null, "", `${location.pathname}${location.search}#t=${Number(app.wanted.toFixed(2))}` +
        `&log=${encodeURIComponent(fileName(app.source.name))}`);
      loadRecent();
    }, 120);
  }
}
async function explain(t) {
  if (!app.source || app.source.live) return;
  app.explaining = t;
  const why = await (await fetch(`api/why?t=${t}`)).json();
  if (app.explaining !== t || !why) return;
  $("why-time").textContent = `at ${t.toFixed(2)} s: what WM, SP and BG knew and decided (rcs why)`;
  $("why-text").textContent = why.text.split("\n").slice(2).join("\n");
  $("why").hidden = false;
  app.explained = why;
  app.dirtyTimeline = true;
}
function toggleExplanation() {
  if ($("why").hidden) explain(app.state?.t ?? 0);
  else $("why").hidden = true;
  app.dirtyTimeline = true;
}
const togglePlay = () => control.send({ op: app.state?.playing ? "pause" : "play" });
function changeSpeed(by) {
  const at = SPEEDS.indexOf(app.state?.speed ?? 1);
  const next = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, (at < 0 ? 3 : at) + by))];
  control.send({ op: "speed", value: next });
}

// ---- controls ----------------------------------------------------------------------------------
$("play").addEventListener("click", togglePlay);
$("speed").addEventListener("change", (e) => control.send({ op: "speed", value: Number(e.target.value) }));
$("theme").addEventListener("click", () => { setTheme(!app.dark); localStorage.setItem("rcs-theme", app.dark ? "dark" : "light"); });
$("help-button").addEventListener("click", showHelp);
$("why-close").addEventListener("click", toggleExplanation);
$("other-log").lastElementChild.addEventListener("click", () => { $("other-log").hidden = true; });
function showHelp() {
  const dialog = $("help");
  if (dialog.open) return dialog.close();
  dialog.replaceChildren(el("h2", {}, "keys"),
    el("table", {}, ...KEYS.map(([keys, text]) => el("tr", {},
      el("td", {}, ...keys.split(" ").map((k) => el("kbd", {}, k))), el("td", {}, text)))),
    el("p", { class: "faint" }, "3D: drag to turn, shift and drag (or the right button) to move, wheel to zoom; values appear under the pointer. " +
      "Timeline: click or drag goes to the moment and explains it, wheel zooms, double click shows the whole run."),
    el("p", {}, el("button", { onclick: () => dialog.close() }, "close")));
  dialog.showModal();
}
addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  // A control has its own keys, and an open dialog has all of them.
  if ((/^(INPUT|SELECT|TEXTAREA)$/.test(e.target.tagName) || $("help").open) && e.key !== "?") return;
  if (e.target.tagName === "BUTTON" && (e.key === " " || e.key === "Enter")) return;
  const camera = (dx, dy) => () => app.world?.camera.drag(STEP_PX * dx, STEP_PX * dy, e.shiftKey);
  const now = app.state?.t ?? 0;
  const actions = {
    " ": togglePlay, ArrowLeft: () => seek(now - (e.shiftKey ? 10 : 1)), ArrowRight: () => seek(now + (e.shiftKey ? 10 : 1)),
    ",": () => seek(now - 0.1), ".": () => seek(now + 0.1), Home: () => seek(0), End: () => seek(app.source?.duration_s ?? 0),
    "[": () => changeSpeed(-1), "]": () => changeSpeed(1), "?": showHelp, e: toggleExplanation,
    d: () => $("theme").click(), p: nextPanel, c: () => app.layers?.nextColor(), t: () => app.layers?.nextTerrain(),
    j: camera(1, 0), J: camera(1, 0), k: camera(-1, 0), K: camera(-1, 0), ArrowUp: camera(0, 1), ArrowDown: camera(0, -1),
    z: () => timeline.zoom(0.5), Z: () => timeline.zoom(2), 0: () => timeline.setRange(0, timeline.end), g: () => timeline.nextPlots(),
    l: () => app.layers?.toggle(), x: () => app.layers?.nextMagnify(), "+": () => app.world?.camera.zoom(0.8), "-": () => app.world?.camera.zoom(1.25),
  };
  const action = VIEWS[e.key] ? () => app.world?.camera.set(Number(e.key)) : actions[e.key];
  if (!action) return;
  e.preventDefault();
  action();
});
function nextPanel() {
  const at = PANELS.indexOf(document.body.dataset.panel);
  document.body.dataset.panel = PANELS[(at + 1) % PANELS.length];
  app.dirty3d = app.dirtyTimeline = true;
}
// The keys belong to the page again after a control was used by the mouse.
let byMouse = false;
addEventListener("pointerdown", () => { byMouse = true; }, true);
addEventListener("keydown", () => { byMouse = false; }, true);
for (const kind of ["change", "click"]) {
  document.addEventListener(kind, () => {
    if (byMouse && /^(BUTTON|INPUT|SELECT)$/.test(document.activeElement?.tagName) && (kind === "change" || document.activeElement.tagName === "BUTTON")) {
      document.activeElement.blur();
    }
  });
}
addEventListener("hashchange", () => { if (app.source) openLink(); });
addEventListener("resize", () => { app.dirty3d = app.dirtyTimeline = true; pairs.draw(); });
let pointer = null;
$("gl").addEventListener("pointermove", (e) => { pointer = [e.offsetX, e.offsetY, e.buttons]; app.tipDirty = true; });
$("gl").addEventListener("pointerleave", () => { pointer = null; app.tipDirty = true; });
function showTip() {
  app.tipDirty = false;
  const text = pointer && !pointer[2] ? valueAt(app.world, pointer[0], pointer[1]) : "";
  const tip = $("tip");
  tip.hidden = text === "";
  tip.textContent = text;
  if (pointer) {
    tip.style.left = `${Math.min(pointer[0] + 14, $("gl").clientWidth - tip.offsetWidth - 4)}px`;
    tip.style.top = `${Math.min(pointer[1] + 12, $("gl").clientHeight - tip.offsetHeight - 4)}px`;
  }
}

// ---- frames ----------------------------------------------------------------------------------------
function smoothTime() {
  if (!app.state?.playing || app.source?.live) return;
  // Between the states of the server the time goes on.
  const t = app.state.t + ((performance.now() - app.stateAt) / 1000) * app.state.speed;
  if (t - (app.shownTime ?? 0) > 0.03 || t < app.shownTime) {
    app.shownTime = t;
    setTime(Math.min(t, app.source.duration_s));
  }
}
function frame() {
  requestAnimationFrame(frame);
  const ratio = Math.min(2, devicePixelRatio || 1);
  smoothTime();
  const visible = (id) => $(id).offsetParent !== null;
  if (app.world && app.dirty3d && visible("panel-3d")) {
    app.dirty3d = false;
    app.world.draw(ratio);
    drawOverlay($("overlay"), app.world, ratio);
    showColorBar($("colorbar"), app.world.colorScale());
    notice(app.world.T_world_vehicle || app.world.scan ? "" : waitingText());
    app.frames += 1;
  }
  if (app.world && app.tipDirty) showTip();
  if (app.dirtyTimeline && visible("panel-timeline")) {
    app.dirtyTimeline = false;
    timeline.draw(ratio);
  }
  const still = app.state && !app.state.playing && app.opening === null;
  if (still && visible("panel-pairs") && pairs.time !== app.state.t) pairs.show(app.state.t);
  if (app.statusDirty && app.state && visible("panel-status")) {
    app.statusDirty = false;
    showStatus($("panel-status"), app.state, app.timeline.events, app.dark, seek);
  }
}
function waitingText() {
  if (!app.source) return "connecting";
  return app.source.live ? "no WM_NAV_STATE on the bus yet: do the nodes run? (rcs top)"
    : "no pose at this moment of the log";
}

// ---- for tests and pictures ----------------------------------------------------------------------
const started = performance.now();
window.rcsView = {
  app, world: app.world, timeline, pairs, seek, explain, palette: () => palette(app.dark), data, control,
  /** "ready", "loading", or why there will be no picture. */
  shotState() {
    if (app.failure && document.body.dataset.panel !== "timeline" && document.body.dataset.panel !== "status") return app.failure;
    if (!app.state || !app.timelineLoaded) return "loading";
    if (app.opening !== null) return "loading";
    const panel = document.body.dataset.panel;
    if (panel === "pairs") return pairs.time === app.state.t ? pairs.state : "loading";
    if (panel === "timeline" && !app.explained) { explain(app.state.t); return "loading"; }
    const scanDue = (panel === "all" || panel === "3d") && !app.world.scan && performance.now() - started < 4000;
    app.quiet = (app.quiet ?? 0) + 1;
    return scanDue || app.quiet < 6 ? "loading" : "ready";
  },
  /** Frames per second over the time, drawing without a pause. */
  async benchmark(ms) {
    const [from, begin] = [app.frames, performance.now()];
    const force = setInterval(() => { app.dirty3d = true; }, 1);
    await new Promise((done) => setTimeout(done, ms));
    clearInterval(force);
    return (1000 * (app.frames - from)) / (performance.now() - begin);
  },
};

setTheme(initialTheme());
requestAnimationFrame(frame);
