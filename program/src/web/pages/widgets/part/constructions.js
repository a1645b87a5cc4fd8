// Shows a recipe's constructed points beside the picture. The program writes them into the text,
// so that the text's comments are preserved.

import { post } from "../../base/api.js";
import { fill, h, num } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { choice, field, table } from "../parts.js";

const KINDS = { midpoint: "Midpoint", line: "Line", offset: "Offset", lattice: "Lattice" };

/**
 * `recipe.text()` and `recipe.write(text)` read and write the editor's text. `recipe.shown(points)`
 * receives the constructed points, `recipe.say(fault)` the fault of a request.
 */
export function constructions(place, recipe) {
  let points = [],
    kind = "midpoint",
    turn = 0;
  const now = { of: [], along: "", by: [0, 0] };
  /** Sends a request to the server; only the answer to the newest request is used. */
  const ask = async (what, taken) => {
    const mine = ++turn;
    try {
      const read = await what();
      if (mine === turn) taken(read);
    } catch (e) {
      if (mine === turn) {
        recipe.say(e);
        draw();
      }
    }
  };
  const show = (read) => {
    points = read;
    recipe.shown(points.filter((p) => p.kind !== "grid"));
    draw();
  };
  const load = () => ask(() => post("/points", { text: recipe.text() }), show);
  const change = (what) =>
    ask(
      () => post("/points/change", { text: recipe.text(), change: what }),
      (read) => {
        recipe.write(read.text);
        show(read.points);
      },
    );
  const choose = (name) => change({ choose: { name } });
  const add = (name) => {
    const of = now.of.slice(0, { midpoint: 2, line: 2 }[kind] ?? 1).filter(Boolean);
    return change({
      add: { name, kind, of, ...(kind === "offset" ? { along: now.along, by_mm: now.by } : {}) },
    });
  };
  const built = () => points.filter((p) => p.kind in KINDS || p.kind === "intersection");
  function draw() {
    const name = field(t("Name"), {
      type: "text",
      value: free(),
      maxlength: "60",
      id: "point-name",
    });
    const names = (kinds) =>
      points
        .filter((p) => (kinds ? kinds.includes(p.kind) : p.kind !== "grid"))
        .map((p) => [p.name, p.name]);
    const one = (words, list, k) => {
      if (!list.some(([v]) => v === now.of[k])) now.of[k] = list[Math.min(k, list.length - 1)]?.[0];
      return choice(words, list, now.of[k], (v) => {
        now.of[k] = v;
      });
    };
    const number = (words, k, id) =>
      field(
        words,
        {
          type: "number",
          id,
          step: "0.01",
          value: String(now.by[k]),
          oninput: (e) => {
            now.by[k] = Number(e.target.value);
          },
        },
        "mm",
      );
    const ways = names(["line", "lattice"]);
    if (!ways.some(([v]) => v === now.along)) now.along = ways[0]?.[0] ?? "";
    const inputs = {
      midpoint: () => [one(t("Of"), names(), 0), one(t("and"), names(), 1)],
      line: () => [one(t("Of"), names(), 0), one(t("and"), names(), 1)],
      offset: () => [
        one(t("Of"), names(), 0),
        choice(t("Along"), ways, now.along, (v) => {
          now.along = v;
        }),
        number(t("Along, mm"), 0, "by-along"),
        number(t("Across, mm"), 1, "by-across"),
      ],
      lattice: () => [one(t("Of"), names(["grid"]), 0)],
    }[kind]();
    const need =
      { lattice: names(["grid"]).length > 0, offset: ways.length > 0 && names().length > 0 }[
        kind
      ] ?? names().length > 1;
    fill(
      place,
      built().length > 0 &&
        table(
          [t("Point"), "#x, mm", "#y, mm", t("Tool"), ""],
          built().map((p) => [
            h("span", { "data-point": p.name }, p.name),
            num(p.at[0], 3),
            num(p.at[1], 3),
            p.kind === "line"
              ? ""
              : h("input", {
                  type: "radio",
                  name: "chosen",
                  checked: p.chosen,
                  "aria-label": `${t("Tool goes to")} ${p.name}`,
                  onchange: () => choose(p.name),
                }),
            h(
              "button",
              {
                class: "plain",
                "aria-label": `${t("Delete")} ${p.name}`,
                onclick: () => change({ take_out: { name: p.name } }),
              },
              "×",
            ),
          ]),
        ),
      built().some((p) => p.chosen) &&
        h("button", { onclick: () => choose(null) }, t("Tool goes to the part's own place")),
      h(
        "div",
        { class: "row" },
        choice(
          t("Construct"),
          Object.entries(KINDS).map(([k, w]) => [k, t(w)]),
          kind,
          (v) => {
            kind = v;
            now.of = [];
            draw();
          },
        ),
        inputs,
        name,
        h(
          "button",
          {
            id: "add-point",
            disabled: !need,
            onclick: () => add(name.querySelector("input").value.trim()),
          },
          t("Add"),
        ),
      ),
      !need &&
        h(
          "p",
          { class: "small quiet" },
          t(
            "A construction needs named shapes. A lattice needs a grid. An offset needs a line or a lattice.",
          ),
        ),
    );
  }
  const free = () => {
    for (let k = 1; ; k++) if (!points.some((p) => p.name === `point ${k}`)) return `point ${k}`;
  };
  load();
  return { load };
}
