// In: an armed robot with a board below it. Out: an automatic calibration: the next pose, the
// pictures so far, the decrease of the expected error.

import { get, picture, url } from "../../base/api.js";
import { fill, h, num, svg } from "../../base/dom.js";
import { jobs, on, store } from "../../base/store.js";
import { t } from "../../base/text.js";
import { arming, ask, inTheCell } from "../ask.js";
import { livePicture } from "../view/live.js";
import { choice, follow, order, panel } from "../parts.js";
import { attempt } from "../problem.js";

/**
 * Shows an automatic calibration in `place`; `done(job)` receives the finished job. Returns a
 * function that ends it.
 */
export function byTheRobot(place, done) {
  const problem = h("div"),
    progress = h("div"),
    armed = h("div", { class: "stack" }),
    asked = h("div", { class: "stack ask" }),
    cell = h("div"),
    start = h("div", { class: "row" }),
    live = h("div"),
    curve = h("div"),
    seen = h("div", { class: "thumbs" });
  let board = null,
    follows = () => {};
  const target = h("input", {
    type: "number",
    id: "target",
    value: "0.05",
    min: "0.001",
    step: "0.005",
  });
  const watch = (id) => {
    follows();
    follows = follow(progress, id, done);
  };
  const run = () =>
    attempt(
      async () =>
        watch((await order({ procedure: "auto", board, target_mm: Number(target.value) })).id),
      problem,
    );
  get("/boards")
    .then((names) => {
      board = names[0];
      const button = h("button", { class: "main", id: "auto", onclick: run }, t("Start"));
      fill(
        start,
        names.length
          ? choice(
              t("Board"),
              names.map((n) => [n, n]),
              board,
              (v) => (board = v),
            )
          : h(
              "p",
              { class: "note small" },
              t("Put the board's description into the station's folder boards."),
            ),
        h(
          "label",
          { for: "target" },
          h("span", { class: "small quiet" }, t("Expected error, mm")),
          target,
        ),
        button,
      );
      enable();
    })
    .catch((e) =>
      attempt(() => {
        throw e;
      }, problem),
    );
  const enable = () => {
    /** @type {HTMLButtonElement | null} */
    const b = start.querySelector("#auto");
    if (b) b.disabled = !board || !store.motion?.armed || !!store.bar?.running;
  };
  let stops = -1;
  const draw = () => {
    enable();
    const m = store.motion,
      id = m?.job;
    if (!m || !/-auto$/.test(id ?? "") || stops === m.expected.length) return;
    stops = m.expected.length;
    fill(curve, falling(m.expected, Number(target.value)));
    views(seen, id);
  };
  const simulated = store.motion?.simulated;
  fill(
    place,
    panel(t("Motion"), asked),
    problem,
    progress,
    h(
      "div",
      { class: "even" },
      panel(t("Robot"), armed),
      panel(t("Calibrate"), simulated && cell, start),
    ),
    panel(t("Expected error of a scanned point, stop by stop"), curve),
    panel(t("Pictures, with the corners that were found"), seen),
    store.bar?.camera && panel(t("Camera"), live),
  );
  const ends = [
    arming(armed),
    ask(asked),
    on("motion", draw),
    on("bar", enable),
    () => follows(),
    livePicture(live),
  ];
  if (simulated) ends.push(inTheCell(cell, true));
  const last = jobs((j) => j.order.procedure === "auto")[0];
  if (last) watch(last.id);
  draw();
  return () => ends.forEach((end) => end());
}

/** A curve of the expected error after each stop, on a logarithmic scale, with the target. */
function falling(points, target) {
  if (!points.length)
    return h("p", { class: "quiet small" }, t("The first small moves give no estimate yet."));
  const W = 900,
    H = 190,
    values = points.map(([, v]) => v),
    low = Math.log10(Math.min(...values, target)) - 0.1,
    high = Math.log10(Math.max(...values)) + 0.1,
    most = points.at(-1)[0];
  const x = (n) => 54 + (n / most) * (W - 70),
    y = (v) => 8 + (1 - (Math.log10(v) - low) / (high - low)) * (H - 30);
  return h(
    "div",
    {},
    svg(
      "svg",
      {
        class: "plot",
        viewBox: `0 0 ${W} ${H}`,
        role: "img",
        "aria-label": t("Expected error of a scanned point, stop by stop"),
      },
      svg("line", { class: "fit", x1: 54, x2: W - 16, y1: y(target), y2: y(target) }),
      svg("text", { x: 58, y: y(target) - 4 }, `${num(target, 3)} mm`),
      svg("polyline", {
        class: "curve",
        points: points.map(([n, v]) => `${x(n).toFixed(1)},${y(v).toFixed(1)}`).join(" "),
      }),
      points.map(([n, v]) => svg("circle", { cx: x(n), cy: y(v), r: 3, fill: "var(--accent)" })),
      svg("text", { x: W - 16, y: H - 6, "text-anchor": "end" }, `${most} ${t("stops")}`),
    ),
    h(
      "p",
      { class: "small" },
      h("b", { "data-expected": String(values.at(-1)) }, num(values.at(-1), 4, "mm")),
      ` ${t("after")} ${most} ${t("stops")}`,
    ),
  );
}

/** Shows the six newest pictures of a job with their corners. */
async function views(place, id) {
  const list = await get(`/jobs/${id}/views`).catch(() => []);
  fill(
    place,
    list.slice(-6).map((v) =>
      h(
        "div",
        { class: "thumb" },
        svg(
          "svg",
          { viewBox: `0 0 ${v.width} ${v.height}`, role: "img", "aria-label": v.name },
          svg("image", {
            href: url(`/jobs/${id}/files/${v.file}`),
            width: v.width,
            height: v.height,
          }),
          v.corners.map(([u, w]) =>
            svg("circle", { cx: u + 0.5, cy: w + 0.5, r: v.width / 160, class: "corner" }),
          ),
        ),
        h("span", {}, `${v.name} · ${v.corners.length}`),
      ),
    ),
  );
}
