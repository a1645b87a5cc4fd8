// Position: an insertion with the robot, each motion shown and confirmed by holding the button;
// the tool's poses with their uncertainty and its sources, and the gates.

import { get, post } from "../base/api.js";
import { all, fill, h, num, svg } from "../base/dom.js";
import { jobs, on, store } from "../base/store.js";
import { t } from "../base/text.js";
import { operate, operating } from "../widgets/bar.js";
import { arming, ask, gate, inTheCell } from "../widgets/ask.js";
import { attempt, fault } from "../widgets/problem.js";
import {
  choice,
  figure,
  figures,
  follow,
  nothing,
  order,
  panel,
  recipes as known,
  table,
} from "../widgets/parts.js";
import { scanMap } from "../widgets/view/scanmap.js";
import { cloud } from "../widgets/view/cloud.js";
import { livePicture } from "../widgets/view/live.js";

const moves = (j) => j.order.procedure === "insert";
/** The found position of a job, in a scan or with the robot; null if the job found none. */
const found = (j) =>
  j.state === "done" && j.order.procedure === "find"
    ? j.outcome
    : j.state === "done" && moves(j)
      ? j.outcome.found
      : null;

export async function show(place, query) {
  const list = jobs(found),
    named = store.jobs.get(query.get("job"));
  const job = list.find((j) => j.id === named?.id) ?? list[0];
  const drive = store.motion?.robot ? await insertion(named, job) : { ends: [] };
  const numbers = h("div", { class: "stack" }),
    picture = h("div", { class: "stack grow" });
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Position")),
      job &&
        choice(
          t("Found"),
          list.map((j) => [j.id, words(j)]),
          job.id,
          (id) => (location.hash = `#/position?job=${id}`),
        ),
    ),
    drive.panel,
    job ? numbers : !drive.panel && nothing(t("No part was looked for yet."), "part", t("Part")),
  );
  let view = null;
  if (job) {
    pose(numbers, job, picture);
    if (job.order.procedure === "find") view = await seen(picture, job);
    else
      fill(
        picture,
        h("img", {
          class: "wide",
          src: `/api/v1/jobs/${job.id}/files/insertion/found.png`,
          alt: t("The part as it was found"),
        }),
      );
  }
  return () => {
    view?.end();
    drive.ends.forEach((end) => end());
  };
}

/** Shows the found part over its scan, as a map or in three dimensions. */
async function seen(place, job) {
  const flat = h("div", { class: "stack grow" }),
    deep = h("div", { class: "stack grow", hidden: true }),
    p = found(job);
  let map = null,
    solid = null;
  const mode = async (three) => {
    flat.hidden = three;
    deep.hidden = !three;
    for (const [i, b] of [...tools.children].entries())
      b.setAttribute("aria-pressed", String(three === (i === 1)));
    if (three)
      solid ??= await attempt(async () =>
        cloud(deep, job.order.scans[0], (await get(`/jobs/${job.id}/outlines`)).lines),
      );
  };
  const tools = h(
    "div",
    { class: "tools", role: "group", "aria-label": t("Found") },
    h("button", { "aria-pressed": "true", onclick: () => mode(false) }, t("Map")),
    h("button", { id: "three", "aria-pressed": "false", onclick: () => mode(true) }, "3-D"),
  );
  fill(place, tools, flat, deep);
  map = await scanMap(flat, job.order.scans[0]).catch((e) => void fill(flat, fault(e)));
  map?.marks(
    p.outline.map((points) => ({
      kind: "line",
      points,
      colour: p.passed ? "#ffffff" : "#ff5ac8",
      wide: 1.5,
    })),
  );
  return {
    end() {
      map?.end();
      solid?.end();
    },
  };
}

/**
 * The job whose part is drawn over the live picture: the job that asks for a motion at the part,
 * otherwise the job whose position is shown. Null while another job runs.
 */
const drawn = (shown) =>
  ["approach", "insert", "retract"].includes(store.motion?.asked?.step)
    ? store.motion.asked.job
    : store.bar?.running
      ? null
      : (shown?.id ?? null);

const words = (j) =>
  `${j.id} · ${j.order.recipe}` +
  (j.order.scans ? ` · ${j.order.scans.join(" + ")}` : "") +
  (found(j).passed ? "" : ` · ${t("refused")}`);

