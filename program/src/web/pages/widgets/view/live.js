// In: the camera, and optionally a job that found a part. Out: the camera's newest picture, small
// and updated repeatedly, with the part's outlines at the robot's pose of that picture. A slow
// machine gets fewer pictures.

import { bytes, get } from "../../base/api.js";
import { fill, h } from "../../base/dom.js";
import { t } from "../../base/text.js";

/**
 * Movement of the outlines between two readings of the robot's pose above which they are dashed, px.
 */
const MOVES = 1.5;
const COLOUR = "#00e6ff";

/**
 * Shows the live picture in `place` until the returned function is called. `of()` returns the job
 * whose part is drawn over it, or null. `mark(g, width, height)` draws further marks over it.
 */
export function livePicture(place, of = () => null, mark = (_g, _width, _height) => {}) {
  const canvas = h("canvas", {
    class: "live",
    width: 320,
    height: 240,
    role: "img",
    "aria-label": t("The camera's newest picture"),
  });
  const near = h("canvas", {
      class: "live",
      width: 480,
      height: 300,
      hidden: true,
      role: "img",
      "aria-label": t("The part, enlarged"),
    }),
    said = h("p", { class: "small quiet" });
  fill(place, canvas, near, said);
  // Drawn by the processor, as in map.js.
  const g = canvas.getContext("2d", { willReadFrequently: true });
  let over = false,
    number = 0,
    image = null,
    shown = null,
    refused = null;
  const draw = (part) => {
    if (image) g.putImageData(image, 0, 0);
    canvas.dataset.number = String(number);
    canvas.dataset.ghost = part ? String(part.lines.length) : "";
    if (part) outlines(g, part, canvas.width);
    mark(g, canvas.width, canvas.height);
    near.hidden = !(part && enlarged(near, canvas, part));
    said.textContent = part
      ? t(
          part.moved_px > MOVES
            ? "The arm moves: the part is drawn where it was a moment ago."
            : "The outlines show where this camera should see the part. If they lie beside it, do not move the arm.",
        )
      : (refused ?? "");
  };
  /** The part's outlines in this picture; null if they are unknown, with the reason in `refused`. */
  const ghost = async (job) => {
    if (!job) return (refused = null);
    try {
      const part = await get(`/jobs/${job}/ghost?number=${number}`);
      refused = null;
      return part;
    } catch (e) {
      refused = e.problem?.what ?? String(e);
      return null;
    }
  };
  (async () => {
    while (!over) {
      const job = of(),
        b = await bytes(`/camera/newest?after=${number}`).catch(() => null);
      if (over) return;
      if (!b || b.byteLength < 20) {
        // There is no newer picture, but the part may have been found since this one.
        if (number && of() !== shown) {
          shown = of();
          draw(await ghost(shown));
        }
        await new Promise((go) => setTimeout(go, b ? 0 : 1000));
        continue;
      }
      const [n, width, height, many] = new Uint32Array(b, 0, 4),
        grey = new Uint8Array(b, 20 + 12 * many);
      number = n;
      shown = job;
      // Picture and outlines appear together, because they belong to the same moment.
      const part = await ghost(job);
      if (over) return;
      const begun = performance.now();
      if (!image || image.width !== width || image.height !== height) {
        image = new ImageData(width, height);
        [canvas.width, canvas.height] = [width, height];
      }
      const out = new Uint32Array(image.data.buffer);
      for (let i = 0; i < out.length; i++) out[i] = 0xff000000 | (grey[i] * 0x010101);
      draw(part);
      // This view has low priority: the rest of the page, above all a held button, comes first.
      await new Promise(requestAnimationFrame);
      await new Promise((go) =>
        setTimeout(go, Math.max(150, Math.min(2000, 3 * (performance.now() - begun)))),
      );
    }
  })();
  return () => (over = true);
}

/**
 * Draws the area around the part, enlarged, into `to`. Returns false if the part is large enough in
 * the picture, or not in it.
 */
function enlarged(to, from, part) {
  const span = (k, most) => {
    const v = part.lines
      .flat()
      .map((p) => p[k])
      .filter((x) => x >= 0 && x < most);
    return v.length ? [Math.min(...v), Math.max(...v)] : null;
  };
  const [x, y] = [span(0, from.width), span(1, from.height)];
  if (!x || !y) return false;
  const wide = Math.max(1.6 * (x[1] - x[0]), (1.6 * (y[1] - y[0]) * to.width) / to.height, 60);
  if (wide > 0.6 * from.width) return false;
  const high = (wide * to.height) / to.width,
    g = to.getContext("2d");
  g.fillRect(0, 0, to.width, to.height);
  g.drawImage(
    from,
    (x[0] + x[1] - wide) / 2,
    (y[0] + y[1] - high) / 2,
    wide,
    high,
    0,
    0,
    to.width,
    to.height,
  );
  return true;
}

/** Draws the outlines. Pixel centres are integers in the server's answer, but at .5 on a canvas. */
function outlines(g, part, width) {
  g.setLineDash(part.moved_px > MOVES ? [8, 8] : []);
  for (const dark of [true, false]) {
    g.strokeStyle = dark ? "#000a" : COLOUR;
    g.lineWidth = ((dark ? 4 : 1.6) * Math.max(width, 320)) / 640;
    g.beginPath();
    for (const line of part.lines)
      line.forEach(([u, v], i) => (i ? g.lineTo(u + 0.5, v + 0.5) : g.moveTo(u + 0.5, v + 0.5)));
    g.stroke();
  }
  g.setLineDash([]);
}
