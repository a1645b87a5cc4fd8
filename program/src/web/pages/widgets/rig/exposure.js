// In: the camera's settings. Out: sliders for exposure and gain, all other settings by name; the
// exposure that suits the stripe, found by the program.

import { get, put } from "../../base/api.js";
import { fill, h, num } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { operate, operating } from "../bar.js";
import { choice, field, follow, order } from "../parts.js";
import { attempt } from "../problem.js";

/**
 * Settings that have a slider, in this order. The second name is the one that cameras use from
 * before the second version of the standard.
 */
const HANDLES = [
  ["Exposure", ["ExposureTime", "ExposureTimeAbs"]],
  ["Gain", ["Gain", "GainRaw"]],
  ["Pictures a second", ["AcquisitionFrameRate", "AcquisitionFrameRateAbs"]],
];
const STEPS = 1000;

export async function exposure(place, progress, problem) {
  let follows = () => {},
    features = [];
  const set = (name, value) =>
    attempt(async () => {
      if (!operating()) await operate(false);
      ({ features } = await put("/camera/features", { name, value: String(value) }));
      draw();
    }, problem);
  const tuned = h("div");
  const draw = () => {
    const named = (names) =>
      features.find((f) => names.includes(f.name) && f.range && typeof f.value === "number");
    const handles = HANDLES.map(([words, names]) => [words, named(names)]).filter(([, f]) => f);
    const taken = new Set(handles.map(([, f]) => f.name));
    const rest = features.filter((f) => !taken.has(f.name) && f.writable);
    fill(
      place,
      tuned,
      handles.map(([words, f]) => handle(t(words), f, set)),
      rest.length > 0 &&
        h(
          "details",
          {},
          h("summary", {}, `${t("More settings")} (${rest.length})`),
          h(
            "div",
            { class: "stack" },
            rest.map((f) => plain(f, set)),
          ),
        ),
      !features.length &&
        h("p", { class: "small quiet" }, t("This camera has nothing that can be set from here.")),
    );
  };
  const load = () =>
    attempt(async () => {
      ({ features } = await get("/camera"));
      draw();
    }, problem);
  const said = (j) => {
    const o = j.outcome;
    fill(
      tuned,
      h(
        "p",
        { class: o.remark ? "note small" : "good-ink small", "data-tuned": String(o.exposure_us) },
        `${num(o.exposure_us, 0, "µs")} · ${o.tried.length} ${t("tried")}${o.remark ? ` · ${o.remark}` : ""}`,
      ),
    );
    load();
  };
  await load();
  return {
    tune: () =>
      attempt(async () => {
        const j = await order({ procedure: "tune" });
        follows();
        follows = follow(progress, j.id, said);
      }, problem),
    end: () => follows(),
  };
}

/** A slider for a setting; logarithmic if the range is wide, because light is perceived so. */
function handle(words, f, set) {
  const [low, high] = f.range,
    wide = low > 0 && high / low > 100;
  const at = (v) =>
    Math.round(
      STEPS * (wide ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low)),
    );
  const value = (k) => {
    const v = wide ? low * (high / low) ** (k / STEPS) : low + ((high - low) * k) / STEPS;
    return Number(v.toPrecision(3));
  };
  const box = field(
    words,
    {
      type: "number",
      min: String(low),
      max: String(high),
      step: "any",
      value: String(Number(f.value.toPrecision(6))),
      disabled: !f.writable,
      "data-feature": f.name,
      onchange: (e) => set(f.name, e.target.value),
    },
    f.unit,
  );
  const slider = h("input", {
    type: "range",
    min: "0",
    max: String(STEPS),
    "aria-label": `${words}, ${f.unit}`,
    disabled: !f.writable,
    class: "wide",
    "data-handle": f.name,
    oninput: () => {
      box.querySelector("input").value = String(value(Number(slider.value)));
    },
    onchange: () => set(f.name, value(Number(slider.value))),
  });
  slider.value = String(at(Math.min(high, Math.max(low, f.value))));
  return h("div", {}, box, slider);
}

function plain(f, set) {
  if (f.words.length)
    return choice(
      f.name,
      f.words.map((w) => [w, w]),
      String(f.value),
      (v) => set(f.name, v),
    );
  if (typeof f.value === "boolean")
    return choice(
      f.name,
      [
        ["true", t("yes")],
        ["false", t("no")],
      ],
      String(f.value),
      (v) => set(f.name, v),
    );
  return field(
    f.name,
    { value: String(f.value ?? ""), onchange: (e) => set(f.name, e.target.value) },
    f.unit,
  );
}
