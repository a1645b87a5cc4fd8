// Position: where the tool goes, how sure that is and why, which gates it met; holding the button confirms it.

import { post, tab } from "../base/api.js";
import { fill, h, num, svg } from "../base/dom.js";
import { jobs, on, store } from "../base/store.js";
import { t } from "../base/text.js";
import { operate, operating } from "../widgets/bar.js";
import { fault } from "../widgets/problem.js";
import { choice, figure, nothing, panel, table } from "../widgets/parts.js";
import { scanMap } from "../widgets/scanmap.js";

/** The button is held so long, ms (src/web/motion.rs asks for 0.8 s). */
const HELD = 1000;

export async function show(place, query) {
  const list = jobs((j) => j.state === "done" && j.order.procedure === "find");
  const job = list.find((j) => j.id === query.get("job")) ?? list[0];
  if (!job) return void fill(place, h("h1", {}, t("Position")), nothing(t("No part was looked for yet."), "part", t("Part")));
  const p = job.outcome, poses = p.poses;
  const picture = h("div", { class: "stack grow" }), numbers = h("div"), goals = h("div", { class: "tools", role: "group", "aria-label": t("Pose") });
  let goal = "approach", notation = poses?.convention;
  const draw = () => {
    if (!poses) return void fill(numbers, h("div", { class: "problem" }, h("b", {}, t("No pose: a gate was missed.")), p.reasons.map((r) => h("div", {}, r))));
    const other = goal === "insertion" && poses.notations.find((n) => n.name === notation);
    const [labels, values] = other ? [other.labels, other.numbers] : [poses.labels, poses[goal]];
    const many = labels.length > 7;
    fill(numbers, h("div", { class: "pose" }, labels.map((l, i) => { const [name, unit] = l.split(" "); const f = figure(num(values[i], unit === "mm" ? 3 : unit === "m" ? 6 : many ? 4 : 4), `${name}${unit ? `, ${unit}` : ""}`); if (many) f.classList.add("small"); return f; })));
    for (const b of goals.querySelectorAll("[data-goal]")) b.setAttribute("aria-pressed", String(b.dataset.goal === goal));
  };
  const words = { approach: "Approach", insertion: "Insertion", retract: "Retract" };
  fill(goals, Object.entries(words).map(([k, w]) => h("button", { "data-goal": k, onclick: () => { goal = k; draw(); reset(); } }, t(w))));
  const limit = p.tolerance_mm, turn = p.tolerance_deg;
  fill(place,
    h("div", { class: "head" }, h("h1", {}, t("Position")), choice(t("Found"), list.map((j) => [j.id, `${j.id} · ${j.order.recipe} · ${j.order.scans.join(" + ")}${j.outcome.passed ? "" : ` · ${t("refused")}`}`]), job.id, (id) => (location.hash = `#/position?job=${id}`)),
      h("span", { class: "grow" }), poses && choice(t("Notation"), poses.notations.map((n) => [n.name, n.name]), notation, (v) => { notation = v; goal = "insertion"; draw(); })),
    h("div", { class: "split" },
      h("div", { class: "stack" },
        panel(`${t("Tool")} · ${p.frame} · ${notation ?? ""}`, goals, h("div", { class: "gap" }), numbers),
        h("section", { class: "panel fill stack" }, picture)),
      h("div", { class: "stack" },
        panel(t("Gates"), p.gates.map(gate)),
        panel(t("Send"), hold(job, () => goal, words)),
        panel(`${t("Standard deviation")} · ${t("axes of the part")}`,
          ["x", "y", "z"].map((a, i) => sigma(a, p.sigma_mm[i], limit, "mm")), ["x", "y", "z"].map((a, i) => sigma(`r${a}`, p.sigma_deg[i], turn, "°")),
          h("p", { class: "small quiet" }, `${t("mark: a third of what the insertion bears")} (${num(limit, 3, "mm")}, ${num(turn, 2, "°")})`)))),
    panel(t("Where it comes from"), table([t("Source"), "#σ x mm", "#σ y mm", "#σ z mm", "#σ rx °", "#σ ry °", "#σ rz °", t("What it is")],
      p.terms.map((x) => [t(x.name), ...[0, 1, 2].map((i) => num(x.sigma_mm?.[i], 4)), ...[0, 1, 2].map((i) => num(x.sigma_deg?.[i], 4)), h("span", { class: "small quiet" }, x.note)])),
      !p.complete && h("p", { class: "note small" }, t("A term is not known: the sum is a lower bound."))),
    p.notes.length > 0 && panel(t("Notes"), p.notes.map((n) => h("p", { class: "small" }, n))));
  draw();
  const view = await scanMap(picture, job.order.scans[0]).catch((e) => void fill(picture, fault(e)));
  view?.marks(p.outline.map((points) => ({ kind: "line", points, colour: p.passed ? "#ffffff" : "#ff5ac8", wide: 1.5 })));
  return () => view?.end();
}

