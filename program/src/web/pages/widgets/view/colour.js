// In: a number from 0 to 1. Out: a colour of a scale: ordered (dark to light, distinguishable
// without red and green), diverging, grey.

const ORDERED = [
  [68, 1, 84],
  [71, 44, 122],
  [59, 81, 139],
  [44, 113, 142],
  [33, 144, 141],
  [39, 173, 129],
  [92, 200, 99],
  [170, 220, 50],
  [253, 231, 37],
];
const DIVERGING = [
  [33, 80, 190],
  [92, 140, 230],
  [170, 195, 240],
  [235, 235, 235],
  [244, 190, 160],
  [225, 120, 85],
  [178, 30, 40],
];

function table(stops) {
  const out = new Uint8Array(256 * 3);
  for (let i = 0; i < 256; i++) {
    const x = (i / 255) * (stops.length - 1),
      k = Math.min(Math.floor(x), stops.length - 2),
      f = x - k;
    for (let c = 0; c < 3; c++) out[3 * i + c] = stops[k][c] + f * (stops[k + 1][c] - stops[k][c]);
  }
  return out;
}

export const SCALES = {
  ordered: table(ORDERED),
  diverging: table(DIVERGING),
  grey: table([
    [18, 18, 18],
    [245, 245, 245],
  ]),
};

/**
 * Colours a grid of numbers; NaN gets the background colour. With `lit`, the brightness of each cell
 * is `lit(index)`. Otherwise, with `cell` (mm), heights are shaded by light from the upper left.
 */
export function paint(values, width, height, [low, high], scale, cell, lit) {
  const image = new ImageData(width, height),
    px = image.data,
    table = SCALES[scale];
  const by = 255 / (high - low || 1);
  for (let y = 0; y < height; y++) {
    // Row 0 of the grid is the lowest.
    let to = 4 * width * (height - 1 - y);
    for (let x = 0; x < width; x++, to += 4) {
      const i = y * width + x,
        v = values[i];
      px[to + 3] = 255;
      if (v !== v) {
        px[to] = 24;
        px[to + 1] = 27;
        px[to + 2] = 33;
        continue;
      }
      const k = 3 * Math.max(0, Math.min(255, ((v - low) * by) | 0));
      const light = lit ? lit(i) : cell ? shade(values, i, x, y, width, height, cell) : 1;
      px[to] = table[k] * light;
      px[to + 1] = table[k + 1] * light;
      px[to + 2] = table[k + 2] * light;
    }
  }
  return image;
}

function shade(values, i, x, y, width, height, cell) {
  const a = values[x + 1 < width ? i + 1 : i],
    b = values[x > 0 ? i - 1 : i];
  const c = values[y + 1 < height ? i + width : i],
    d = values[y > 0 ? i - width : i];
  const gx = (a - b) / (2 * cell),
    gy = (c - d) / (2 * cell);
  if (gx !== gx || gy !== gy) return 1;
  return Math.max(0.55, Math.min(1.25, 1 + (0.45 * (gx - gy)) / Math.sqrt(gx * gx + gy * gy + 1)));
}

/** The quantiles `share` and 1 - `share` of the values that are not NaN; large fields are sampled. */
export function span(values, share = 0.005) {
  const step = Math.max(1, Math.floor(values.length / 50000)),
    some = [];
  for (let i = 0; i < values.length; i += step) if (values[i] === values[i]) some.push(values[i]);
  if (!some.length) return [0, 1];
  some.sort((a, b) => a - b);
  const at = (q) => some[Math.round((some.length - 1) * q)];
  const [low, high] = [at(share), at(1 - share)];
  return high > low ? [low, high] : [low, low + 1e-3];
}
