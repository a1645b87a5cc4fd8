// Picture: the camera's newest picture, or one of a recording, with its peaks by `fate`, at pixel
// resolution; grey levels and saturated fraction; the stripe along its length; controls for
// region and exposure.

import { bytes, get, picture } from "../base/api.js";
import { fill, h, num, svg } from "../base/dom.js";
import { busy, store } from "../base/store.js";
import { t } from "../base/text.js";
import { exposure } from "../widgets/rig/exposure.js";
import { map } from "../widgets/view/map.js";
import { choice, figures, panel, recordings } from "../widgets/parts.js";
import { attempt } from "../widgets/problem.js";
import { region } from "../widgets/rig/region.js";
import { stripe } from "../widgets/rig/stripe.js";

/** Results of the peak checks by number (src/stages/peak/found.rs): word and colour. */
const FATES = [
  ["kept", "#3ddc84"],
  ["outside the working volume", "#5aa9ff"],
  ["faint", "#b0b0b0"],
  ["narrow", "#ff5ac8"],
  ["wide", "#ffb02e"],
  ["uncertain", "#c78bff"],
  ["steep", "#ff8a5a"],
  ["echo", "#ff5252"],
  ["without neighbour", "#ffe14d"],
  ["no point", "#7fd6d6"],
];

/** Drawing time of a picture above which the page pauses before the next picture, ms. */
const FLUENT = 15;
/** Whether this browser runs on the station itself. */
const HERE = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
/**
 * Shortest time between two pictures while a job runs, ms. A browser without a GPU uses about 20 ms
 * of one core for each picture, which a scan on all cores lacks (tests/web/rates.py). A browser on
 * the station waits 500 ms for each connected viewer, at most 2 s. For any other browser the station
 * only measures the picture.
 */
const beside = () => (HERE ? Math.min(2000, 500 * (store.bar?.viewers ?? 1)) : 250);

