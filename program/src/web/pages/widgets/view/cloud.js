// In: a scan. Out: its points in three dimensions: rotate by dragging, move with the right button
// or two fingers, zoom with the wheel; a click shows the point's coordinates and sigma. The
// points are ordered so that the first part of them covers the whole scan coarsely. During a
// rotation as many are drawn as the machine can draw fluently, and that number is shown.

import { bytes, get } from "../../base/api.js";
import { fill, h, num, thousands } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { span } from "./colour.js";

const FIRST = 150000,
  MOST = 2000000;
/** Target time to draw a frame, ms: the rest of the 33 ms at 30 frames a second is for the page. */
const FRAME = 22;

const VERTEX = `#version 300 es
in vec3 place; in float sigma; in float light;
uniform mat4 view; uniform vec3 up; uniform vec2 range; uniform float size; uniform int by;
out vec3 colour;
vec3 ordered(float x) {
  x = clamp(x, 0.0, 1.0);
  return clamp(vec3(0.2777 + x*(0.1051 + x*(-0.3309 + x*(-4.634 + x*(6.228 + x*(4.776 - 5.435*x))))),
    0.0054 + x*(1.4046 + x*(0.2148 + x*(-5.799 + x*(14.18 + x*(-13.75 + 4.646*x))))),
    0.3341 + x*(1.3846 + x*(0.0951 + x*(-19.33 + x*(56.69 + x*(-65.35 + 26.31*x)))))), 0.0, 1.0);
}
void main() {
  gl_Position = view * vec4(place, 1.0);
  gl_PointSize = size;
  float v = by == 0 ? dot(place, up) : by == 1 ? sigma : light;
  float x = (v - range.x) / (range.y - range.x);
  colour = by == 2 ? vec3(0.1 + 0.9 * clamp(x, 0.0, 1.0)) : ordered(x);
}`;
const FRAGMENT = `#version 300 es
precision mediump float; in vec3 colour; out vec4 ink; void main() { ink = vec4(colour, 1.0); }`;
const LINE = `#version 300 es
in vec3 place; uniform mat4 view; void main() { gl_Position = view * vec4(place, 1.0); }`;
const INK = `#version 300 es
precision mediump float; uniform vec4 ink; out vec4 seen; void main() { seen = ink; }`;

