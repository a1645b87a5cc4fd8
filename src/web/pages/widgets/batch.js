// In: recordings, a recipe, settings. Out: each of them scanned and searched, one job after the other; how far the places that were found lie
// apart, beside what each said of itself.

import { get } from "../base/api.js";
import { fill, h, num, svg } from "../base/dom.js";
import { done, on } from "../base/store.js";
import { t } from "../base/text.js";
import { choice, order, recordings, table } from "./parts.js";
import { attempt } from "./problem.js";

/** Pairs of jobs that the server lets wait. */
const MOST = 15;

/** Fills `place`; `settings()` are those that differ from the station's. Returns what ends it. */
export async function batch(place, settings, problem) {
  const [list, recipes] = [await recordings((r) => r.beam !== "pointer" && !r.board), await get("/recipes")];
  const chosen = new Set(list.slice(0, MOST).map((r) => r.name));
  let recipe = sessionStorage.getItem("recipe") ?? recipes[0]?.name ?? "";
  const shown = h("div", { class: "stack" });
  const run = () => attempt(async () => {
    for (const name of [...chosen].slice(0, MOST)) {
      const scan = await order({ procedure: "scan", recording: name, settings: { ...settings() } });
      if (recipe) await order({ procedure: "find", scans: [scan.id], recipe });
    }
  }, problem);
  const draw = () => fill(shown, spread(done("find").filter((j) => j.outcome.recipe === recipe && !j.order.pins)));
  fill(place, h("div", { class: "row" }, choice(t("Recipe"), [["", t("none: scan only")], ...recipes.map((r) => [r.name, r.name])], recipe, (v) => { recipe = v; draw(); }),
    h("button", { class: "main", id: "run-batch", disabled: !list.length, onclick: run }, t("Run batch"))),
    h("div", { class: "row" }, list.map((r) => h("label", {}, h("input", { type: "checkbox", checked: chosen.has(r.name), onchange: (e) => (e.target.checked ? chosen.add(r.name) : chosen.delete(r.name)) }), r.name))),
    shown);
  draw();
  return on("jobs", draw);
}

/** Deviations of places from their median along x, y, z, mm, and of turns about z, degrees. */
export function deviations(jobs) {
  const poses = jobs.map((j) => j.outcome.part);
  const median = (v) => { const s = [...v].sort((a, b) => a - b), k = s.length >> 1; return s.length % 2 ? s[k] : (s[k - 1] + s[k]) / 2; };
  const along = [3, 7, 11].map((k) => poses.map((p) => p[k])).map((v) => { const m = median(v); return v.map((x) => x - m); });
  // Turns against the first one, so that none is cut in two at half a turn.
  const first = poses[0], turn = poses.map((p) => { const dot = (i, j) => first[i] * p[j] + first[4 + i] * p[4 + j] + first[8 + i] * p[8 + j]; return (Math.atan2(dot(1, 0), dot(0, 0)) * 180) / Math.PI; });
  const m = median(turn);
  return [...along, turn.map((x) => x - m)];
}

function spread(jobs) {
  if (jobs.length < 2) return h("p", { class: "small quiet" }, t("Two or more places of one recipe show how well they repeat."));
  const values = deviations(jobs), stated = (k) => Math.sqrt(jobs.reduce((a, j) => a + (k < 3 ? Math.max(...j.outcome.sigma_mm.slice(0, 2), k === 2 ? j.outcome.sigma_mm[2] : 0) : j.outcome.sigma_deg[2]) ** 2, 0) / jobs.length);
  const scatter = (v) => { const mean = v.reduce((a, x) => a + x, 0) / v.length; return Math.sqrt(v.reduce((a, x) => a + (x - mean) ** 2, 0) / (v.length - 1)); };
  const names = ["x", "y", "z", t("Turn")], unit = (k) => (k < 3 ? "mm" : "°");
  return h("div", { class: "stack", "data-repeats": String(jobs.length) },
    h("div", { class: "even" }, values.map((v, k) => histogram(v, `${names[k]}, ${unit(k)}`))),
    table([t("Along"), `#${t("repeats")}`, `#${t("scatter, 1 σ")}`, `#${t("stated, 1 σ")}`, `#${t("apart at most")}`],
      values.map((v, k) => [names[k], String(v.length), num(scatter(v), 4, unit(k)), num(stated(k), 4, unit(k)), num(Math.max(...v) - Math.min(...v), 4, unit(k))])),
    h("p", { class: "small quiet" }, t("In the scan's frame, against the median; only where the part stood still between the recordings.")));
}

function histogram(values, name) {
  const bins = 15, most = Math.max(...values.map(Math.abs), 1e-6), counts = new Array(bins).fill(0);
  for (const v of values) counts[Math.min(bins - 1, Math.floor(((v / most + 1) / 2) * bins))]++;
  const high = Math.max(...counts);
  return h("figure", { class: "histogram" }, svg("svg", { class: "plot", viewBox: `0 0 ${bins} 100`, preserveAspectRatio: "none", role: "img", "aria-label": `${t("Histogram of repeats")}: ${name}` }, counts.map((n, i) => svg("rect", { class: "bar", x: i + 0.04, width: 0.92, y: 100 - (95 * n) / high, height: (95 * n) / high }))),
    h("figcaption", { class: "small quiet" }, `${name}: ±${num(most, 4)}`));
}
