// In: numbers along a line. Out: a curve with a band of its standard deviations; pieces of it are
// selected by dragging, or by arrows and Enter.

import { fill, h, num, svg } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { nice } from "./map.js";

const W = 900,
  H = 190,
  LEFT = 54,
  RIGHT = 10,
  TOP = 10,
  BOTTOM = 26;

/**
 * A plot of a section; `show` takes `points` of { s, z, sigma }, mm. `chosen(pieces)` receives the
 * selected pieces, to which lines are then fitted.
 */
export function section(place, chosen) {
  const plot = svg("svg", {
    class: "plot",
    viewBox: `0 0 ${W} ${H}`,
    preserveAspectRatio: "none",
    role: "img",
    tabindex: "0",
    "aria-label": t("Section"),
    "aria-roledescription": t("section: arrows move the mark, Enter begins and ends a piece"),
  });
  fill(place, plot);
  let data = null,
    pieces = [],
    begun = null,
    mark = null,
    from = null;
  const x = (s) => LEFT + (s / data.length_mm) * (W - LEFT - RIGHT);
  const back = (e) => {
    const r = plot.getBoundingClientRect();
    const px = ((e.clientX - r.left) / r.width) * W;
    return Math.max(
      0,
      Math.min(data.length_mm, ((px - LEFT) / (W - LEFT - RIGHT)) * data.length_mm),
    );
  };
  plot.addEventListener("pointerdown", (e) => {
    if (data) {
      begun = back(e);
      plot.setPointerCapture(e.pointerId);
    }
  });
  const choose = (a, b) => {
    const piece = [Math.min(a, b), Math.max(a, b)];
    if (piece[1] - piece[0] < data.length_mm / 200) return;
    pieces = [...pieces.slice(-1), piece].sort((p, q) => p[0] - q[0]);
    chosen(pieces);
  };
  plot.addEventListener("pointerup", (e) => {
    if (begun === null) return;
    choose(begun, back(e));
    begun = null;
  });
  const cursor = svg("line", { class: "cursor", y1: TOP, y2: H - BOTTOM });
  plot.addEventListener("keydown", (e) => {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    if (!data || (!way && !["Enter", " ", "Escape"].includes(e.key))) return;
    e.preventDefault();
    mark ??= data.length_mm / 2;
    if (way)
      mark = Math.max(
        0,
        Math.min(data.length_mm, mark + (way * data.length_mm) / (e.shiftKey ? 10 : 100)),
      );
    else if (e.key === "Escape") from = null;
    else if (from === null) from = mark;
    else {
      choose(from, mark);
      from = null;
    }
    cursor.setAttribute("x1", String(x(mark)));
    cursor.setAttribute("x2", String(x(mark)));
    plot.append(cursor);
  });
  return {
    show(answer, keep = false) {
      data = answer;
      if (!keep) {
        pieces = [];
        mark = from = null;
      }
      const known = data.points.filter((p) => p.z !== null);
      if (!known.length)
        return void fill(
          plot,
          svg("text", { x: 20, y: 40 }, t("Nothing was measured along this line.")),
        );
      let low = Math.min(...known.map((p) => p.z)),
        high = Math.max(...known.map((p) => p.z));
      const spare = Math.max(0.06 * (high - low), 0.02);
      low -= spare;
      high += spare;
      const y = (z) => TOP + (1 - (z - low) / (high - low)) * (H - TOP - BOTTOM);
      const parts = [];
      for (const f of data.fits)
        parts.push(
          svg("rect", {
            class: "piece",
            x: x(f.piece[0]),
            y: TOP,
            width: x(f.piece[1]) - x(f.piece[0]),
            height: H - TOP - BOTTOM,
          }),
        );
      for (const v of ticks(low, high, 5))
        parts.push(
          svg("line", { class: "axis", x1: LEFT, x2: W - RIGHT, y1: y(v), y2: y(v) }),
          svg("text", { x: LEFT - 6, y: y(v) + 4, "text-anchor": "end" }, num(v, 2)),
        );
      for (const v of ticks(0, data.length_mm, 10))
        parts.push(
          svg(
            "text",
            { x: x(v), y: H - 8, "text-anchor": "middle" },
            num(v, v < 1 && v > 0 ? 2 : 1),
          ),
        );
      parts.push(
        svg("text", { x: W - RIGHT, y: H - 8, "text-anchor": "end" }, "mm"),
        svg("text", { x: LEFT + 4, y: TOP + 10 }, "mm"),
      );
      for (const run of runs(data.points)) {
        const up = run.map((p) => `${x(p.s).toFixed(1)},${y(p.z + 2 * p.sigma).toFixed(1)}`),
          low2 = run
            .map((p) => `${x(p.s).toFixed(1)},${y(p.z - 2 * p.sigma).toFixed(1)}`)
            .reverse();
        parts.push(svg("polygon", { class: "band", points: [...up, ...low2].join(" ") }));
        parts.push(
          svg("polyline", {
            class: "curve",
            points: run.map((p) => `${x(p.s).toFixed(1)},${y(p.z).toFixed(1)}`).join(" "),
          }),
        );
      }
      for (const f of data.fits) {
        const half = (f.piece[1] - f.piece[0]) / 2,
          rise = Math.tan((f.angle_deg * Math.PI) / 180) * half;
        parts.push(
          svg("line", {
            class: "fit",
            x1: x(f.piece[0]),
            x2: x(f.piece[1]),
            y1: y(f.height_mm - rise),
            y2: y(f.height_mm + rise),
          }),
        );
      }
      fill(plot, parts);
    },
  };
}

function runs(points) {
  const out = [[]];
  for (const p of points) p.z === null ? out.at(-1).length && out.push([]) : out.at(-1).push(p);
  return out.filter((r) => r.length > 1);
}

function ticks(low, high, most) {
  let step = nice((high - low) / most) || 1;
  while ((high - low) / step > most) step *= 2;
  const out = [];
  for (let v = Math.ceil(low / step) * step; v <= high + 1e-9; v += step) out.push(v);
  return out;
}

/** A chart of horizontal bars; `list` holds pairs [name, value]. */
export function bars(list, unit, digits = 2) {
  const most = Math.max(...list.map(([, v]) => v), 1e-9);
  return h(
    "div",
    {},
    list.map(([name, v]) =>
      h(
        "div",
        { class: "axisbar named" },
        h("span", { title: name }, name),
        svg(
          "svg",
          { viewBox: "0 0 100 10", preserveAspectRatio: "none", "aria-hidden": "true" },
          svg("rect", { x: 0, y: 0, width: (100 * v) / most, height: 10, class: "bar" }),
        ),
        h("span", {}, num(v, digits, unit)),
      ),
    ),
  );
}
