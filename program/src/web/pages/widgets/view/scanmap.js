// In: a scan. Out: its height map with selectable layers, in the map widget.

import { bytes, get } from "../../base/api.js";
import { all, fill, h, num } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { map } from "./map.js";

const LAYERS = {
  height: ["Height", "mm", 2],
  intensity: ["Intensity", "grey", 0],
  sigma: ["σ", "mm", 4],
  both: ["Both", "mm", 2],
};
/** Least brightness of a cell, so that a dark height still differs from a missing one. */
const DARKEST = 0.25;

/** Shows a scan's map in `place`; `label` names it for assistive technology. */
export async function scanMap(place, id, label = t("Height map")) {
  let head = await get(`/scans/${id}/map`),
    layers = {};
  const picture = h("div", {}),
    tools = h("div", { class: "tools", role: "group", "aria-label": t("Layer") });
  const read = async (name) =>
    (layers[name] ??= new Float32Array(await bytes(`/scans/${id}/map/${name}`)));
  await read("height");
  fill(place, tools, picture);
  const view = map(picture, label);
  let current = "height";
  const reads = (p) => {
    const i = view.index(p),
      say = (name, digits, unit) => (layers[name] ? num(layers[name][i], digits, unit) : "");
    return (
      `x ${num(p[0], 2)}  y ${num(p[1], 2)}  z ${say("height", 3, "mm")}  ` +
      `${layers.sigma ? `σ ${say("sigma", 4, "mm")}` : ""}  ` +
      (layers.intensity ? `${say("intensity", 0)} grey` : "")
    );
  };
  const showLayer = async (name) => {
    const both = name === "both";
    for (const needed of both ? ["height", "intensity"] : [name]) await read(needed);
    current = name;
    for (const b of all(tools, "[data-layer]"))
      b.setAttribute("aria-pressed", String(b.dataset.layer === name));
    const [, unit, digits] = LAYERS[name],
      range = {
        height: head.z_mm,
        both: head.z_mm,
        intensity: head.intensity,
        sigma: head.sigma_mm,
      }[name];
    // Height as colour, the reflected light as brightness: a print or an edge appears in the
    // colour of its height.
    const grey = layers.intensity,
      full = head.intensity[1] || 1,
      lit = both
        ? (i) => Math.max(DARKEST, Math.min(1, Math.sqrt(grey[i] / full) || 0))
        : undefined;
    view.show(head, layers[both ? "height" : name], {
      lit,
      range: name === "height" || both ? range : [0, range[1]],
      unit,
      digits,
      colours: name === "intensity" ? "grey" : "ordered",
      shaded: name === "height",
      reads,
    });
  };
  fill(
    tools,
    Object.entries(LAYERS).map(([name, [words]]) =>
      h("button", { "data-layer": name, onclick: () => showLayer(name) }, t(words)),
    ),
    h("button", { onclick: () => view.zoom(1.5), "aria-label": t("Enlarge") }, "+"),
    h("button", { onclick: () => view.zoom(1 / 1.5), "aria-label": t("Reduce") }, "−"),
    h("button", { onclick: () => view.fit() }, t("All")),
  );
  await showLayer("height");
  // The other values that the cursor shows are loaded after the first view.
  read("sigma")
    .then(() => read("intensity"))
    .catch(() => {});
  /** Loads the scan again, because its filters have changed. */
  const again = async () => {
    head = await get(`/scans/${id}/map`);
    layers = {};
    await read("height");
    await showLayer(current);
  };
  return {
    ...view,
    head,
    tools,
    again,
    get current() {
      return current;
    },
  };
}
