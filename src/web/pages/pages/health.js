// Health: where a scan's time went, what this machine can do at full and at half resolution, a file for somebody who helps.

import { url } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { done, on, store } from "../base/store.js";
import { t } from "../base/text.js";
import { attempt } from "../widgets/problem.js";
import { bars } from "../widgets/plot.js";
import { figures, follow, nothing, order, panel, table } from "../widgets/parts.js";

const WORDS = { start_s: "start", first_profile_s: "first profile", pictures_s: "waiting for pictures", stages_s: "waiting for stages", writing_s: "writing", products_s: "height map and pictures" };

export async function show(place, query) {
  const problem = h("div"), progress = h("div"), bench = h("div"), time = h("div"), counters = h("div");
  let follows = () => {};
  const run = () => attempt(async () => { const j = await order({ procedure: "benchmark" }); follows(); follows = follow(progress, j.id, draw); }, problem);
  const scan = done("scan").find((j) => j.id === query.get("job")) ?? done("scan")[0];
  fill(time, scan ? [h("p", { class: "small quiet" }, `${scan.id} · ${scan.outcome.ran_on}`), bars(Object.entries(scan.outcome.spent).map(([k, v]) => [t(WORDS[k] ?? k), v]), "s", 2),
    figures([num(scan.outcome.shots_per_second, 0), t("shots a second")], [num(1000 / scan.outcome.shots_per_second, 2, "ms"), t("a shot")], [num(scan.outcome.seconds, 1, "s"), t("in all")])] : nothing(t("Nothing was scanned yet."), "scan", t("Scan")));
  const draw = () => {
    const last = done("benchmark")[0];
    if (!last) return void fill(bench, h("p", { class: "quiet" }, t("The benchmark measures the whole chain, every pixel looked at, on this machine's processor and on its GPU.")));
    const rows = last.outcome.rows, at = (w) => Math.min(...rows.filter((r) => r.width === w).map((r) => r.ms_per_shot));
    const widths = [...new Set(rows.map((r) => r.width))].sort((a, b) => a - b), fits = (ms) => `${num(1000 / ms, 0)} ${t("pictures a second")}`;
    fill(bench, table([t("On"), `#${t("Picture")}`, `#${t("ms a shot")}`, `#${t("keeps up with")}`], rows.map((r) => [r.on, `${r.width}×${r.height}`, num(r.ms_per_shot, 2), fits(r.ms_per_shot)])),
      widths.length > 1 && h("p", { class: "small quiet" }, `${t("The fastest way:")} ${widths.map((w) => `${w} px ${num(at(w), 2, "ms")}`).join(", ")}`));
  };
  const count = () => {
    const b = store.bar;
    if (!b) return;
    fill(counters, figures([String(b.frames.seen), t("frames in")], [String(b.frames.measured), t("measured")], ...Object.entries(b.frames.dropped).map(([k, n]) => [String(n), k, "poor-ink"]), [String(b.viewers), t("browsers look on")], store.motion?.silence_ms != null && [num(store.motion.silence_ms, 0, "ms"), t("held button: longest silence, of 1 s")], [num(b.disk_left_gb, 1, "GB"), t("disk left")]));
  };
  fill(place, h("div", { class: "head" }, h("h1", {}, t("Health")), h("span", { class: "grow" }), h("a", { href: url("/support"), download: "sheetlight-support.json" }, t("Support file (no pictures)")), h("button", { class: "main", id: "benchmark", onclick: run }, t("Benchmark"))),
    problem, progress, h("div", { class: "even" }, panel(t("Time of the last scan"), time), h("div", { class: "stack" }, panel(t("This machine"), bench), panel(t("Counters"), counters))));
  draw();
  count();
  const off = on("bar", count);
  return () => { off(); follows(); };
}
