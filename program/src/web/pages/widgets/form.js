// In: the schema of an order. Out: fields for its plain inputs: words, numbers, texts and switches.
// Lists, and what the page itself asks for, have no field.

import { get } from "../base/api.js";
import { h } from "../base/dom.js";
import { t } from "../base/text.js";
import { choice, field } from "./parts.js";

/** What a field is called. The schema's sentence is shown when the pointer rests on it. */
export const FIELDS = {
  board: "Shape of the board",
  channel: "Colour channel",
  far_mm: "Farthest depth, mm",
  lens: "Lens terms",
  mount: "Mount of the camera",
  near_mm: "Nearest depth, mm",
  on: "Run on",
  poses: "Pose file",
  robot_sigma_deg: "Scatter of the robot, degrees",
  robot_sigma_mm: "Scatter of the robot, mm",
  skew: "Skew",
  working_mm: "Working distance, mm",
};

let schemas;

/**
 * The inputs of an order that have a field.
 * @returns {Promise<[string, Record<string, any>][]>}
 */
export async function inputs(order) {
  schemas ??= (await get("/openapi.json")).components.schemas;
  const plain = ({ type }) => ![type].flat().includes("array");
  return Object.entries(schemas[order].properties).filter(
    ([name, schema]) => name in FIELDS && plain(schema),
  );
}

/** Fields for `inputs`; what a person sets is put into `values`, and what is emptied leaves it. */
export function form(inputs, values) {
  const keep = (name, value) => {
    if (value === null || value === "" || value === false) delete values[name];
    else values[name] = value;
  };
  return h(
    "div",
    { class: "row" },
    inputs.map(([name, schema]) => {
      const one = fieldOf(name, schema, values[name], (value) => keep(name, value));
      one.title = schema.description ?? "";
      one.dataset.input = name;
      return one;
    }),
  );
}

function fieldOf(name, schema, value, changed) {
  const kinds = [schema.type].flat();
  const words = schema.enum?.filter((word) => word !== null);
  if (words)
    return choice(
      t(FIELDS[name]),
      [
        ["", schema.default ?? t("as the station")],
        ...words.filter((w) => w !== schema.default).map((w) => [w, w]),
      ],
      value ?? "",
      changed,
    );
  if (kinds.includes("boolean"))
    return h(
      "label",
      {},
      h("input", {
        type: "checkbox",
        checked: Boolean(value),
        onchange: (e) => changed(e.target.checked),
      }),
      t(FIELDS[name]),
    );
  const number = kinds.includes("number") || kinds.includes("integer");
  return field(t(FIELDS[name]), {
    type: number ? "number" : "text",
    step: "any",
    value: value ?? "",
    oninput: (e) =>
      changed(number && e.target.value !== "" ? Number(e.target.value) : e.target.value),
  });
}
