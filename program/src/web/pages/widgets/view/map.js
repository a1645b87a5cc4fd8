// In: numbers on a grid. Out: a picture of them to move, zoom and select points in, by mouse,
// touch and keyboard: arrows move the cross (Shift: faster), Enter sets a point, + - 0 zoom.
// Coordinates are the grid's, mm, y up.

import { fill, h, num } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { SCALES, paint } from "./colour.js";

/** Grey levels of a picture as RGBA pixels, in the colours of the scale beside the map. */
const GREYS = Uint32Array.from(
  { length: 256 },
  (_, v) => 0xff000000 | (SCALES.grey[3 * v] * 0x010101),
);
/** A drag that is at most this long is a click, CSS px. */
const CLICK = 5;

export function map(place, label) {
  const canvas = h("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label": label,
    "aria-roledescription": t("map: arrows move the cross, Enter puts a point"),
  });
  const read = h("div", { class: "read", "aria-live": "off" }),
    scale = h("div", { class: "scale" }),
    length = h("div", { class: "length" });
  fill(place, canvas, read, scale, length);
  place.classList.add("map");
  // Drawn by the processor: it computes the pixels, and without a GPU this is three times as
  // fast.
  const g = canvas.getContext("2d", { willReadFrequently: true }),
    off = document.createElement("canvas");
  const m = {
    head: null,
    values: null,
    view: null,
    cross: null,
    tool: null,
    marks: [],
    from: null,
    to: null,
    /** @type {(p: any) => string} */
    reads: () => "",
  };
  let asked = false,
    fitted = true;
  const redraw = () => {
    if (!asked) {
      asked = true;
      requestAnimationFrame(() => {
        asked = false;
        draw();
      });
    }
  };
  const ratio = () => devicePixelRatio || 1;

  function fit() {
    const { width, height, cell_mm } = m.head,
      w = canvas.width,
      hgt = canvas.height;
    const s = Math.min(w / (width * cell_mm), hgt / (height * cell_mm)) * 0.97;
    m.view = { s, x: (w - width * cell_mm * s) / 2, y: (hgt + height * cell_mm * s) / 2 };
    fitted = true;
  }
  const toGrid = (px, py) => [(px - m.view.x) / m.view.s, (m.view.y - py) / m.view.s];
  /** @returns {[number, number]} */
  const toView = ([x, y]) => [m.view.x + x * m.view.s, m.view.y - y * m.view.s];

  function draw() {
    if (!m.head || !canvas.width) return;
    if (!m.view) fit();
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.fillStyle = "#0b0d11";
    g.fillRect(0, 0, canvas.width, canvas.height);
    const { width, height, cell_mm } = m.head,
      [x, y] = toView([0, height * cell_mm]);
    g.imageSmoothingEnabled = m.view.s * cell_mm < 1;
    g.drawImage(off, x, y, width * cell_mm * m.view.s, height * cell_mm * m.view.s);
    for (const mark of m.marks) stroke(mark);
    if (m.from && m.to && m.tool)
      stroke({ kind: m.tool.shape, points: [m.from, m.to], colour: "#ffd33d" });
    if (m.cross) cross(m.cross);
    length.hidden = m.head.bare === true;
    const mm = nice((120 * ratio()) / m.view.s);
    length.style.width = `${(mm * m.view.s) / ratio()}px`;
    length.textContent = `${mm} mm`;
    tell();
    m.after?.();
  }

  /** @param {{ kind: string, points: any, colour?: string, label?: string, wide?: number }} mark */
  function stroke({ kind, points, colour = "#fff", label: text, wide = 2 }) {
    if (kind === "dots") {
      g.fillStyle = colour;
      const r = Math.max(1.5 * ratio(), Math.min(3 * ratio(), m.view.s / 3));
      for (const p of points) {
        const [x, y] = toView(p);
        g.fillRect(x - r / 2, y - r / 2, r, r);
      }
      return;
    }
    const line = (list) => {
      g.beginPath();
      list.forEach((p, i) => (i ? g.lineTo(...toView(p)) : g.moveTo(...toView(p))));
    };
    g.lineJoin = "round";
    for (const dark of [true, false]) {
      g.strokeStyle = dark ? "#000a" : colour;
      g.lineWidth = (dark ? wide + 2.5 : wide) * ratio();
      const [a, b] = points;
      if (kind === "box") {
        line([a, [b[0], a[1]], b, [a[0], b[1]], a]);
        g.stroke();
      } else if (kind === "circle") {
        const [cx, cy] = toView(a);
        g.beginPath();
        g.arc(cx, cy, Math.hypot(b[0] - a[0], b[1] - a[1]) * m.view.s, 0, 7);
        g.stroke();
      } else if (kind === "point") {
        const [px, py] = toView(a),
          r = 7 * ratio();
        g.beginPath();
        g.moveTo(px - r, py);
        g.lineTo(px + r, py);
        g.moveTo(px, py - r);
        g.lineTo(px, py + r);
        g.stroke();
      } else {
        line(points);
        g.stroke();
      }
    }
    if (text) {
      const [px, py] = toView(points[points.length - 1]);
      g.font = `600 ${14 * ratio()}px system-ui`;
      g.strokeStyle = "#000c";
      g.lineWidth = 4 * ratio();
      g.strokeText(text, px + 8 * ratio(), py - 8 * ratio());
      g.fillStyle = colour;
      g.fillText(text, px + 8 * ratio(), py - 8 * ratio());
    }
  }
  function cross(at) {
    const [x, y] = toView(at);
    g.strokeStyle = "#fffc";
    g.lineWidth = ratio();
    g.beginPath();
    g.moveTo(x, 0);
    g.lineTo(x, canvas.height);
    g.moveTo(0, y);
    g.lineTo(canvas.width, y);
    g.stroke();
  }
  function tell() {
    if (!m.cross) {
      read.textContent = m.tool?.says ?? "";
      return;
    }
    read.textContent = (m.tool?.says ? `${m.tool.says}\n` : "") + m.reads(m.cross);
  }

  /** Index of the cell that contains a point, mm; -1 outside the grid. */
  function index([x, y]) {
    if (!m.head) return -1;
    const i = Math.floor(x / m.head.cell_mm),
      j = Math.floor(y / m.head.cell_mm);
    return i >= 0 && j >= 0 && i < m.head.width && j < m.head.height ? j * m.head.width + i : -1;
  }

  function zoom(by, px, py) {
    const s = Math.max(0.2, Math.min(4000, m.view.s * by)),
      k = s / m.view.s;
    m.view = { s, x: px - (px - m.view.x) * k, y: py - (py - m.view.y) * k };
    fitted = false;
    redraw();
  }
  const at = (e) => {
    const r = canvas.getBoundingClientRect();
    return [(e.clientX - r.left) * ratio(), (e.clientY - r.top) * ratio()];
  };

  /** Handles a chosen point: the first or the second of the tool's shape. */
  function choose(p) {
    if (!m.tool) return;
    if (m.tool.shape === "point") return void m.tool.done(p);
    if (!m.from) {
      m.from = p;
      m.to = p;
      return redraw();
    }
    const a = m.from;
    m.from = m.to = null;
    m.tool.done(a, p);
    redraw();
  }

  const down = new Map();
  let begun = null,
    pinch = 0;
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    const p = at(e);
    down.set(e.pointerId, p);
    if (down.size === 2) pinch = spread();
    begun = { p, view: { ...m.view }, drag: false, had: Boolean(m.from) };
  });
  const spread = () => {
    const [a, b] = [...down.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  canvas.addEventListener("pointermove", (e) => {
    if (!m.view) return;
    const p = at(e);
    m.cross = toGrid(...p);
    if (down.has(e.pointerId)) {
      down.set(e.pointerId, p);
      if (down.size === 2) {
        const now = spread();
        zoom(now / pinch, p[0], p[1]);
        pinch = now;
        return;
      }
      const far = Math.hypot(p[0] - begun.p[0], p[1] - begun.p[1]) > CLICK * ratio();
      begun.drag ||= far;
      if (begun.drag && m.tool && m.tool.shape !== "point" && !e.shiftKey && e.buttons !== 4) {
        if (!m.from) m.from = toGrid(...begun.p);
        m.to = m.cross;
      } else if (begun.drag) {
        m.view = {
          ...m.view,
          x: begun.view.x + p[0] - begun.p[0],
          y: begun.view.y + p[1] - begun.p[1],
        };
        fitted = false;
      }
    } else if (m.from) m.to = m.cross;
    redraw();
  });
  const up = (e) => {
    if (!down.delete(e.pointerId) || !begun) return;
    const p = toGrid(...at(e));
    if (e.type === "pointerup" && (!begun.drag || (m.from && !begun.had))) choose(p);
    begun = null;
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointerleave", () => {
    if (!down.size) {
      m.cross = null;
      redraw();
    }
  });
  canvas.addEventListener(
    "wheel",
    (e) => {
      e.preventDefault();
      if (m.view) zoom(Math.exp(-e.deltaY * 0.0015), ...at(e));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (e) => {
    if (!m.view) return;
    const step = ((e.shiftKey ? 40 : 4) * ratio()) / m.view.s,
      way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    m.cross ??= toGrid(canvas.width / 2, canvas.height / 2);
    if (way) {
      m.cross = [m.cross[0] + way[0] * step, m.cross[1] + way[1] * step];
      if (m.from) m.to = m.cross;
    } else if (e.key === "Enter" || e.key === " ") choose(m.cross);
    else if (e.key === "+" || e.key === "-")
      zoom(e.key === "+" ? 1.3 : 1 / 1.3, ...toView(m.cross));
    else if (e.key === "0") fit();
    else if (e.key === "Escape") m.from = m.to = null;
    else return;
    e.preventDefault();
    redraw();
  });
  const size = new ResizeObserver(() => {
    canvas.width = Math.round(place.clientWidth * ratio());
    canvas.height = Math.round(place.clientHeight * ratio());
    if (fitted) m.view = null;
    redraw();
  });
  size.observe(place);

  return {
    /**
     * Shows a layer of values. `head` has width, height and cell_mm; `colours` is ordered, grey or
     * diverging.
     */
    show(
      head,
      values,
      /**
       * @type {{ range: number[], unit?: string, digits?: number, colours?: string,
       *   shaded?: boolean, lit?: any, reads?: (p: any) => string }}
       */
      { range, unit = "mm", digits = 2, colours = "ordered", shaded = false, lit, reads },
    ) {
      const same = m.head && m.head.width === head.width && m.head.height === head.height;
      Object.assign(m, {
        head,
        values,
        reads:
          reads ??
          ((p) => {
            const v = m.values[index(p)];
            return v === v && v !== undefined
              ? `x ${num(p[0], 2)}  y ${num(p[1], 2)}  ${num(v, digits + 1)} ${unit}`
              : `x ${num(p[0], 2)}  y ${num(p[1], 2)}  –`;
          }),
      });
      if (!same) m.view = null;
      off.width = head.width;
      off.height = head.height;
      m.pixels = null;
      /** @type {[number, number]} */
      const drawn = [range[0], range[1] > range[0] ? range[1] : range[0] + 1];
      off
        .getContext("2d", { willReadFrequently: true })
        .putImageData(
          paint(values, head.width, head.height, drawn, colours, shaded ? head.cell_mm : 0, lit),
          0,
          0,
        );
      legend(scale, drawn, unit, digits, colours);
      redraw();
    },
    /**
     * Shows a picture of a camera: grey levels row by row from the top, without length scale and
     * shading. `reads(point)` returns the text for a point.
     */
    picture(width, height, grey, reads) {
      const same = m.head && m.head.width === width && m.head.height === height;
      Object.assign(m, { head: { width, height, cell_mm: 1, bare: true }, values: null, reads });
      if (!same || !m.pixels) {
        if (!same) m.view = null;
        off.width = width;
        off.height = height;
        m.pixels = new ImageData(width, height);
        legend(scale, [0, 255], "", 0, "grey");
      }
      const words = new Uint32Array(m.pixels.data.buffer);
      for (let i = 0; i < words.length; i++) words[i] = GREYS[grey[i]];
      off.getContext("2d", { willReadFrequently: true }).putImageData(m.pixels, 0, 0);
      redraw();
    },
    /**
     * Sets the marks over the map: { kind, points, colour, label, wide }; `kind` is line, box,
     * circle, point or dots.
     */
    marks(list) {
      m.marks = list;
      redraw();
    },
    /**
     * Sets what dragging or clicking draws: { shape, says, done(a, b) }. Null: dragging moves the
     * map.
     */
    tool(tool) {
      m.tool = tool;
      m.from = m.to = null;
      redraw();
    },
    fit() {
      if (m.head) {
        fit();
        redraw();
      }
    },
    zoom(by) {
      if (m.view) zoom(by, canvas.width / 2, canvas.height / 2);
    },
    /**
     * Sets a function that is called each time the map has been drawn. It positions the HTML
     * elements that lie over the map.
     */
    after(put) {
      m.after = put;
      redraw();
    },
    index,
    toView: (p) => toView(p).map((v) => v / ratio()),
    toGrid: ([x, y]) => toGrid(x * ratio(), y * ratio()),
    head: () => m.head,
    ready: () => Boolean(m.view),
    canvas,
    end() {
      size.disconnect();
    },
  };
}

function legend(place, [low, high], unit, digits, colours) {
  const strip = h("canvas", { width: 1, height: 128, "aria-hidden": "true" }),
    g = strip.getContext("2d"),
    image = g.createImageData(1, 128),
    table = SCALES[colours];
  for (let y = 0; y < 128; y++) {
    const k = 3 * (255 - 2 * y);
    image.data.set([table[k], table[k + 1], table[k + 2], 255], 4 * y);
  }
  g.putImageData(image, 0, 0);
  fill(
    place,
    strip,
    h(
      "div",
      {},
      [1, 0.75, 0.5, 0.25, 0].map((f) =>
        h("span", {}, num(low + f * (high - low), digits), f === 1 ? ` ${unit}` : ""),
      ),
    ),
  );
}

/** The largest number 1, 2 or 5 times a power of ten that is at most `mm`. */
export function nice(mm) {
  const p = 10 ** Math.floor(Math.log10(mm));
  return [5, 2, 1].map((k) => k * p).find((v) => v <= mm) ?? p;
}
