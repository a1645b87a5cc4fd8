// In: a drawing of a part (DXF), chosen or dropped here. Out: a recipe that the program makes
// from it.

import { post } from "../../base/api.js";
import { fill, h, num } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { operate, operating } from "../bar.js";
import { choice, field, panel, storing } from "../parts.js";
import { attempt } from "../problem.js";

const UNITS = ["mm", "inch", "cm", "m", "um", "mil", "foot"];
/** Largest drawing, bytes: the server accepts requests of up to 1 MiB. */
const LARGEST = 1000000;

/**
 * `taken(name)`: whether the station has a recipe of that name. `made(read)` is called with the
 * server's answer after a recipe was made.
 */
export function drawing(problem, taken, made) {
  let text = null,
    unit = "",
    file = "part";
  const said = h("div"),
    form = h("div", { class: "stack", hidden: true });
  const name = field(t("Name"), {
    type: "text",
    value: "part",
    maxlength: "60",
    id: "drawing-name",
  });
  const alike = field(t("Number of turns that look alike"), {
      type: "number",
      value: "1",
      min: "1",
      step: "1",
    }),
    cell = field(t("Cell"), { type: "number", value: "0.5", min: "0.01", step: "0.05" }, "mm");
  const bears = field(
      t("Tolerance"),
      { type: "number", value: "0.2", step: "0.05", min: "0.01" },
      "mm",
    ),
    turns = field(
      t("Tolerance, degrees"),
      { type: "number", value: "1", step: "0.1", min: "0.01" },
      "°",
    ),
    above = field(t("Approach"), { type: "number", value: "20", step: "1", min: "1" }, "mm");
  const value = (f) => f.querySelector("input").value;
  const take = async (chosen) => {
    if (!chosen) return;
    if (chosen.size > LARGEST)
      return void fill(
        said,
        h(
          "p",
          { class: "note small" },
          t("The drawing is larger than 1 MB: use sheetlight model on the command line."),
        ),
      );
    text = await chosen.text();
    file =
      chosen.name
        .replace(/\.[^.]*$/, "")
        .replace(/[^\w .+()-]/g, "_")
        .slice(0, 60) || "part";
    name.querySelector("input").value = file;
    form.hidden = false;
    fill(said, h("p", { class: "small" }, `${chosen.name} · ${num(chosen.size / 1000, 0, "kB")}`));
  };
  const input = h("input", {
    type: "file",
    id: "drawing",
    accept: ".dxf",
    "aria-label": t("From a drawing (DXF)"),
    onchange: () => take(input.files[0]),
  });
  const make = (called, replace) =>
    attempt(async () => {
      if (!operating()) await operate(false);
      const read = await post("/drawings", {
        name: called,
        replace,
        text,
        ...(unit ? { unit } : {}),
        alike_turns: Number(value(alike)),
        cell_mm: Number(value(cell)),
        tolerance_mm: Number(value(bears)),
        tolerance_deg: Number(value(turns)),
        approach_mm: Number(value(above)),
      });
      fill(
        said,
        h(
          "p",
          { class: "good-ink small", "data-drawn": read.recipe.name },
          `${num(read.size_mm[0], 2)} × ${num(read.size_mm[1], 2, "mm")}`,
        ),
        read.notes.map((n) => h("p", { class: "note small" }, n)),
      );
      form.hidden = true;
      await made(read);
    }, problem);
  fill(
    form,
    name,
    choice(
      t("Unit, where it names none"),
      [["", t("as it says")], ...UNITS.map((u) => [u, u])],
      unit,
      (v) => (unit = v),
    ),
    h("div", { class: "row" }, alike, cell),
    h("div", { class: "row" }, bears, turns),
    above,
    storing(
      t("Make the recipe"),
      { class: "main", id: "make-recipe" },
      { name: () => value(name).trim(), taken, store: make },
    ),
  );
  return {
    panel: panel(t("From a drawing (DXF)"), h("div", { class: "stack" }, input, said, form)),
  };
}