/** Panel of an insertion: recipe, arming, start, the motion to confirm, progress of the job. */
async function insertion(named, job) {
  const recipes = await known(),
    simulated = store.motion.simulated;
  let name = simulated?.holds ?? sessionStorage.getItem("recipe") ?? recipes[0]?.name;
  const problem = h("div"),
    progress = h("div"),
    armed = h("div", { class: "stack" }),
    asked = h("div", { class: "stack ask" }),
    cell = h("div"),
    live = h("div"),
    start = h("div", { class: "stack" });
  const sweep = h("input", {
    type: "number",
    id: "sweep",
    min: "5",
    step: "1",
    placeholder: t("auto"),
  });
  let follows = () => {},
    watched = null;
  const ended = (j) => {
    const o = j.outcome;
    fill(
      progress,
      h(
        "div",
        { class: "panel", "data-inserted": j.id },
        h("p", {}, h("span", { class: "dot good" }), " ", h("b", {}, `${j.id}: ${t("inserted")}`)),
        figures(
          [num(o.time_to_position_s, 1, "s"), t("to the confirmed position")],
          [String(o.confirmations_to_position ?? "–"), t("motions confirmed until then")],
          [num(o.seconds, 1, "s"), t("in all")],
          [String(o.confirmations), t("motions confirmed")],
        ),
        h(
          "a",
          { href: `#/position?job=${j.id}&again=${Date.now()}`, id: "to-found" },
          t("What was found"),
        ),
      ),
    );
  };
  const watch = (id) => {
    follows();
    watched = id;
    follows = follow(progress, id, ended);
  };
  const run = () =>
    attempt(async () => {
      const mm = Number(sweep.value);
      const j = await order({
        procedure: "insert",
        recipe: name,
        ...(mm > 0 ? { sweep_mm: mm } : {}),
      });
      watch(j.id);
    }, problem);
  const draw = () =>
    fill(
      start,
      !simulated &&
        choice(
          t("Recipe"),
          recipes.map((r) => [r.name, `${r.name}${r.title ? ` · ${r.title}` : ""}`]),
          name,
          (v) => {
            name = v;
            sessionStorage.setItem("recipe", v);
          },
        ),
      h(
        "div",
        { class: "row" },
        h("label", { for: "sweep" }, h("span", { class: "small quiet" }, t("Sweep, mm")), sweep),
        h(
          "button",
          {
            class: "main",
            id: "insert",
            disabled: !store.motion.armed || !!store.bar?.running,
            onclick: run,
          },
          t("Start"),
        ),
      ),
    );
  let before = null;
  const again = () => {
    const state = JSON.stringify([store.motion.armed, store.bar?.running]);
    if (state !== before) {
      before = state;
      draw();
    }
  };
  again();
  const ends = [
    arming(armed),
    ask(asked),
    on("motion", again),
    on("bar", again),
    // An insertion that another tab or a PLC has ordered is followed too.
    on("jobs", (j) => {
      if (j && moves(j) && j.id !== watched && ["queued", "running"].includes(j.state)) watch(j.id);
    }),
    () => follows(),
    livePicture(live, () => drawn(job)),
  ];
  if (simulated) ends.push(inTheCell(cell, false, (s) => (name = s.holds)));
  const last = named && moves(named) ? named : jobs((j) => moves(j) && j.state !== "done")[0];
  if (last && (last.state !== "done" || named)) watch(last.id);
  const panel_ = h(
    "div",
    { class: "split drive" },
    h("div", { class: "stack" }, panel(t("Motion"), asked), problem, progress),
    h(
      "div",
      { class: "stack" },
      panel(t("Robot"), armed),
      panel(
        t("Insert a part"),
        simulated &&
          h(
            "p",
            { class: "small quiet" },
            t("Component in the simulated gripper; the arm is jogged over its part"),
          ),
        cell,
        start,
      ),
      store.bar?.camera && panel(t("Camera"), live),
    ),
  );
  return { panel: panel_, ends };
}

