/*
 * In: points B (three 16-bit numbers each, in steps of STEP mm), heights LOW and HIGH that bound the
 * colour scale (mm), and its 32 colours MAP. Out: a picture of the points that the mouse rotates.
 * Nearer points cover those behind.
 */
(() => {
  const bytes = Uint8Array.from(atob(B), (c) => c.charCodeAt(0));
  const points = new Int16Array(bytes.buffer);
  const count = points.length / 3;
  const canvas = document.getElementById("view");
  const context = canvas.getContext("2d");
  let yaw = -0.35,
    pitch = 0.85,
    zoom = 1,
    reach = 1;
  for (let i = 0; i < count; i++)
    reach = Math.max(reach, Math.hypot(points[3 * i], points[3 * i + 1]));

  const draw = () => {
    const { width, height } = canvas;
    const image = context.createImageData(width, height);
    const data = image.data;
    const depth = new Float32Array(width * height).fill(-1e9);
    const scale = (0.98 * width * zoom) / (2 * reach);
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    for (let i = 0; i < width * height; i++) data.set([18, 20, 24, 255], 4 * i);
    const size = scale > 0.08 ? 3 : 2;
    for (let i = 0; i < count; i++) {
      const x = points[3 * i],
        y = points[3 * i + 1],
        z = points[3 * i + 2];
      const across = cy * x - sy * y,
        along = sy * x + cy * y;
      const u = Math.round(width / 2 + scale * across);
      const v = Math.round(height / 2 - scale * (along * cp + z * sp));
      const near = z * cp - along * sp;
      const share = Math.max(0, Math.min(1, (z * STEP - LOW) / (HIGH - LOW)));
      const colour = MAP[Math.round(31 * share)];
      for (let a = 0; a < size; a++) {
        for (let b = 0; b < size; b++) {
          const U = u + a,
            V = v + b;
          if (U < 0 || V < 0 || U >= width || V >= height) continue;
          const at = V * width + U;
          if (near <= depth[at]) continue;
          depth[at] = near;
          data[4 * at] = colour[0];
          data[4 * at + 1] = colour[1];
          data[4 * at + 2] = colour[2];
        }
      }
    }
    context.putImageData(image, 0, 0);
  };

  let last = null;
  canvas.onpointerdown = (e) => {
    last = [e.clientX, e.clientY];
    canvas.setPointerCapture(e.pointerId);
  };
  canvas.onpointerup = () => (last = null);
  canvas.onpointermove = (e) => {
    if (!last) return;
    yaw += (e.clientX - last[0]) * 0.006;
    pitch = Math.max(0, Math.min(1.57, pitch + (e.clientY - last[1]) * 0.006));
    last = [e.clientX, e.clientY];
    draw();
  };
  canvas.onwheel = (e) => {
    e.preventDefault();
    zoom = Math.max(0.3, Math.min(20, zoom * Math.exp(-e.deltaY * 0.001)));
    draw();
  };
  draw();
})();
