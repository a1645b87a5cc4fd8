// Scan: makes a cloud from a recording; its height map grows line by line.

import { fill, h, num, thousands } from "../base/dom.js";
import { jobs, on, store } from "../base/store.js";
import { t } from "../base/text.js";
import { span } from "../widgets/view/colour.js";
import { map } from "../widgets/view/map.js";
import { attempt } from "../widgets/problem.js";
import { sweep } from "../widgets/part/sweep.js";
import {
  choice,
  field,
  follow,
  gallery,
  order,
  panel,
  recordings,
  scanFigures,
} from "../widgets/parts.js";

export async function show(place, query) {
  const list = await recordings("scan");
  const named = query.get("job") && store.jobs.get(query.get("job"));
  let chosen = (named?.order.recording ?? sessionStorage.getItem("recording")) || list[0]?.name;
  let on_ = "auto";
  const problem = h("div"),
    progress = h("div"),
    result = h("div"),
    pick = h("div"),
    live = h("div"),
    way = h("div", { class: "stack" }),
    figures = h("div", { class: "small quiet" });
  const cell = field(
    t("Cell"),
    { type: "number", min: "0.001", step: "0.05", placeholder: t("auto") },
    "mm",
  );
  const view = map(live, t("Height map of the running scan"));
  let follows = () => {};
  const watch = (id) => {
    follows();
    fill(result);
    follows = follow(progress, id, ended);
  };
  const ended = (j) =>
    fill(
      result,
      h(
        "div",
        { class: "panel stack" },
        h("h2", {}, `${j.id} · ${j.order.recording}`),
        scanFigures(j.outcome),
        j.outcome.remarks.map((r) => h("p", { class: "note small" }, r)),
        h(
          "div",
          { class: "row" },
          h("a", { href: `#/surface?job=${j.id}`, id: "to-surface" }, t("Look at the surface")),
          h("a", { href: `#/part?job=${j.id}`, id: "to-part" }, t("Find a part")),
          j.order.procedure === "scan" &&
            h("button", { id: "repeat", onclick: () => repeat(j) }, t("Repeat")),
        ),
      ),
    );
  /** Scans the same recording again with the same settings. */
  const repeat = (j) =>
    attempt(async () => {
      const again = await order(j.order);
      sessionStorage.setItem("scan", again.id);
      watch(again.id);
    }, problem);
  const start = () =>
    attempt(async () => {
      const mm = Number(cell.querySelector("input").value);
      const job = await order({
        procedure: "scan",
        recording: chosen,
        on: on_,
        ...(mm > 0 ? { cell_mm: mm } : {}),
      });
      sessionStorage.setItem("scan", job.id);
      watch(job.id);
    }, problem);
  const choose = (r) => {
    chosen = r.name;
    sessionStorage.setItem("recording", chosen);
    fill(pick, gallery(list, chosen, choose));
  };
  fill(
    pick,
    list.length
      ? gallery(list, chosen, choose)
      : h(
          "p",
          { class: "quiet" },
          t("The folder of recordings contains no recording of the laser line."),
        ),
  );
  place.classList.add("fit");
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Scan")),
      h("span", { class: "grow" }),
      cell,
      choice(
        t("On"),
        [
          ["auto", t("auto")],
          ["gpu", "GPU"],
          ["cpu", "CPU"],
        ],
        on_,
        (v) => (on_ = v),
      ),
      h(
        "button",
        { class: "main", id: "start", disabled: !list.length, onclick: start },
        t("Start"),
      ),
    ),
    problem,
    progress,
    h(
      "div",
      { class: "split" },
      h(
        "section",
        { class: "panel fill" },
        h("h2", {}, t("Height map, line by line")),
        live,
        figures,
      ),
      h(
        "div",
        { class: "stack" },
        panel(t("Recording"), pick),
        panel(t("Path over the part"), way),
      ),
    ),
    result,
  );
  const rows = () => {
    const g = store.growing;
    if (!g) return;
    const seen = g.heights.subarray(0, g.columns * g.done);
    view.show({ width: g.columns, height: g.total, cell_mm: 1, bare: true }, g.heights, {
      range: span(seen),
      digits: 1,
      reads: (p) => `${t("shot")} ${Math.floor(p[1])}`,
    });
    const b = store.bar?.frames;
    if (b)
      fill(
        figures,
        `${thousands(g.done)} / ${thousands(g.total)} ${t("rows")} · ${b.measured} ${t("measured")} · ${
          Object.entries(b.dropped)
            .map(([k, n]) => `${k}: ${n}`)
            .join(", ") || t("nothing dropped")
        }`,
      );
  };
  rows();
  const off = on("rows", rows);
  const plan = await sweep(way);
  const current = named ?? jobs((j) => j.order.procedure === "scan")[0];
  if (current) watch(current.id);
  return () => {
    off();
    follows();
    plan?.();
    view.end();
  };
}