/** Shows the pose with its standard deviation, its sources of uncertainty, and the gates. */
function pose(place, job, picture) {
  const p = found(job),
    poses = p.poses,
    numbers = h("div"),
    goals = h("div", { class: "tools", role: "group", "aria-label": t("Pose") });
  let goal = "approach",
    notation = poses?.convention;
  const draw = () => {
    if (!poses)
      return void fill(
        numbers,
        h(
          "div",
          { class: "problem" },
          h("b", {}, t("No pose: a gate was missed.")),
          p.reasons.map((r) => h("div", {}, r)),
        ),
      );
    const other = goal === "insertion" && poses.notations.find((n) => n.name === notation);
    const [labels, values] = other ? [other.labels, other.numbers] : [poses.labels, poses[goal]];
    const many = labels.length > 7;
    fill(
      numbers,
      h(
        "div",
        { class: "pose found-pose" },
        labels.map((l, i) => {
          const [name, unit] = l.split(" ");
          const f = figure(
            num(values[i], unit === "mm" ? 3 : unit === "m" ? 6 : 4),
            `${name}${unit ? `, ${unit}` : ""}`,
          );
          if (many) f.classList.add("small");
          return f;
        }),
      ),
    );
    for (const b of all(goals, "[data-goal]"))
      b.setAttribute("aria-pressed", String(b.dataset.goal === goal));
  };
  const names = { approach: "Approach", insertion: "Insertion", retract: "Retract" };
  fill(
    goals,
    Object.entries(names).map(([k, w]) =>
      h(
        "button",
        {
          "data-goal": k,
          onclick: () => {
            goal = k;
            draw();
          },
        },
        t(w),
      ),
    ),
    h("span", { class: "grow" }),
    poses &&
      choice(
        t("Notation"),
        poses.notations.map((n) => [n.name, n.name]),
        notation,
        (v) => {
          notation = v;
          goal = "insertion";
          draw();
        },
      ),
  );
  fill(
    place,
    h(
      "div",
      { class: "split" },
      h(
        "div",
        { class: "stack" },
        panel(`${t("Tool")} · ${p.frame}`, goals, h("div", { class: "gap" }), numbers),
        h("section", { class: "panel fill stack" }, picture),
      ),
      h(
        "div",
        { class: "stack" },
        panel(t("Gates"), p.gates.map(gate)),
        panel(
          `${t("Standard deviation")} · ${t("axes of the part")}`,
          ["x", "y", "z"].map((a, i) => sigma(a, p.sigma_mm[i], p.tolerance_mm, "mm")),
          ["x", "y", "z"].map((a, i) => sigma(`r${a}`, p.sigma_deg[i], p.tolerance_deg, "°")),
          h(
            "p",
            { class: "small quiet" },
            `${t("mark: a third of the insertion's tolerance")} ` +
              `(${num(p.tolerance_mm, 3, "mm")}, ${num(p.tolerance_deg, 2, "°")})`,
          ),
        ),
      ),
    ),
    panel(
      t("Where it comes from"),
      table(
        [
          t("Source"),
          "#σ x mm",
          "#σ y mm",
          "#σ z mm",
          "#σ rx °",
          "#σ ry °",
          "#σ rz °",
          t("What it is"),
        ],
        p.terms.map((x) => [
          t(x.name),
          ...[0, 1, 2].map((i) => num(x.sigma_mm?.[i], 4)),
          ...[0, 1, 2].map((i) => num(x.sigma_deg?.[i], 4)),
          h("span", { class: "small quiet" }, x.note),
        ]),
      ),
      !p.complete &&
        h("p", { class: "note small" }, t("A term is not known: the sum is a lower bound.")),
    ),
    p.notes.length > 0 &&
      panel(
        t("Notes"),
        p.notes.map((n) => h("p", { class: "small" }, n)),
      ),
  );
  draw();
}

/** A bar of sigma with a mark at a third of the tolerance: three sigma must stay within it. */
function sigma(name, value, tolerance, unit) {
  const full = tolerance / 2,
    x = Math.min(100, (100 * value) / full),
    mark = (100 * (tolerance / 3)) / full;
  return h(
    "div",
    { class: "axisbar" },
    h("b", {}, name),
    svg(
      "svg",
      { viewBox: "0 0 100 10", preserveAspectRatio: "none", "aria-hidden": "true" },
      svg("rect", {
        x: 0,
        y: 0,
        width: x,
        height: 10,
        fill: value <= tolerance / 3 ? "var(--good)" : "var(--bad)",
      }),
      svg("line", {
        x1: mark,
        x2: mark,
        y1: 0,
        y2: 10,
        stroke: "var(--ink)",
        "vector-effect": "non-scaling-stroke",
        "stroke-width": 2,
      }),
    ),
    h("span", { class: "num" }, num(value, 4, unit)),
  );
}
