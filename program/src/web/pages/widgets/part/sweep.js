// In: a recipe, the operator's values. Out: the path of the laser line over the part before it is
// scanned, drawn as the camera sees the board and into the live picture; matching speed and step,
// and what limits them. The program plans the sweep, with the same code as the job.

import { get } from "../../base/api.js";
import { fill, h, num, svg } from "../../base/dom.js";
import { on, store } from "../../base/store.js";
import { t } from "../../base/text.js";
import { livePicture } from "../view/live.js";
import { choice, field, figures, recipes as known, table } from "../parts.js";
import { fault } from "../problem.js";

/** Calibrations without which the path of the laser line is unknown. */
const NEEDED = ["camera", "laser_plane", "hand_eye"];
/** Shortest time between two updates of the plan, ms: the sweep moves with a jogged robot. */
const AGAIN = 3000;
/** @type {[string, string, string, number][]} */
const FIELDS = [
  ["sweep_mm", "Length", "mm", 5],
  ["distance_mm", "Camera to board", "mm", 1],
  ["step_mm", "From shot to shot", "mm", 0.001],
  ["speed_mm_s", "Speed", "mm/s", 0.1],
  ["camera_hz", "Camera's pictures a second", "", 0.1],
];
const LIMITS = {
  camera: "the camera",
  chain: "what is measured here",
  speed: "the station's limit of speed",
};

/** Fills `place`; returns a function that ends it. */
export async function sweep(place) {
  const [info, recipes] = [await get("/station"), await known()];
  if (!recipes.length || NEEDED.some((k) => !info.calibrations.some((c) => c.kind === k)))
    return void fill(
      place,
      h(
        "p",
        { class: "small quiet" },
        t("A sweep needs calibrations of camera, laser plane and hand-eye."),
      ),
    );
  let name = sessionStorage.getItem("recipe") ?? recipes[0].name,
    plan = null,
    turn = 0,
    asked = 0;
  if (!recipes.some((r) => r.name === name)) name = recipes[0].name;
  const drawn = h("div"),
    live = h("div"),
    said = h("div", { class: "stack" });
  const inputs = FIELDS.map(([key, words, unit, least]) => ({
    key,
    input: field(
      t(words),
      {
        type: "number",
        min: String(least),
        step: "any",
        placeholder: t("auto"),
        id: `plan-${key}`,
        onchange: () => look(),
      },
      unit,
    ),
  }));
  const look = async () => {
    const mine = ++turn,
      ask = new URLSearchParams({ recipe: name }),
      job = store.motion?.asked?.step === "scan" ? store.motion.asked.job : null;
    for (const { key, input } of inputs)
      if (Number(input.querySelector("input").value) > 0)
        ask.set(key, input.querySelector("input").value);
    if (job) ask.set("job", job);
    asked = Date.now();
    try {
      const found = await get(`/sweep?${ask}`);
      if (mine !== turn) return;
      plan = found;
      fill(drawn, picture(plan));
      fill(said, numbers(plan));
    } catch (e) {
      if (mine === turn) {
        plan = null;
        fill(drawn);
        fill(said, fault(e));
      }
    }
  };
  fill(
    place,
    h(
      "div",
      { class: "row" },
      choice(
        t("Recipe"),
        recipes.map((r) => [r.name, r.name]),
        name,
        (v) => {
          name = v;
          sessionStorage.setItem("recipe", v);
          look();
        },
      ),
    ),
    drawn,
    said,
    live,
    h(
      "div",
      { class: "row" },
      inputs.map(({ input }) => input),
    ),
  );
  const ends = [
    on("motion", look),
    on("bar", () => {
      if (store.motion?.robot && !document.hidden && Date.now() - asked > AGAIN) look();
    }),
    () => turn++,
  ];
  if (store.bar?.camera)
    ends.push(
      livePicture(
        live,
        () => null,
        (g, width) => plan && over(g, plan, width),
      ),
    );
  await look();
  return () => ends.forEach((end) => end());
}

/**
 * The board as the camera sees it from its square pose, mm: field of view, swept area, a circle that
 * contains the part in any rotation, and the area in which the part's centre may lie.
 */
