// In: a scan. Out: its height map with layers to choose, in the map widget.

import { bytes, get } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { t } from "../base/text.js";
import { map } from "./map.js";

const LAYERS = { height: ["Height", "mm", 2], intensity: ["Intensity", "grey", 0], sigma: ["σ", "mm", 4] };

/** Shows a scan's map in `place`; `extra` are further tools beside the layers. */
export async function scanMap(place, id, label = t("Height map")) {
  const head = await get(`/scans/${id}/map`);
  const layers = {}, picture = h("div", {}), tools = h("div", { class: "tools", role: "group", "aria-label": t("Layer") });
  const read = async (name) => (layers[name] ??= new Float32Array(await bytes(`/scans/${id}/map/${name}`)));
  await read("height");
  fill(place, tools, picture);
  const view = map(picture, label);
  let current = "height";
  const reads = (p) => {
    const i = view.index(p), say = (name, digits, unit) => (layers[name] ? num(layers[name][i], digits, unit) : "");
    return `x ${num(p[0], 2)}  y ${num(p[1], 2)}  z ${say("height", 3, "mm")}  ${layers.sigma ? `σ ${say("sigma", 4, "mm")}` : ""}  ${layers.intensity ? `${say("intensity", 0)} grey` : ""}`;
  };
  const showLayer = async (name) => {
    await read(name);
    current = name;
    for (const b of tools.querySelectorAll("[data-layer]")) b.setAttribute("aria-pressed", String(b.dataset.layer === name));
    const [, unit, digits] = LAYERS[name], range = { height: head.z_mm, intensity: head.intensity, sigma: head.sigma_mm }[name];
    view.show(head, layers[name], { range: name === "height" ? range : [0, range[1]], unit, digits, colours: name === "intensity" ? "grey" : "ordered", shaded: name === "height", reads });
  };
  fill(tools, Object.entries(LAYERS).map(([name, [words]]) => h("button", { "data-layer": name, onclick: () => showLayer(name) }, t(words))),
    h("button", { onclick: () => view.zoom(1.5), "aria-label": t("Enlarge") }, "+"), h("button", { onclick: () => view.zoom(1 / 1.5), "aria-label": t("Reduce") }, "−"), h("button", { onclick: () => view.fit() }, t("All")));
  await showLayer("height");
  // What the cursor reads beside heights comes after the first look.
  read("sigma").then(() => read("intensity")).catch(() => {});
  return { ...view, head, layers, tools, get current() { return current; } };
}
