// Picture: a recording's pictures to the pixel; levels and how much of them is saturated; the light along the stripe.

import { picture } from "../base/api.js";
import { fill, h, num, svg } from "../base/dom.js";
import { t } from "../base/text.js";
import { map } from "../widgets/map.js";
import { choice, figures, panel, recordings } from "../widgets/parts.js";

export async function show(place) {
  const list = await recordings(() => true);
  if (!list.length) return void fill(place, h("h1", {}, t("Picture")), h("p", { class: "quiet" }, t("There is no recording.")));
  let r = list.find((x) => x.name === sessionStorage.getItem("recording")) ?? list[0], frame = Math.floor(r.frames / 2), turn = 0;
  const box = h("div"), figs = h("div"), hist = h("div"), along = h("div"), head = h("div", { class: "head" });
  const view = map(box, t("Picture"));
  const slider = h("input", { type: "range", min: "0", "aria-label": t("Frame"), class: "grow", oninput: () => { frame = Number(slider.value); load(); } });
  const heads = () => { slider.max = String(r.frames - 1); slider.value = String(frame); fill(head, h("h1", {}, t("Picture")), choice(t("Recording"), list.map((x) => [x.name, x.name]), r.name, (v) => { r = list.find((x) => x.name === v); frame = Math.floor(r.frames / 2); heads(); load(); }), slider); };
  async function load() {
    const mine = ++turn, image = new Image();
    image.src = picture(r.name, frame);
    await image.decode();
    if (mine !== turn) return;
    const { width, height } = image, c = new OffscreenCanvas(width, height), g = c.getContext("2d", { willReadFrequently: true });
    g.drawImage(image, 0, 0);
    const px = g.getImageData(0, 0, width, height).data, levels = new Float32Array(width * height), counts = new Array(64).fill(0);
    let saturated = 0, brightest = 0, dark = 0;
    const peaks = new Array(width).fill(0);
    for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
      const v = px[4 * (y * width + x)];
      levels[(height - 1 - y) * width + x] = v;
      counts[v >> 2]++;
      saturated += v === 255;
      brightest = Math.max(brightest, v);
      peaks[x] = Math.max(peaks[x], v);
    }
    dark = peaks.filter((v) => v < 16).length / width;
    view.show({ width, height, cell_mm: 1, bare: true }, levels, { range: [0, 255], unit: "", digits: 0, colours: "grey", reads: (p) => `u ${Math.floor(p[0])}  v ${height - 1 - Math.floor(p[1])}  ${num(levels[view.index(p)], 0)}` });
    const share = saturated / (width * height);
    fill(figs, figures([`${width}×${height}`, t("pixels")], [String(brightest), t("brightest of 255"), brightest > 217 || brightest < 120 ? "poor-ink" : ""], [num(100 * share, 3, "%"), t("saturated"), share > 0.005 ? "bad-ink" : ""], [num(100 * dark, 1, "%"), t("columns without light")]));
    const most = Math.log1p(Math.max(...counts));
    fill(hist, svg("svg", { class: "plot", viewBox: "0 0 64 100", preserveAspectRatio: "none", role: "img", "aria-label": t("Histogram") }, counts.map((n, i) => svg("rect", { class: "bar", x: i, y: 100 - (95 * Math.log1p(n)) / most, width: 0.9, height: (95 * Math.log1p(n)) / most }))));
    fill(along, svg("svg", { class: "plot", viewBox: `0 0 ${width} 255`, preserveAspectRatio: "none", role: "img", "aria-label": t("Brightest level in each column") }, svg("polyline", { class: "curve", "vector-effect": "non-scaling-stroke", points: peaks.map((v, x) => `${x},${255 - v}`).join(" ") })));
  }
  place.classList.add("fit");
  fill(place, head, h("div", { class: "split" }, h("section", { class: "panel fill" }, box), h("div", { class: "stack" }, panel(t("Levels"), figs), panel(t("Histogram (logarithmic)"), hist), panel(t("Brightest level in each column"), along))));
  heads();
  await load();
  return () => view.end();
}