let reset = () => {};

function gate(g) {
  return h("div", { class: "light" }, h("span", { class: `dot ${g.passed ? "good" : "bad"}`, role: "img", "aria-label": t(g.passed ? "kept" : "missed") }),
    h("span", {}, t(g.name)), h("span", { class: "small num" }, h("b", {}, num(g.value, 3)), h("span", { class: "quiet" }, ` / ${num(g.limit, 3)}`)));
}

/** A bar against a third of the tolerance, because three sigma must stay within it. */
function sigma(name, value, tolerance, unit) {
  const full = tolerance / 2, x = Math.min(100, (100 * value) / full), mark = (100 * (tolerance / 3)) / full;
  return h("div", { class: "axisbar" }, h("b", {}, name),
    svg("svg", { viewBox: "0 0 100 10", preserveAspectRatio: "none", "aria-hidden": "true" }, svg("rect", { x: 0, y: 0, width: x, height: 10, fill: value <= tolerance / 3 ? "var(--good)" : "var(--bad)" }), svg("line", { x1: mark, x2: mark, y1: 0, y2: 10, stroke: "var(--ink)", "vector-effect": "non-scaling-stroke", "stroke-width": 2 })),
    h("span", { class: "num" }, num(value, 4, unit)));
}

/** A button that confirms one motion to the pose that is shown, after it was held for a second. */
function hold(job, goal, words) {
  const said = h("div", { role: "status" }), poses = job.outcome.poses;
  const button = h("button", { class: "main hold", id: "send", disabled: !poses }, h("span", {}, t("Hold to send")));
  let timer = 0, pressed = null;
  reset = () => { clearTimeout(timer); pressed = null; button.classList.remove("down"); fill(said); };
  const down = async (e) => {
    if (button.disabled || pressed || (e.type === "keydown" && (e.repeat || ![" ", "Enter"].includes(e.key)))) return;
    e.preventDefault();
    const what = { job: job.id, goal: goal(), hash: poses.hash };
    pressed = what;
    fill(said);
    button.classList.add("down");
    try {
      if (!operating()) await operate(false);
      const { grant } = await post("/motion/press", what);
      if (pressed !== what) return;
      timer = setTimeout(async () => {
        if (pressed !== what) return;
        reset();
        try {
          await post("/motion/go", { grant, what });
          fill(said, h("p", { class: "good-ink" }, `${t(words[what.goal])}: ${t("done")}`));
        } catch (error) { fill(said, fault(error)); }
      }, HELD);
    } catch (error) { reset(); fill(said, fault(error)); }
  };
  const up = () => { if (!pressed) return; reset(); post("/motion/release").catch(() => {}); };
  button.addEventListener("pointerdown", down);
  button.addEventListener("keydown", down);
  for (const kind of ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"]) button.addEventListener(kind, up);
  return h("div", { class: "stack" }, button, said, h("p", { class: "small quiet" }, t("One confirmation moves once, to the pose that is shown. Let go to stop.")));
}
