// In: the camera. Out: its newest picture, small, again and again; one that is slow gets fewer.

import { bytes } from "../base/api.js";
import { fill, h } from "../base/dom.js";
import { t } from "../base/text.js";

/** Shows it in `place` until what is given back is called. */
export function livePicture(place) {
  const canvas = h("canvas", { class: "live", width: 320, height: 240, role: "img", "aria-label": t("The camera's newest picture") });
  fill(place, canvas);
  // Drawn by the processor, as in map.js.
  const g = canvas.getContext("2d", { willReadFrequently: true });
  let over = false, number = 0, image = null;
  (async () => {
    while (!over) {
      const b = await bytes(`/camera/newest?after=${number}`).catch(() => null);
      if (over) return;
      if (!b || b.byteLength < 20) { await new Promise((go) => setTimeout(go, b ? 0 : 1000)); continue; }
      const [n, width, height, many] = new Uint32Array(b, 0, 4), grey = new Uint8Array(b, 20 + 12 * many);
      number = n;
      const begun = performance.now();
      if (image?.width !== width || image.height !== height) {
        image = new ImageData(width, height);
        [canvas.width, canvas.height] = [width, height];
      }
      const out = new Uint32Array(image.data.buffer);
      for (let i = 0; i < out.length; i++) out[i] = 0xff000000 | (grey[i] * 0x010101);
      g.putImageData(image, 0, 0);
      canvas.dataset.number = String(n);
      // A glance: what else the page does, a held button above all, comes first.
      await new Promise(requestAnimationFrame);
      await new Promise((go) => setTimeout(go, Math.max(150, Math.min(2000, 3 * (performance.now() - begun)))));
    }
  })();
  return () => (over = true);
}
