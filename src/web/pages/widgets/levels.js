// In: grey levels of a picture, how it lies in a view. Out: the view's pixels. Those that are seen alone: a live picture costs the
// machine half of what drawing all of its pixels and reducing them takes. Pixels of the picture and of the view, both from the top.

import { SCALES } from "./colour.js";

/** Levels as pixels, in the colours of the scale beside the picture. */
const GREYS = Uint32Array.from({ length: 256 }, (_, v) => 0xff000000 | (SCALES.grey[3 * v] * 0x010101));
/** Beside the picture. */
const GROUND = 0xff110d0b;

/** Draws `grey`, `width` by `height`, into the image: a pixel is `s` of the view's wide, its corner at (left, top). Enlarged, each pixel
 * is a square; reduced, a place is the mean of two by two pixels of those it covers. */
export function levels(image, grey, width, height, s, left, top) {
  const out = new Uint32Array(image.data.buffer), apart = s < 1 ? 0.25 / s : 0;
  // Two pixels that each place of a row or column shows; -1: it lies outside.
  const shown = (places, from, pixels) => {
    const a = new Int32Array(places).fill(-1), b = new Int32Array(places);
    for (let i = 0; i < places; i++) {
      const p = (i + 0.5 - from) / s;
      if (p < 0 || p >= pixels) continue;
      a[i] = Math.max(0, Math.floor(p - apart));
      b[i] = Math.min(pixels - 1, Math.floor(p + apart));
    }
    return [a, b];
  };
  const [ua, ub] = shown(image.width, left, width), [va, vb] = shown(image.height, top, height);
  for (let j = 0, at = 0; j < image.height; j++) {
    if (va[j] < 0) {
      out.fill(GROUND, at, (at += image.width));
      continue;
    }
    const above = va[j] * width, below = vb[j] * width;
    for (let i = 0; i < image.width; i++, at++) {
      const a = ua[i], b = ub[i];
      out[at] = a < 0 ? GROUND : GREYS[(grey[above + a] + grey[above + b] + grey[below + a] + grey[below + b] + 2) >> 2];
    }
  }
}