/** Shows a scan's points in `place`; `lines` are outlines drawn over them, in its frame, mm. */
export async function cloud(place, id, lines = []) {
  const canvas = h("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label": t("Points in three dimensions; arrows turn, + and − enlarge"),
  });
  const read = h("div", { class: "read" }),
    box = h("div", { class: "map" }, canvas, read),
    tools = h("div", { class: "tools" });
  fill(place, tools, box);
  const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
  if (!gl) {
    fill(
      place,
      h("p", { class: "note" }, t("This browser has no WebGL2: the map shows the same points.")),
    );
    return { end() {} };
  }
  let data = await load(id, FIRST);
  const g = (await get(`/scans/${id}/map`)).base_from_grid,
    up = [g[2], g[6], g[10]];
  const c = {
    yaw: 0.6,
    pitch: 0.9,
    far: 0,
    at: [0, 0, 0],
    by: 0,
    picked: null,
    budget: data.n,
    moving: false,
  };
  const program = link(gl, VERTEX, FRAGMENT),
    buffer = gl.createBuffer(),
    over = outlines(gl, lines, data.origin);
  const where = Object.fromEntries(
    ["view", "up", "range", "size", "by"].map((n) => [n, gl.getUniformLocation(program, n)]),
  );
  gl.useProgram(program);
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0.043, 0.051, 0.067, 1);
  const ranges = () =>
    [0, 1, 2].map((by) => {
      const v = new Float32Array(data.n);
      for (let i = 0; i < data.n; i++)
        v[i] = by
          ? data.f[5 * i + 2 + by]
          : up[0] * data.f[5 * i] + up[1] * data.f[5 * i + 1] + up[2] * data.f[5 * i + 2];
      const r = span(v);
      return by ? [0, r[1]] : r;
    });
  let range = ranges();
  const size = (() => {
    const x = new Float32Array(data.n).map((_, i) => data.f[5 * i]),
      y = new Float32Array(data.n).map((_, i) => data.f[5 * i + 1]);
    const a = span(x),
      b = span(y);
    return Math.max(a[1] - a[0], b[1] - b[0], 1);
  })();
  c.far = 1.35 * size;
  const upload = () => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data.f, gl.STATIC_DRAW);
    points();
  };
  const points = () => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    /** @type {[string, number, number][]} */
    const fields = [
      ["place", 3, 0],
      ["sigma", 1, 12],
      ["light", 1, 16],
    ];
    fields.forEach(([name, n, offset]) => {
      const a = gl.getAttribLocation(program, name);
      if (a < 0) return;
      gl.enableVertexAttribArray(a);
      gl.vertexAttribPointer(a, n, gl.FLOAT, false, 20, offset);
    });
  };
  upload();

  const matrix = () => {
    const w = canvas.width / canvas.height,
      f = 1 / Math.tan(0.35),
      near = c.far * 0.02,
      farther = c.far * 6;
    const sy = Math.sin(c.yaw),
      cy = Math.cos(c.yaw),
      sp = Math.sin(c.pitch),
      cp = Math.cos(c.pitch);
    // The eye looks at `at` from above: the rows are right, up and back.
    const r = [cy, -sy, 0, sy * sp, cy * sp, cp, sy * cp * -1, -cy * cp, sp];
    const back = [sy * cp * -1, -cy * cp, sp];
    const eye = [0, 1, 2].map((k) => c.at[k] + back[k] * c.far);
    const v = [
      r[0],
      r[3],
      back[0],
      0,
      r[1],
      r[4],
      back[1],
      0,
      r[2],
      r[5],
      back[2],
      0,
      ...[0, 1, 2].map((row) => {
        const axis = row === 2 ? back : [r[3 * row], r[3 * row + 1], r[3 * row + 2]];
        return -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
      }),
      1,
    ];
    const p = [
      f / w,
      0,
      0,
      0,
      0,
      f,
      0,
      0,
      0,
      0,
      (farther + near) / (near - farther),
      -1,
      0,
      0,
      (2 * farther * near) / (near - farther),
      0,
    ];
    return product(p, v);
  };
  let asked = false,
    still = 0,
    from = null,
    far = 0;
  const redraw = (moving) => {
    c.moving = moving;
    clearTimeout(still);
    // All points are drawn when the view rests. While a finger is down the rotation may continue
    // at any moment.
    if (moving && !from) still = setTimeout(() => redraw(false), 180);
    if (!asked) {
      asked = true;
      requestAnimationFrame(draw);
    }
  };
  const draw = () => {
    asked = false;
    const begun = performance.now(),
      n = c.moving ? Math.min(c.budget, data.n) : data.n;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program);
    gl.uniformMatrix4fv(where.view, false, matrix());
    gl.uniform3fv(where.up, up);
    gl.uniform2fv(where.range, range[c.by]);
    gl.uniform1i(where.by, c.by);
    gl.uniform1f(
      where.size,
      Math.max(1.5, Math.min(5, (canvas.height / Math.sqrt(n)) * 1.6 * ((1.35 * size) / c.far))),
    );
    gl.drawArrays(gl.POINTS, 0, n);
    if (over) {
      over.draw(matrix());
      points();
    }
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    const took = performance.now() - begun;
    if (c.moving)
      c.budget = Math.max(
        5000,
        Math.min(data.n, Math.round(c.budget * Math.max(0.5, Math.min(1.5, FRAME / took)))),
      );
    else c.budget = Math.max(5000, Math.min(data.n, Math.round(n * Math.min(1, FRAME / took))));
    box.dataset.shown = String(n);
    box.dataset.outlines = String(lines.length);
    box.dataset.drawn = String(Number(box.dataset.drawn ?? 0) + 1);
    const p = c.picked;
    read.textContent =
      `${thousands(n)} ${t("of")} ${thousands(data.all)} ${t("points")}` +
      (p === null
        ? ""
        : `\nx ${num(data.origin[0] + data.f[5 * p], 3)}  ` +
          `y ${num(data.origin[1] + data.f[5 * p + 1], 3)}  ` +
          `z ${num(data.origin[2] + data.f[5 * p + 2], 3)} mm  ` +
          `σ ${num(data.f[5 * p + 3], 4)} mm`);
  };
  /**
   * The loaded point at a position on the screen: of the points within 9 CSS px, roughly the one that
   * is nearest to the viewer.
   */
  const pick = (px, py) => {
    const m = matrix(),
      reach = 9 * (devicePixelRatio || 1);
    let best = null,
      depth = Infinity;
    for (let i = 0; i < data.n; i++) {
      const [x, y, z] = [data.f[5 * i], data.f[5 * i + 1], data.f[5 * i + 2]],
        w = m[3] * x + m[7] * y + m[11] * z + m[15];
      if (w <= 0) continue;
      const sx = ((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) * 0.5 * canvas.width,
        sy = (1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * 0.5 * canvas.height;
      if (
        Math.abs(sx - px) < reach &&
        Math.abs(sy - py) < reach &&
        w + (0.02 * Math.hypot(sx - px, sy - py) * size) / 100 < depth
      ) {
        depth = w + (0.02 * Math.hypot(sx - px, sy - py) * size) / 100;
        best = i;
      }
    }
    return best;
  };
  const turn = (dx, dy) => {
    c.yaw += dx * 0.008;
    c.pitch = Math.max(0.05, Math.min(1.57, c.pitch + dy * 0.008));
    redraw(true);
  };
  const move = (dx, dy) => {
    const k = (c.far / canvas.clientHeight) * 0.7,
      sy = Math.sin(c.yaw),
      cy = Math.cos(c.yaw);
    c.at[0] += -dx * cy * k + dy * sy * k;
    c.at[1] += dx * sy * k + dy * cy * k;
    redraw(true);
  };
  canvas.oncontextmenu = (e) => e.preventDefault();
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    from = [e.clientX, e.clientY];
    far = 0;
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!from) return;
    const [dx, dy] = [e.clientX - from[0], e.clientY - from[1]];
    far += Math.hypot(dx, dy);
    from = [e.clientX, e.clientY];
    e.buttons === 2 || e.shiftKey ? move(dx, dy) : turn(dx, dy);
  });
  canvas.addEventListener("pointerup", (e) => {
    const turned = far >= 4;
    if (from && !turned) {
      const r = canvas.getBoundingClientRect(),
        k = devicePixelRatio || 1;
      c.picked = pick((e.clientX - r.left) * k, (e.clientY - r.top) * k);
      redraw(false);
    }
    from = null;
    if (turned) redraw(true);
  });
  canvas.addEventListener("pointercancel", () => {
    from = null;
    redraw(true);
  });
  const zoom = (by) => {
    c.far = Math.max(size * 0.02, Math.min(size * 6, c.far * by));
    redraw(true);
  };
  canvas.addEventListener(
    "wheel",
    (e) => {
      e.preventDefault();
      zoom(Math.exp(e.deltaY * 0.001));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (e) => {
    const way = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] }[
      e.key
    ];
    if (way) turn(...way);
    else if (e.key === "+") zoom(0.8);
    else if (e.key === "-") zoom(1.25);
    else if (e.key === "Enter") {
      c.picked = pick(canvas.width / 2, canvas.height / 2);
      redraw(false);
    } else return;
    e.preventDefault();
  });
  const colour = (by) => {
    c.by = by;
    tools
      .querySelectorAll("button")
      .forEach((b, i) => b.setAttribute("aria-pressed", String(i === by)));
    redraw(false);
  };
  fill(
    tools,
    [t("Height"), "σ", t("Intensity")].map((words, i) =>
      h("button", { "aria-pressed": String(i === 0), onclick: () => colour(i) }, words),
    ),
  );
  const resize = new ResizeObserver(() => {
    const k = devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(box.clientWidth * k));
    canvas.height = Math.max(1, Math.round(box.clientHeight * k));
    redraw(false);
  });
  resize.observe(box);
  let ended = false;
  if (data.all > data.n)
    load(id, MOST)
      .then((more) => {
        if (!ended) {
          data = more;
          c.picked = null;
          range = ranges();
          upload();
          redraw(false);
        }
      })
      .catch(() => {});
  return {
    end() {
      ended = true;
      resize.disconnect();
      gl.getExtension("WEBGL_lose_context")?.loseContext();
    },
  };
}

