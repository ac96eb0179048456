// What the 3D view shows, with the color and the form of each thing: the legend is the control.

import { palette } from "./colors.js";
import { CLASSES } from "./shapes.js";
import { el } from "./status.js";

const COLOR_BY = ["height", "age", "ring", "range"];
const COLOR_TEXT = { height: "height", age: "age", ring: "row", range: "range" };

const MAGNIFY = [1, 10, 100];

function svgKey(content, width = 18) {
  const span = el("span", { class: "key" });
  span.innerHTML = `<svg width="${width}" height="10" viewBox="0 0 ${width} 10">${content}</svg>`; // constant text
  span.style.width = `${width}px`;
  return span;
}
const small = (content) => svgKey(content, 10);
const line = (color, dash = "") => svgKey(`<path d="M0 5H18" stroke="${color}" stroke-width="3" stroke-dasharray="${dash}"/>`);
const css = (c) => `rgb(${c.slice(0, 3).map((v) => Math.round(255 * v)).join(",")})`;

export function layerControls(element, view, onChange) {
  const select = (values, texts, current, set) => {
    const s = el("select", {}, ...values.map((v, i) => el("option", { value: v }, texts[i])));
    s.value = current;
    s.addEventListener("change", () => { set(s.value); changed(); });
    return s;
  };
  function changed() {
    view.scanDirty = true;
    refresh();
    onChange();
  }
  let folded = element.clientHeight > 0 && element.parentElement.clientHeight < 420;
  function toggle() { folded = !folded; refresh(); }
  function refresh() {
    const colors = palette(view.dark);
    const box = (name, text, key) => {
      const input = el("input", { type: "checkbox" });
      input.checked = view.show[name];
      input.addEventListener("change", () => { view.show[name] = input.checked; onChange(); });
      return el("label", {}, input, key, text);
    };
    const sigma = view.magnify === 1 ? "3 σ of the position" : `3 σ of the position, × ${view.magnify}`;
    const fold = el("button", { title: "Show or hide the layers (l)", onclick: toggle }, folded ? "layers ▸" : "▾");
    if (folded) return element.replaceChildren(fold);
    const accepted = small(`<circle cx="5" cy="5" r="3.6" fill="none" stroke="${colors.accepted}" stroke-width="1.6"/>`);
    const legend = (...entries) => el("div", { class: "sub" },
      ...entries.flatMap(([key, text]) => [el("span", {}, key, ` ${text}`)]));
    element.replaceChildren(fold,
      el("label", {}, "points ", select(["sp", "ladar"], ["of SP, deskewed", "as measured"], view.cloud, (v) => { view.cloud = v; view.place(v); }),
        " by ", select(COLOR_BY, COLOR_BY.map((c) => COLOR_TEXT[c]), view.colorBy, (v) => { view.colorBy = v; })),
      box("scan", "newest scan", svgKey('<circle cx="4" cy="5" r="2" fill="#26828e"/><circle cx="10" cy="3" r="2" fill="#6ece58"/><circle cx="14" cy="7" r="2" fill="#482878"/>')),
      box("recent", "scans of the last 6 s", svgKey(`<circle cx="4" cy="5" r="1.4" fill="${colors.faint}"/><circle cx="10" cy="3" r="1.4" fill="${colors.faint}"/><circle cx="14" cy="7" r="1.4" fill="${colors.faint}"/>`)),
      box("terrain", "terrain", svgKey(CLASSES.map((k, i) => `<rect x="${6 * i}" width="6" height="10" fill="${css(k.color)}"/>`).join(""))),
      ...(view.terrainBy === "class" && view.show.terrain
        ? [legend(...CLASSES.map((k) => [small(`<rect width="10" height="10" fill="${css(k.color)}"/>`), k.name]))] : []),
      box("path", "path of BG", line(colors.path)),
      box("routes", "routes of the mission", line(colors.route)),
      ...(view.show.routes ? [legend([line(colors.route), "chosen"], [line(colors.route, "5 3"), "rejected"])] : []),
      box("sigma", sigma, svgKey(`<ellipse cx="9" cy="5" rx="8" ry="4" fill="${colors.sigma}" fill-opacity=".6"/>`)),
      box("level", "protection level", svgKey(`<ellipse cx="9" cy="5" rx="8" ry="4" fill="none" stroke="${colors.level}" stroke-width="2"/>`)),
      box("track", "track", line(colors.track)),
      legend([line(colors.track), "with GPS"], [line(colors.outage, "4 3"), "without"]),
      box("truth", "true track", line(css(colors.truth), "3 2")),
      box("fixes", "fixes of GPS", accepted),
      legend([accepted.cloneNode(true), "accepted"], [small(`<path d="M1 1l8 8M9 1l-8 8" stroke="${colors.rejected}" stroke-width="2"/>`), "rejected"],
        [small(`<rect x="2" y="2" width="6" height="6" fill="none" stroke="${colors.untested}" stroke-width="1.6"/>`), "not used"]),
      box("grid", "grid", line(css(colors.grid))));
  }
  refresh();
  const next = (list, value) => list[(list.indexOf(value) + 1) % list.length];
  return {
    refresh, toggle,
    nextColor() { view.colorBy = next(COLOR_BY, view.colorBy); changed(); },
    nextTerrain() {
      if (!view.show.terrain) { view.show.terrain = true; view.terrainBy = "class"; }
      else if (view.terrainBy === "class") view.terrainBy = "height";
      else view.show.terrain = false;
      changed();
    },
    nextMagnify() { view.magnify = next(MAGNIFY, view.magnify); changed(); },
  };
}