function picture(p) {
  const [x0, y0, x1, y1] = p.field_mm,
    [a, b, c, d] = p.swept_mm,
    spare = 0.03 * (x1 - x0);
  const middle = (u, v) => [(u[0] + v[0]) / 2, (u[1] + v[1]) / 2],
    from = middle(a, b),
    to = middle(d, c),
    way = [to[0] - from[0], to[1] - from[1]],
    long = Math.hypot(...way);
  const along = way.map((v) => v / long),
    across = [-along[1], along[0]],
    text = (at, words) =>
      svg(
        "text",
        { x: at[0], y: at[1], "font-size": (x1 - x0) / 22, "text-anchor": "middle" },
        words,
      );
  const corner = (i, j) =>
      [0, 1].map((k) => along[k] * i * p.along_mm + across[k] * j * p.across_mm),
    list = (points) => points.map((q) => q.map((v) => v.toFixed(2)).join(",")).join(" ");
  const words = `${t("Sweep")}: ${num(p.length_mm, 0, "mm")}, ${p.shots} ${t("shots")}`,
    head = [0.045, 0.02].map((v) => v * (x1 - x0));
  const tip = [0, 1].map((k) => to[k] - along[k] * head[0]);
  return svg(
    "svg",
    {
      class: "plot sweep",
      viewBox: `${x0 - spare} ${y0 - spare} ${x1 - x0 + 2 * spare} ${y1 - y0 + 2 * spare}`,
      role: "img",
      "aria-label": words,
      "data-swept": String(p.shots),
    },
    svg("rect", { class: "field", x: x0, y: y0, width: x1 - x0, height: y1 - y0 }),
    svg("polygon", { class: "band", points: list([a, b, c, d]) }),
    p.along_mm > 0 &&
      p.across_mm > 0 &&
      svg("polygon", {
        class: "piece",
        points: list([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)]),
      }),
    svg("circle", { class: "part", cx: 0, cy: 0, r: p.part_mm / 2 }),
    svg("polyline", { class: "way", points: list([a, b]) }),
    svg("polyline", { class: "way", points: list([d, c]) }),
    svg("polyline", { class: "way", points: list([from, to]) }),
    svg("polyline", {
      class: "way",
      points: list([
        [0, 1].map((k) => tip[k] + across[k] * head[1]),
        to,
        [0, 1].map((k) => tip[k] - across[k] * head[1]),
      ]),
    }),
    text([0, y1 - 0.02 * (y1 - y0)], `${num(p.length_mm, 0, "mm")} · ${p.shots} ${t("shots")}`),
  );
}

/** Draws swept area and part into the live picture, at the camera's current pose. */
function over(g, p, width) {
  const [swept, round] = p.seen_px;
  if (!swept) return;
  for (const [line, dash] of [
    [swept, []],
    [round, [8, 6]],
  ]) {
    g.setLineDash(dash);
    for (const dark of [true, false]) {
      g.strokeStyle = dark ? "#000a" : "#ffd33d";
      g.lineWidth = ((dark ? 4 : 1.8) * Math.max(width, 320)) / 640;
      g.beginPath();
      line.forEach(([u, v], i) => (i ? g.lineTo(u + 0.5, v + 0.5) : g.moveTo(u + 0.5, v + 0.5)));
      g.stroke();
    }
  }
  g.setLineDash([]);
}

function numbers(p) {
  const left = (mm, words) => [num(mm, 1, "mm"), t(words), mm < 0 ? "bad-ink" : ""];
  const q = p.pace,
    rows =
      q?.bears.map(([name, v]) => [
        name === q.limited_by ? h("b", {}, t(LIMITS[name])) : t(LIMITS[name]),
        num({ camera: p.camera_hz, chain: p.chain_hz }[name] ?? NaN, 1),
        num(v, 1),
      ]) ?? [];
  return [
    h(
      "p",
      { class: "small quiet" },
      t(
        p.touched
          ? "Over the board that was touched."
          : "The board is taken to lie squarely before the camera until it is touched.",
      ),
    ),
    figures(
      [num(p.depth_mm, 0, "mm"), t("camera above the board")],
      [num(p.step_mm, 3, "mm"), t("from shot to shot")],
      left(p.along_mm, "allowed offset of the part, along the sweep"),
      left(p.across_mm, "allowed offset of the part, along the stripe"),
      ...(p.volume_mm
        ? [
            left(p.volume_mm[0], "working volume above the board"),
            left(p.volume_mm[1], "working volume below the board"),
          ]
        : []),
      p.box_mm !== null && left(p.box_mm, "distance of the flange from the workspace limits"),
    ),
    p.flange.length > 0 &&
      h(
        "details",
        {},
        h("summary", {}, t("Flange at the first and the last shot")),
        table(
          ["", ...p.labels.map((l) => `#${l}`)],
          p.flange.map((f, i) => [t(i ? "last" : "first"), ...f.map((v) => num(v, 3))]),
        ),
      ),
    h("h3", {}, t("Speed and step of a continuous scan")),
    q
      ? [
          figures(
            [num(q.speed_mm_s, 1, "mm/s"), t("speed")],
            [num(q.step_mm, 3, "mm"), t("a shot")],
            [num(q.rate_hz, 1), t("pictures a second")],
            [num(q.seconds, 1, "s"), t("in all")],
          ),
          h(
            "p",
            {
              class: q.left_step_mm > 1.000001 * q.step_mm ? "bad-ink" : "",
              "data-limit": q.limited_by ?? "",
            },
            q.limited_by
              ? `${t("Limited by")}: ${t(LIMITS[q.limited_by])}`
              : t("No known limit is reached."),
          ),
          q.left_step_mm > 1.000001 * q.step_mm &&
            h(
              "p",
              { class: "bad-ink" },
              `${t("Actual spacing at this speed")}: ${num(q.left_step_mm, 3, "mm")} ${t("a shot")}`,
            ),
          rows.length > 0 &&
            table([t("Limit"), `#${t("pictures a second")}`, `#${t("allows, mm/s")}`], rows),
        ]
      : h(
          "p",
          { class: "small quiet" },
          t(
            "The limit of the speed is unknown. State the camera's pictures per second, or scan once.",
          ),
        ),
  ];
}