export async function show(place) {
  const list = await recordings();
  const camera = store.bar?.camera;
  if (!list.length && !camera)
    return void fill(
      place,
      h("h1", {}, t("Picture")),
      h("p", { class: "quiet" }, t("There is no recording.")),
    );
  let r = camera
      ? null
      : (list.find((x) => x.name === sessionStorage.getItem("recording")) ?? list[0]),
    frame = r ? Math.floor(r.frames / 2) : 0,
    turn = 0;
  const box = h("div"),
    figs = h("div"),
    fates = h("div"),
    hist = h("div"),
    along = h("div"),
    head = h("div", { class: "head" }),
    seen = h("div"),
    problem = h("div"),
    progress = h("div"),
    handles = h("div", { class: "stack" });
  const view = map(box, t("Picture"));
  const area = await region(box, view, problem);
  const light = camera ? await exposure(handles, progress, problem) : null;
  const slider = h("input", {
    type: "range",
    min: "0",
    "aria-label": t("Frame"),
    class: "grow",
    oninput: () => {
      frame = Number(slider.value);
      load();
    },
  });
  const choices = [...(camera ? [["", t("Camera")]] : []), ...list.map((x) => [x.name, x.name])];
  const choose = (v) => {
    r = list.find((x) => x.name === v) ?? null;
    frame = r ? Math.floor(r.frames / 2) : 0;
    view.marks([]);
    fill(fates);
    heads();
    r ? load() : live();
  };
  const heads = () => {
    slider.max = String((r?.frames ?? 1) - 1);
    slider.value = String(frame);
    slider.hidden = !r;
    fill(
      head,
      h("h1", {}, t("Picture")),
      choice(t("Recording"), choices, r?.name ?? "", choose),
      slider,
      h(
        "span",
        { class: "tools" },
        h("button", { onclick: () => view.zoom(2), "aria-label": t("Enlarge") }, "+"),
        h("button", { onclick: () => view.zoom(0.5), "aria-label": t("Reduce") }, "−"),
        h("button", { onclick: () => view.fit() }, t("All")),
        ...area.tools,
      ),
      camera &&
        h(
          "button",
          { class: "main", id: "set-exposure", disabled: Boolean(r), onclick: () => light.tune() },
          t("Set exposure"),
        ),
    );
  };
  async function load() {
    const mine = ++turn,
      image = new Image();
    image.src = picture(r.name, frame);
    await image.decode();
    if (mine !== turn) return;
    const { width, height } = image,
      c = new OffscreenCanvas(width, height),
      g = c.getContext("2d", { willReadFrequently: true });
    g.drawImage(image, 0, 0);
    const px = g.getImageData(0, 0, width, height).data,
      grey = new Uint8Array(width * height);
    for (let i = 0; i < grey.length; i++) grey[i] = px[4 * i];
    show_(grey, width, height);
    const ask = new URLSearchParams({ recording: r.name, frame: String(frame) });
    await attempt(async () => {
      const look = await get(`/look?${ask}`);
      if (mine === turn) stripe(seen, look);
    }, problem);
  }
  /** Shows the newest picture repeatedly; a slow browser shows fewer pictures. */
  async function live() {
    const mine = ++turn;
    let number = 0;
    while (mine === turn) {
      const b = await bytes(`/camera/newest?after=${number}`).catch(() => null);
      if (mine !== turn) return;
      if (!b || b.byteLength < 20) {
        await new Promise((go) => setTimeout(go, b ? 0 : 1000));
        continue;
      }
      const begun = performance.now(),
        [n, width, height, many] = new Uint32Array(b, 0, 4),
        delay = new Float32Array(b, 16, 1)[0],
        words = new DataView(b, 20, 12 * many),
        peaks = {};
      number = n;
      for (let i = 0; i < many; i++)
        (peaks[words.getUint32(12 * i + 8, true)] ??= []).push([
          words.getFloat32(12 * i, true) + 0.5,
          height - 0.5 - words.getFloat32(12 * i + 4, true),
        ]);
      const before = counted;
      show_(new Uint8Array(b, 20 + 12 * many), width, height);
      view.marks(
        Object.entries(peaks).map(([fate, points]) => ({
          kind: "dots",
          points,
          colour: FATES[fate][1],
        })),
      );
      box.dataset.number = String(n);
      if (counted !== before)
        fill(
          fates,
          h("p", { class: "small quiet" }, `${t("picture")} ${n} · ${num(delay, 1, "ms")}`),
          figures(
            ...Object.entries(peaks).map(([fate, points]) => [
              String(points.length),
              t(FATES[fate][0]),
              fate === "0" ? "good-ink" : "",
            ]),
          ),
        );
      await new Promise(requestAnimationFrame);
      // Drawing must not take the processor time that a scan needs: on a slow machine fewer
      // pictures are shown, each the newest.
      const took = performance.now() - begun;
      const rest = busy()
        ? Math.max(beside(), Math.min(1000, 10 * took))
        : took > FLUENT
          ? Math.min(1000, took)
          : 0;
      if (rest) await new Promise((go) => setTimeout(go, rest));
    }
  }
  /**
   * The server computes the figures of the stripe from the newest picture; people need them only
   * every 1.5 s.
   */
  const looks = setInterval(async () => {
    if (r || !camera || document.hidden || store.bar?.running) return;
    const look = await get("/camera/look").catch(() => null);
    if (look && !r) stripe(seen, look);
  }, 1500);
  let counted = 0;
  function show_(grey, width, height) {
    const reads = (p) => {
      const [u, v] = [Math.floor(p[0]), height - 1 - Math.floor(p[1])];
      return `u ${u}  v ${v}  ${u >= 0 && v >= 0 && u < width && v < height ? grey[v * width + u] : "–"}`;
    };
    view.picture(width, height, grey, reads);
    // People read the figures: for a live picture an update twice a second is enough, and less
    // often while a job needs the machine.
    if (!r && performance.now() - counted < (busy() ? 2000 : 500)) return;
    counted = performance.now();
    const counts = new Uint32Array(64),
      peaks = new Uint8Array(width);
    let saturated = 0;
    for (let i = 0, x = 0; i < grey.length; i++) {
      const v = grey[i];
      counts[v >> 2]++;
      if (v === 255) saturated++;
      if (v > peaks[x]) peaks[x] = v;
      if (++x === width) x = 0;
    }
    const brightest = Math.max(...peaks),
      dark = peaks.filter((v) => v < 16).length / width;
    const share = saturated / (width * height);
    fill(
      figs,
      figures(
        [`${width}×${height}`, t("pixels")],
        [
          String(brightest),
          t("brightest of 255"),
          brightest > 217 || brightest < 120 ? "poor-ink" : "",
        ],
        [num(100 * share, 3, "%"), t("saturated"), share > 0.005 ? "bad-ink" : ""],
        [num(100 * dark, 1, "%"), t("columns without light")],
      ),
    );
    const most = Math.log1p(Math.max(...counts));
    fill(
      hist,
      svg(
        "svg",
        {
          class: "plot",
          viewBox: "0 0 64 100",
          preserveAspectRatio: "none",
          role: "img",
          "aria-label": t("Histogram"),
        },
        Array.from(counts, (n, i) =>
          svg("rect", {
            class: "bar",
            x: i,
            y: 100 - (95 * Math.log1p(n)) / most,
            width: 0.9,
            height: (95 * Math.log1p(n)) / most,
          }),
        ),
      ),
    );
    fill(
      along,
      svg(
        "svg",
        {
          class: "plot",
          viewBox: `0 0 ${width} 255`,
          preserveAspectRatio: "none",
          role: "img",
          "aria-label": t("Brightest level in each column"),
        },
        svg("polyline", {
          class: "curve",
          "vector-effect": "non-scaling-stroke",
          points: Array.from(peaks, (v, x) => `${x},${255 - v}`).join(" "),
        }),
      ),
    );
  }
  place.classList.add("fit");
  fill(
    place,
    head,
    problem,
    progress,
    h(
      "div",
      { class: "split" },
      h("section", { class: "panel fill" }, box),
      h(
        "div",
        { class: "stack" },
        panel(t("Levels"), figs),
        fates,
        panel(t("Along the stripe"), seen),
        camera && panel(t("Camera"), handles),
        panel(t("Histogram (logarithmic)"), hist),
        panel(t("Brightest level in each column"), along),
      ),
    ),
  );
  heads();
  r ? await load() : live();
  return () => {
    turn++;
    clearInterval(looks);
    light?.end();
    area.end();
    view.end();
  };
}
