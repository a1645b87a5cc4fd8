// In: a picture on a map. Out: the region in which the stripe is searched, adjusted by its
// corners and edges, stored in the station's settings.

import { get, put } from "../../base/api.js";
import { fill, h } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { operate, operating } from "../bar.js";
import { attempt } from "../problem.js";

const WHOLE = [0, 0, 1, 1],
  KEY = "extraction.region";
/** Grips by the edges that they move, in x and y: -1 left or top, 1 right or bottom, 0 neither. */
const GRIPS = [
  [-1, -1],
  [0, -1],
  [1, -1],
  [1, 0],
  [1, 1],
  [0, 1],
  [-1, 1],
  [-1, 0],
];
/** Least width and height, and step of an arrow key, as fractions of the picture. */
const LEAST = 0.02,
  STEP = 0.01;

export async function region(box, view, problem) {
  let now = (await get("/settings")).values[KEY] ?? WHOLE,
    edited = false;
  const frame = h("div", { class: "region", hidden: true }, h("div", { class: "edge" }));
  const grips = GRIPS.map(([x, y]) =>
    h("button", {
      class: "grip",
      "aria-label":
        `${t("Region")}: ` +
        [["top", "", "bottom"][y + 1], ["left", "", "right"][x + 1]]
          .filter(Boolean)
          .map(t)
          .join(" "),
      "data-grip": `${x},${y}`,
    }),
  );
  grips.forEach((g) => frame.append(g));
  box.append(frame);
  const whole = () => now.every((v, i) => Math.abs(v - WHOLE[i]) < 1e-9);
  const put_ = () => {
    const head = view.head();
    frame.hidden = !head || !view.ready() || (!edited && whole());
    if (frame.hidden) return;
    const [l, top, r, b] = now,
      [x0, y0] = view.toView([l * head.width, head.height * (1 - top)]),
      [x1, y1] = view.toView([r * head.width, head.height * (1 - b)]);
    Object.assign(frame.style, {
      left: `${x0}px`,
      top: `${y0}px`,
      width: `${x1 - x0}px`,
      height: `${y1 - y0}px`,
    });
    grips.forEach((g, i) => {
      const [x, y] = GRIPS[i];
      g.hidden = !edited;
      g.style.left = `${50 * (x + 1)}%`;
      g.style.top = `${50 * (y + 1)}%`;
    });
  };
  /** @type {(corner: number[], to: number[]) => void} */
  const move = ([x, y], [u, v]) => {
    let [l, top, r, b] = now;
    if (x < 0) l = Math.min(Math.max(0, u), r - LEAST);
    else if (x > 0) r = Math.max(Math.min(1, u), l + LEAST);
    if (y < 0) top = Math.min(Math.max(0, v), b - LEAST);
    else if (y > 0) b = Math.max(Math.min(1, v), top + LEAST);
    now = [l, top, r, b].map((s) => Math.round(1e4 * s) / 1e4);
    put_();
  };
  const save = () =>
    attempt(async () => {
      if (!operating()) await operate(false);
      const { sha256 } = await get("/settings");
      now =
        (await put("/settings", { sha256, changes: { [KEY]: whole() ? null : now } })).values[
          KEY
        ] ?? WHOLE;
      frame.dataset.saved = now.join(" ");
      draw();
    }, problem);
  grips.forEach((g, i) => {
    const which = GRIPS[i];
    let held = false;
    g.addEventListener("pointerdown", (e) => {
      held = true;
      g.setPointerCapture(e.pointerId);
      e.stopPropagation();
    });
    g.addEventListener("pointermove", (e) => {
      if (!held) return;
      const at = box.getBoundingClientRect(),
        head = view.head(),
        [u, v] = view.toGrid([e.clientX - at.left, e.clientY - at.top]);
      move(which, [u / head.width, 1 - v / head.height]);
    });
    g.addEventListener("pointerup", () => {
      if (held) {
        held = false;
        save();
      }
    });
    g.addEventListener("keydown", (e) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[
        e.key
      ];
      if (!way) return;
      e.preventDefault();
      const [l, top, r, b] = now;
      move(which, [
        (which[0] < 0 ? l : r) + STEP * way[0],
        (which[1] < 0 ? top : b) + STEP * way[1],
      ]);
    });
    g.addEventListener("keyup", (e) => {
      if (/^Arrow/.test(e.key)) save();
    });
  });
  const toggle = h(
    "button",
    {
      id: "region",
      title: t("Where in the picture the stripe is looked for"),
      onclick: () => {
        edited = !edited;
        draw();
      },
    },
    t("Region"),
  );
  const all = h(
    "button",
    {
      id: "region-whole",
      onclick: () => {
        now = WHOLE;
        save();
      },
    },
    t("Whole picture"),
  );
  const draw = () => {
    toggle.setAttribute("aria-pressed", String(edited));
    all.hidden = whole();
    put_();
  };
  view.after(put_);
  draw();
  return {
    tools: [toggle, all],
    end() {
      view.after(null);
      fill(frame);
      frame.remove();
    },
  };
}