async function load(id, most) {
  const b = await bytes(`/scans/${id}/points?most=${most}`),
    head = new DataView(b);
  const [all, n] = [head.getUint32(0, true), head.getUint32(4, true)];
  return {
    all,
    n,
    origin: [8, 16, 24].map((k) => head.getFloat64(k, true)),
    f: new Float32Array(b, 32, 5 * n),
  };
}

/**
 * Lines over the points. Where points hide a line it is drawn faintly, because the outline of a
 * found part lies in the measured surface.
 */
function outlines(gl, lines, origin) {
  const ends = lines.flatMap((line) =>
    line.slice(1).flatMap((p, i) => [...line[i], ...p].map((v, k) => v - origin[k % 3])),
  );
  if (!ends.length) return null;
  const program = link(gl, LINE, INK),
    buffer = gl.createBuffer(),
    place = gl.getAttribLocation(program, "place");
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(ends), gl.STATIC_DRAW);
  return {
    draw(view) {
      gl.useProgram(program);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 12, 0);
      gl.uniformMatrix4fv(gl.getUniformLocation(program, "view"), false, view);
      for (const hides of [false, true]) {
        hides ? gl.enable(gl.DEPTH_TEST) : gl.disable(gl.DEPTH_TEST);
        gl.uniform4fv(
          gl.getUniformLocation(program, "ink"),
          hides ? [0, 0.9, 1, 1] : [0, 0.42, 0.47, 1],
        );
        gl.drawArrays(gl.LINES, 0, ends.length / 3);
      }
      gl.enable(gl.DEPTH_TEST);
    },
  };
}

function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ]) {
    const s = gl.createShader(kind);
    gl.shaderSource(s, text);
    gl.compileShader(s);
    if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
    gl.attachShader(program, s);
  }
  gl.linkProgram(program);
  return program;
}

function product(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++)
    for (let r = 0; r < 4; r++)
      for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
