// In: a scan and its map. Out: filters that remove glints and irrelevant surfaces from the view;
// they can be undone one by one, and the result can be stored as a scan.

import { get, put } from "../../base/api.js";
import { fill, h, num, thousands } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { operate, operating } from "../bar.js";
import { field, follow, order } from "../parts.js";
import { attempt } from "../problem.js";

/** A short description of a filter. */
function words(f) {
  const box =
    f.corners &&
    `${num(Math.abs(f.corners[2] - f.corners[0]), 1)} × ${num(Math.abs(f.corners[3] - f.corners[1]), 1, "mm")}`;
  switch (f.filter) {
    case "sigma":
      return `σ ≤ ${num(f.most_mm, 4, "mm")}`;
    case "heights":
      return `${t("Heights")} ${num(f.low_mm, 2)} … ${num(f.high_mm, 2, "mm")}`;
    case "cut":
      return `${t("Cut out")} ${box}`;
    case "keep":
      return `${t("Keep")} ${box}`;
    default:
      return `${t("Islands")} < ${f.least_cells} ${t("cells")}, ${t("step")} ${num(f.step_mm, 2, "mm")}`;
  }
}

/**
 * Shows the filters in `place`. Calls `changed()` after each change, and `saved(job)` when the
 * filtered scan is finished. Returns `cut` and `keep`, the map tools that draw boxes, and `end()`.
 */
export async function filters(place, id, head, { changed, saved, problem }) {
  let now = await get(`/scans/${id}/filters`),
    follows = () => {};
  const list = h("div"),
    left = h("p", { class: "small quiet", role: "status" }),
    progress = h("div");
  const set = (all) =>
    attempt(async () => {
      if (!operating()) await operate(false);
      now = await put(`/scans/${id}/filters`, { filters: all });
      draw();
      await changed();
    }, problem);
  const add = (f) => set([...now.filters, f]);
  const number = (name, value, step) =>
    field(name, { type: "number", value: String(value), step: String(step), class: "short" });
  const of = (label) => Number(label.querySelector("input").value);
  const sigma = number("σ ≤", Number(head.sigma_mm[1].toPrecision(2)), 0.005),
    low = number(t("from"), num(head.z_mm[0], 1), 0.1),
    high = number(t("to"), num(head.z_mm[1], 1), 0.1);
  const cells = number(t("fewer cells than"), 20, 1),
    step = number(t("step"), num(Math.max(2 * head.cell_mm, 0.1), 2), 0.05);
  const button = (name, f) =>
    h(
      "button",
      {
        class: "plain",
        "data-filter": name,
        "aria-label": `${t("Remove")}: ${t({ sigma: "Uncertain", heights: "Heights", islands: "Islands" }[name])}`,
        onclick: () => add(f()),
      },
      t("Remove"),
    );
  const undo = h(
    "button",
    { id: "undo-filter", onclick: () => set(now.filters.slice(0, -1)) },
    t("Undo"),
  );
  const save = h(
    "button",
    {
      id: "save-filtered",
      onclick: () =>
        attempt(async () => {
          const j = await order({ procedure: "filter", scan: id, filters: now.filters });
          follows();
          follows = follow(progress, j.id, saved);
        }, problem),
    },
    t("Save as a scan"),
  );
  function draw() {
    undo.disabled = save.disabled = !now.filters.length;
    fill(
      list,
      now.filters.map((f, i) =>
        h(
          "div",
          { class: "light" },
          h("span", {}, ""),
          h(
            "span",
            {},
            words(f),
            h("div", { class: "small quiet" }, `${thousands(now.cells[i])} ${t("cells removed")}`),
          ),
          h(
            "button",
            {
              class: "plain",
              "aria-label": `${t("Undo")} ${words(f)}`,
              onclick: () => set(now.filters.filter((_, k) => k !== i)),
            },
            "×",
          ),
        ),
      ),
    );
    left.textContent = `${thousands(now.left)} ${t("cells are left")}`;
    place.dataset.left = String(now.left);
  }
  fill(
    place,
    h(
      "div",
      { class: "row" },
      cells,
      step,
      h("span", { class: "small quiet" }, "mm"),
      button("islands", () => ({
        filter: "islands",
        least_cells: Math.round(of(cells)),
        step_mm: of(step),
      })),
    ),
    h(
      "div",
      { class: "row" },
      sigma,
      h("span", { class: "small quiet" }, "mm"),
      button("sigma", () => ({ filter: "sigma", most_mm: of(sigma) })),
    ),
    h(
      "div",
      { class: "row" },
      low,
      high,
      h("span", { class: "small quiet" }, "mm"),
      button("heights", () => ({ filter: "heights", low_mm: of(low), high_mm: of(high) })),
    ),
    list,
    left,
    h("div", { class: "row" }, undo, save),
    progress,
  );
  draw();
  const box = (filter) => (a, b) => add({ filter, corners: [...a, ...b] });
  return {
    cut: { shape: "box", says: t("Draw a box around the area to remove"), done: box("cut") },
    keep: { shape: "box", says: t("Draw a box around the area to keep"), done: box("keep") },
    end: () => follows(),
  };
}
