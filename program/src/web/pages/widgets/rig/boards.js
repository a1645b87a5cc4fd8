// In: pictures of a calibration board with their corners. Out: which areas of the picture the
// boards covered, their tilts, and where to hold the board next, also drawn into a picture.

import { fill, h, svg } from "../../base/dom.js";
import { t } from "../../base/text.js";

/** Cells into which the picture is divided, as in the camera's calibration. */
const COLUMNS = 8,
  ROWS = 6;
/** Cells that the board should fill. */
const WIDE = 4,
  HIGH = 3;
/**
 * Tilt that the board should have, degrees. A smaller tilt determines the focal length poorly, a
 * larger one blurs the corners.
 */
const LEAN = 30;
/** @type {[string, number, number][]} */
const WAYS = [
  ["flat", 0, 0],
  ["right", 1, 0],
  ["left", -1, 0],
  ["down", 0, 1],
  ["up", 0, -1],
];
const WORDS = {
  flat: "square to the camera",
  right: "its front turned to the right",
  left: "its front turned to the left",
  down: "its front turned down",
  up: "its front turned up",
};

/** What a set of views lacks most: a box, in fractions of the picture, and a tilt direction. */
export function next(views) {
  const count = new Array(COLUMNS * ROWS).fill(0);
  for (const v of views)
    for (const [x, y] of v.corners) {
      const c = Math.max(0, Math.min(COLUMNS - 1, Math.floor(((x + 0.5) / v.width) * COLUMNS))),
        r = Math.max(0, Math.min(ROWS - 1, Math.floor(((y + 0.5) / v.height) * ROWS)));
      count[r * COLUMNS + c]++;
    }
  let best = null;
  for (let r = 0; r + HIGH <= ROWS; r++)
    for (let c = 0; c + WIDE <= COLUMNS; c++) {
      let empty = 0,
        few = 0;
      for (let y = r; y < r + HIGH; y++)
        for (let x = c; x < c + WIDE; x++) {
          if (count[y * COLUMNS + x] === 0) empty++;
          few += count[y * COLUMNS + x];
        }
      if (!best || empty > best.empty || (empty === best.empty && few < best.few))
        best = { empty, few, box: [c / COLUMNS, r / ROWS, WIDE / COLUMNS, HIGH / ROWS] };
    }
  const leans = views.map((v) => v.lean_deg).filter(Boolean);
  // The tilt direction whose nearest picture is farthest away.
  const far = ([, x, y]) =>
    Math.min(90, ...leans.map(([a, b]) => Math.hypot(a - x * LEAN, b - y * LEAN)));
  const way = WAYS.reduce((a, b) => (far(b) > far(a) + 1e-6 ? b : a));
  return {
    count,
    covered: count.filter(Boolean).length / count.length,
    box: best.box,
    way: way[0],
    leans,
  };
}

/** The largest of some tilts, as text. */
const steepest = (leans) =>
  leans.length ? `${Math.round(Math.max(...leans.map(([a, b]) => Math.hypot(a, b))))}°` : "–";

/** Gauges of coverage and tilt, and advice for the next picture; `add(view)` updates them. */
export function gauges(place) {
  let views = [];
  const draw = () => {
    const n = next(views),
      most = Math.max(...n.count, 1),
      all = `${Math.round(100 * n.covered)} %`;
    const cells = n.count.map((k, i) =>
      svg("rect", {
        x: i % COLUMNS,
        y: Math.floor(i / COLUMNS),
        width: 0.96,
        height: 0.96,
        class: "bar",
        opacity: k ? 0.25 + 0.75 * Math.sqrt(k / most) : 0.06,
      }),
    );
    const [x, y, w, high] = n.box;
    const box = svg("rect", {
      x: x * COLUMNS,
      y: y * ROWS,
      width: w * COLUMNS,
      height: high * ROWS,
      class: "next",
      "vector-effect": "non-scaling-stroke",
    });
    const dots = n.leans.map(([a, b]) => svg("circle", { cx: a, cy: b, r: 2.4, class: "bar" }));
    const rings = [15, 30, 45].map((r) =>
      svg("circle", { r, class: "ring", "vector-effect": "non-scaling-stroke" }),
    );
    const [, ax, ay] = WAYS.find(([k]) => k === n.way);
    fill(
      place,
      h(
        "div",
        {
          class: "row gauges",
          "data-covered": String(n.covered.toFixed(4)),
          "data-views": String(views.length),
          "data-way": n.way,
        },
        h(
          "figure",
          {},
          svg(
            "svg",
            {
              viewBox: `0 0 ${COLUMNS} ${ROWS}`,
              role: "img",
              "aria-label": t("Places of the picture that boards covered"),
            },
            cells,
            box,
          ),
          h("figcaption", { class: "small quiet" }, `${t("Covered")} ${all}`),
        ),
        h(
          "figure",
          {},
          svg(
            "svg",
            {
              viewBox: "-50 -50 100 100",
              role: "img",
              "aria-label": t("How the boards leaned, 15, 30, 45 degrees"),
            },
            rings,
            dots,
            svg("circle", {
              cx: ax * LEAN,
              cy: ay * LEAN,
              r: 5,
              class: "next",
              "vector-effect": "non-scaling-stroke",
            }),
          ),
          h("figcaption", { class: "small quiet" }, `${t("Leaned")} ${steepest(n.leans)}`),
        ),
      ),
      h(
        "p",
        { class: "small" },
        h("b", {}, `${t("Hold the board next")}: `),
        `${t("in the dashed box")}, ${t(WORDS[n.way])}`,
      ),
    );
  };
  draw();
  return {
    add(view) {
      if (view.corners.length) views.push(view);
      draw();
    },
    clear() {
      views = [];
      draw();
    },
    /** Draws the box for the next board into a picture of the camera. */
    mark(g, width, height) {
      const [x, y, w, high] = next(views).box;
      g.setLineDash([12, 8]);
      for (const dark of [true, false]) {
        g.strokeStyle = dark ? "#000a" : "#ffd33d";
        g.lineWidth = ((dark ? 5 : 2.5) * width) / 640;
        g.strokeRect(x * width, y * height, w * width, high * height);
      }
      g.setLineDash([]);
    },
  };
}
