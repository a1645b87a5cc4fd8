// In: measures of a picture. Out: its stripe along its length: peak, width, contrast, and where
// it is dark.

import { fill, h, num, svg } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { figures } from "../parts.js";

const W = 320,
  H = 44;

export function stripe(place, look) {
  const s = look.stripe;
  place.dataset.stripe = s ? "seen" : "none";
  if (!s)
    return void fill(place, h("p", { class: "quiet" }, t("No stripe is seen in this picture.")));
  const percent = (v) => num(100 * v, 1, "%");
  fill(
    place,
    figures(
      [
        percent(s.peak),
        `${t("peaks; wanted")} ${num(100 * s.wanted[0], 0)}–${num(100 * s.wanted[1], 0)} %`,
        s.right ? "good-ink" : "poor-ink",
      ],
      [percent(s.saturated), t("of them saturated"), s.saturated > 0.005 ? "bad-ink" : ""],
      [num(s.width_px, 1, "px"), t("stripe width")],
      [num(s.contrast, 0), t("contrast")],
      [percent(s.dark), t("dark share"), s.dark > 0.3 ? "poor-ink" : ""],
    ),
    [
      [0, t("Peak"), 1, (v) => percent(v)],
      [1, t("Width"), null, (v) => num(v, 1, "px")],
      [2, t("Contrast"), null, (v) => num(v, 0)],
    ].map((row) => curve(s.pieces, ...row)),
  );
}

/** A curve of one figure along the stripe; a piece is shaded in proportion to its dark part. */
function curve(pieces, k, name, most, says) {
  const values = pieces.map((p) => p[k]),
    high = most ?? Math.max(1, ...values) * 1.1,
    step = W / pieces.length;
  const known = pieces.map((p, i) => [i, p]).filter(([, p]) => p[3] < 1);
  const at = ([i, p]) =>
    `${num((i + 0.5) * step, 1)},${num(H - (H - 4) * Math.min(1, p[k] / high), 1)}`;
  const range = known.length
    ? `${says(Math.min(...known.map(([, p]) => p[k])))} … ${says(Math.max(...known.map(([, p]) => p[k])))}`
    : "–";
  return h(
    "div",
    { class: "along" },
    h("div", { class: "small" }, h("span", {}, name), " ", h("span", { class: "quiet" }, range)),
    svg(
      "svg",
      {
        class: "plot low",
        viewBox: `0 0 ${W} ${H}`,
        preserveAspectRatio: "none",
        role: "img",
        "aria-label": `${name}: ${range}`,
      },
      pieces.map(
        (p, i) =>
          p[3] > 0 &&
          svg("rect", {
            class: "dark",
            x: i * step,
            y: 0,
            width: step,
            height: H,
            opacity: num(0.5 * p[3], 2),
          }),
      ),
      svg("polyline", {
        class: "curve",
        "vector-effect": "non-scaling-stroke",
        points: known.map(at).join(" "),
      }),
    ),
  );
}
