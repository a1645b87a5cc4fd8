// In: pictures of a board that an axis carries, with the axis' counts. Out: where the axis
// stopped, and where it should stop next.

import { fill, h, num, svg, thousands } from "../../base/dom.js";
import { t } from "../../base/text.js";

/** Number of stops below which the gauge asks for more. */
const WANTED = 8;

/**
 * A count a little below the middle of the widest gap between neighbouring stops. Evenly spaced
 * stops would hide counts that were assigned to the wrong pictures.
 */
export function widest(counts) {
  const s = [...counts].sort((a, b) => a - b);
  let best = null;
  for (let i = 1; i < s.length; i++)
    if (!best || s[i] - s[i - 1] > best.gap)
      best = { gap: s[i] - s[i - 1], at: s[i - 1] + 0.45 * (s[i] - s[i - 1]) };
  return best;
}

export function axisGauge(place) {
  let counts = [],
    unseen = 0,
    uncounted = 0;
  const draw = () => {
    const low = Math.min(...counts),
      high = Math.max(...counts),
      best = widest(counts),
      x = (c) => 2 + (96 * (c - low)) / (high - low || 1);
    fill(
      place,
      h(
        "div",
        {
          "data-stops": String(counts.length),
          "data-next": best ? String(Math.round(best.at)) : "",
        },
        counts.length > 0 &&
          svg(
            "svg",
            {
              class: "plot low axisbar",
              viewBox: "0 0 100 20",
              preserveAspectRatio: "none",
              role: "img",
              "aria-label": t("Stops along the axis"),
            },
            svg("line", { class: "axis", x1: 0, x2: 100, y1: 10, y2: 10 }),
            counts.map((c) =>
              svg("rect", { class: "bar", x: x(c) - 0.4, y: 3, width: 0.8, height: 14 }),
            ),
            best &&
              svg("rect", { class: "piece", x: x(best.at) - 1.5, y: 1, width: 3, height: 18 }),
          ),
        h(
          "p",
          { class: "small" },
          counts.length
            ? `${counts.length} ${t("stops")}, ` +
                `${thousands(Math.round(low))} … ${thousands(Math.round(high))} ${t("counts")}`
            : t("No stop with board and count yet."),
        ),
        unseen > 0 && h("p", { class: "note small" }, `${unseen} ${t("pictures without a board")}`),
        uncounted > 0 &&
          h("p", { class: "note small" }, `${uncounted} ${t("pictures without a count")}`),
        best &&
          h(
            "p",
            { class: counts.length < WANTED ? "note small" : "small" },
            h("b", {}, `${t("Stop next at")}: `),
            `${thousands(Math.round(best.at))} ${t("counts")} ` +
              `(${t("widest gap")} ${num((100 * best.gap) / (high - low), 0, "%")})`,
          ),
      ),
    );
  };
  draw();
  return {
    add(view) {
      if (!view.corners.length) unseen++;
      else if (view.count === null) uncounted++;
      else counts.push(view.count);
      draw();
    },
    clear() {
      counts = [];
      unseen = uncounted = 0;
      draw();
    },
  };
}
