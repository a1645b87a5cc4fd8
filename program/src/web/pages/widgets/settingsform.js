// In: the station's settings. Out: fields for those that operators change; only changed ones are
// sent.

import { fill, h } from "../base/dom.js";
import { t } from "../base/text.js";
import { choice, field, table } from "./parts.js";

/** Settings that are numbers: name with dots, words, unit. */
const NUMBERS = [
  ["tolerance_mm", "Tolerance of the work", "mm"],
  ["working_volume.near_mm", "Working volume from", "mm"],
  ["working_volume.far_mm", "Working volume to", "mm"],
  ["motion.speed_mm_s", "Speed of motions", "mm/s"],
  ["motion.max_step_mm", "Longest motion", "mm"],
  ["motion.max_turn_deg", "Largest turn", "°"],
  ["motion.max_turn_deg_s", "Turning rate at most", "°/s"],
  ["motion.max_tilt_deg", "Largest tilt", "°"],
  ["motion.max_still_ms", "Halt when the pose stands still for", "ms"],
  ["outputs.line", "Output of the line laser", ""],
  ["outputs.pointer", "Output of the pointer", ""],
  ["outputs.room", "Output of the lamp", ""],
  ["outputs.gripper", "Output of the gripper", ""],
];

/** Where the camera is mounted; the calibrations of its pose depend on it. */
export const MOUNTS = {
  "eye-in-hand": "on the flange",
  "eye-to-hand": "beside the robot, it stands still",
};

/** Fills `place`; `save(changes)` receives names and new values, null for an emptied field. */
export function settingsForm(place, now, save) {
  const { values } = now,
    changes = {},
    has = (table_) => Object.keys(values).some((k) => k.startsWith(`${table_}.`));
  const button = h(
    "button",
    { class: "main", id: "save-settings", disabled: true, onclick: () => save(changes) },
    t("Save"),
  );
  const changed = (key, value) => {
    if (value === (values[key] ?? null)) delete changes[key];
    else changes[key] = value;
    button.disabled = !Object.keys(changes).length;
  };
  const name = field(t("Name"), {
    type: "text",
    value: values.name ?? "",
    maxlength: "80",
    "data-setting": "name",
    oninput: (e) => changed("name", e.target.value),
  });
  const notation = choice(
    t("Notation"),
    [["", t("none: matrices")], ...now.notations.map((n) => [n, n])],
    values.robot ?? "",
    (v) => changed("robot", v || null),
  );
  notation.querySelector("select").dataset.setting = "robot";
  const mount = choice(
    t("Camera is mounted"),
    [["", t("not stated")], ...Object.entries(MOUNTS).map(([v, words]) => [v, t(words)])],
    values.mount ?? "",
    (v) => changed("mount", v || null),
  );
  mount.querySelector("select").dataset.setting = "mount";
  const offered = NUMBERS.filter(
    ([key]) => !/^motion\./.test(key) || (has("motion") && key in values),
  ).filter(([key]) => !/^outputs\./.test(key) || has("outputs"));
  const number = ([key, words, unit]) =>
    field(
      t(words),
      {
        type: "number",
        step: "any",
        value: String(values[key] ?? ""),
        "data-setting": key,
        placeholder: t("not set"),
        oninput: (e) => changed(key, e.target.value === "" ? null : Number(e.target.value)),
      },
      unit,
    );
  fill(
    place,
    h("div", { class: "stack form" }, name, notation, mount, offered.map(number)),
    h("div", { class: "row" }, button),
    !has("motion") &&
      h(
        "p",
        { class: "small quiet" },
        t(
          "No motion limits are set: nothing moves. Set them in the table [motion] of station.toml below.",
        ),
      ),
    h(
      "details",
      {},
      h("summary", {}, t("How the stripe is found")),
      table(
        [t("Setting"), t("Value")],
        Object.entries(values)
          .filter(([k]) => k.startsWith("extraction."))
          .map(([k, v]) => [k.slice(11), JSON.stringify(v)]),
      ),
    ),
  );
}
