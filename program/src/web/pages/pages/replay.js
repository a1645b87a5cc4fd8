// Replay: all jobs; two scans side by side with their difference; the same recording scanned
// again with other settings; a table as CSV.

import { bytes, get, post, remove } from "../base/api.js";
import { fill, h, num, thousands } from "../base/dom.js";
import { jobs, on, scans as finished } from "../base/store.js";
import { t } from "../base/text.js";
import { batch } from "../widgets/part/batch.js";
import { operate, operating, pageOf } from "../widgets/bar.js";
import { span } from "../widgets/view/colour.js";
import { map } from "../widgets/view/map.js";
import { attempt, fault } from "../widgets/problem.js";
import { choice, field, follow, order, panel } from "../widgets/parts.js";

export async function show(place) {
  const info = await get("/station");
  const problem = h("div"),
    progress = h("div"),
    list = h("div"),
    compared = h("div", { class: "stack" }),
    set = h("div", { class: "stack" }),
    repeats = h("div", { class: "stack" });
  const ends = [];
  let follows = () => {};
  const changes = {};

  const rows = () => {
    const all = jobs();
    const act = (j, what) =>
      attempt(async () => {
        if (!operating()) await operate(false);
        what === "remove" ? await remove(`/jobs/${j.id}`) : await post(`/jobs/${j.id}/${what}`);
      }, problem);
    fill(
      list,
      h(
        "div",
        { class: "scroll" },
        h(
          "table",
          {},
          h(
            "thead",
            {},
            h(
              "tr",
              {},
              ["Job", "From", "State", "Result", "s", ""].map((x) =>
                h("th", { scope: "col" }, t(x)),
              ),
            ),
          ),
          h(
            "tbody",
            {},
            all.slice(0, 60).map((j) =>
              h(
                "tr",
                {},
                h("td", {}, h("a", { href: `#/${pageOf(j)}?job=${j.id}` }, j.id)),
                h("td", {}, source(j)),
                h(
                  "td",
                  {
                    class:
                      { done: "good-ink", failed: "bad-ink", cut_off: "poor-ink" }[j.state] ?? "",
                  },
                  t(j.state),
                ),
                h("td", {}, result(j)),
                h("td", { class: "num" }, num(j.seconds, 1)),
                h(
                  "td",
                  {},
                  h(
                    "div",
                    { class: "tools" },
                    ["cut_off", "stopped"].includes(j.state) &&
                      h("button", { class: "plain", onclick: () => act(j, "resume") }, t("Resume")),
                    !["running", "queued"].includes(j.state) &&
                      h(
                        "button",
                        {
                          class: "plain",
                          "aria-label": `${t("Delete")} ${j.id}`,
                          onclick: () => act(j, "remove"),
                        },
                        "×",
                      ),
                  ),
                ),
              ),
            ),
          ),
        ),
      ),
    );
  };

  const settings = Object.entries(info.extraction);
  const setting = () => {
    const key = choice(
      t("Setting"),
      settings.map(([k]) => [k, k]),
      "threshold.minimum",
      (k) => (value.querySelector("input").value = JSON.stringify(info.extraction[k])),
    );
    const value = field(t("Value"), {
      type: "text",
      size: "10",
      value: JSON.stringify(info.extraction["threshold.minimum"]),
    });
    const add = () =>
      attempt(() => {
        changes[key.querySelector("select").value] = JSON.parse(value.querySelector("input").value);
        setting();
      }, problem);
    fill(
      set,
      h("div", { class: "row" }, key, value, h("button", { onclick: add }, t("Add"))),
      h(
        "div",
        { class: "row" },
        Object.entries(changes).map(([k, v]) =>
          h(
            "button",
            {
              class: "plain",
              "aria-label": `${t("Undo")} ${k}`,
              onclick: () => {
                delete changes[k];
                setting();
              },
            },
            `${k} = ${JSON.stringify(v)} ×`,
          ),
        ),
      ),
    );
  };
  setting();
  const scans = finished();
  let [a, b] = [scans[1]?.id ?? scans[0]?.id, scans[0]?.id];
  const again = () =>
    attempt(async () => {
      let from = jobs((j) => j.id === b)[0];
      // A filtered scan was made from a scan of a recording.
      while (from?.order.procedure === "filter") from = jobs((j) => j.id === from.order.scan)[0];
      const job = await order({ ...from.order, settings: { ...from.order.settings, ...changes } });
      follows();
      follows = follow(progress, job.id, () => {
        const now = jobs((j) => j.id === job.id)[0];
        a = from.id;
        b = now.id;
        chooser();
        compare();
      });
    }, problem);
  const pickers = h("div", { class: "row" });
  const chooser = () => {
    const list = finished().map((j) => [
      j.id,
      `${j.id} · ${source(j)}${
        Object.keys(j.order.settings ?? {}).length
          ? ` · ${Object.entries(j.order.settings)
              .map(([k, v]) => `${k}=${v}`)
              .join(", ")}`
          : ""
      }`,
    ]);
    fill(
      pickers,
      choice("A", list, a, (v) => (a = v)),
      choice("B", list, b, (v) => (b = v)),
      h("button", { id: "compare", onclick: compare }, t("Compare")),
    );
  };

  async function compare() {
    ends.splice(0).forEach((end) => end());
    await attempt(async () => {
      const read = async (id) => ({
        head: await get(`/scans/${id}/map`),
        z: new Float32Array(await bytes(`/scans/${id}/map/height`)),
      });
      const [one, two] = [await read(a), await read(b)];
      const d = difference(one, two);
      const spots = [h("div"), h("div"), h("div")];
      fill(
        compared,
        h(
          "div",
          { class: "thirds" },
          ["A", "B", "B − A"].map((n, i) =>
            h(
              "section",
              { class: "panel fill" },
              h("h2", {}, [n, i < 2 ? ` · ${[a, b][i]}` : ""]),
              spots[i],
            ),
          ),
        ),
        h(
          "p",
          {},
          d.n
            ? `${thousands(d.n)} ${t("cells in both")}: ` +
                `${t("median")} ${num(1000 * d.median, 1, "µm")}, ` +
                `${t("68 % within")} ${num(1000 * d.within, 1, "µm")}; ` +
                `${t("only in A")} ${thousands(d.onlyA)}, ` +
                `${t("only in B")} ${thousands(d.onlyB)}`
            : t("The two scans have no place in common."),
        ),
      );
      const views = spots.map((s, i) => map(s, ["A", "B", "B − A"][i]));
      views[0].show(one.head, one.z, { range: one.head.z_mm, shaded: true });
      views[1].show(two.head, two.z, { range: one.head.z_mm, shaded: true });
      const most = Math.max(...span(d.z, 0.01).map(Math.abs), 1e-4);
      views[2].show(one.head, d.z, { range: [-most, most], digits: 3, colours: "diverging" });
      ends.push(...views.map((v) => v.end));
    }, problem);
  }

  const csv = () => {
    const cells = (j) => [
      j.id,
      j.order.procedure,
      source(j),
      j.state,
      j.seconds.toFixed(3),
      ...(["scan", "filter"].includes(j.order.procedure) && j.outcome
        ? [j.outcome.points, j.outcome.median_sigma_mm, j.outcome.coverage]
        : ["", "", ""]),
      ...(j.order.procedure === "find" && j.outcome
        ? [
            j.outcome.passed,
            j.outcome.score,
            ...j.outcome.sigma_mm,
            ...(j.outcome.poses?.insertion ?? []),
          ]
        : []),
    ];
    const quote = (v) => {
      const s = String(v ?? "");
      return /[",\n]/.test(s) || (/^[=+@-]/.test(s) && Number.isNaN(Number(s)))
        ? `"${s.replaceAll('"', '""')}"`
        : s;
    };
    const text = [
      [
        "job",
        "procedure",
        "from",
        "state",
        "seconds",
        "points",
        "median_sigma_mm",
        "coverage",
        "passed",
        "score",
        "sigma_x_mm",
        "sigma_y_mm",
        "sigma_z_mm",
        "pose",
      ],
      ...jobs().map(cells),
    ]
      .map((r) => r.map(quote).join(","))
      .join("\r\n");
    const link = h("a", {
      href: URL.createObjectURL(new Blob([text], { type: "text/csv" })),
      download: "jobs.csv",
    });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Replay")),
      h("span", { class: "grow" }),
      h("button", { onclick: csv }, "CSV"),
      h(
        "button",
        { class: "main", id: "again", disabled: !scans.length, onclick: again },
        t("Scan B again"),
      ),
    ),
    problem,
    progress,
    scans.length > 0 &&
      h(
        "div",
        { class: "even" },
        panel(t("Compare"), pickers),
        panel(t("Other settings for the next run"), set),
      ),
    compared,
    panel(t("Batch and repeats"), repeats),
    panel(t("Jobs"), list),
  );
  rows();
  chooser();
  if (scans.length > 1) compare();
  const off = on("jobs", rows),
    stop = await batch(repeats, () => changes, problem);
  return () => {
    off();
    stop();
    follows();
    ends.forEach((end) => end());
  };
}

const source = (j) => j.order.recording ?? j.order.scans?.join(" + ") ?? j.order.scan ?? "";

function result(j) {
  const o = j.outcome;
  if (!o) return j.problem?.what ?? "";
  if (["scan", "filter"].includes(j.order.procedure))
    return `${thousands(o.points)} ${t("points")}, σ ${num(o.median_sigma_mm, 4, "mm")}`;
  if (j.order.procedure === "find")
    return `${o.recipe}: ${t(o.passed ? "found" : "refused")}, ${t("score")} ${num(o.score, 3)}`;
  return o.verdict ? t(o.verdict) : (o.recipe ?? "");
}

/** B minus A in the cells of A: B's height in the cell that contains A's point in the base frame. */
function difference(one, two) {
  const { width, height, cell_mm, base_from_grid: A } = one.head,
    B = two.head.base_from_grid,
    z = new Float32Array(width * height).fill(NaN);
  const all = [];
  let onlyA = 0,
    met = 0,
    countB = 0;
  for (const v of two.z) if (v === v) countB++;
  for (let j = 0; j < height; j++)
    for (let i = 0; i < width; i++) {
      const v = one.z[j * width + i];
      if (v !== v) continue;
      const p = [(i + 0.5) * cell_mm, (j + 0.5) * cell_mm, v];
      const w = [0, 1, 2].map(
        (r) =>
          A[4 * r] * p[0] + A[4 * r + 1] * p[1] + A[4 * r + 2] * p[2] + A[4 * r + 3] - B[4 * r + 3],
      );
      const q = [0, 1, 2].map((c) => B[c] * w[0] + B[4 + c] * w[1] + B[8 + c] * w[2]);
      const [x, y] = [Math.floor(q[0] / two.head.cell_mm), Math.floor(q[1] / two.head.cell_mm)];
      const other =
        x >= 0 && y >= 0 && x < two.head.width && y < two.head.height
          ? two.z[y * two.head.width + x]
          : NaN;
      if (other !== other) {
        onlyA++;
        continue;
      }
      met++;
      all.push((z[j * width + i] = other - q[2]));
    }
  all.sort((a, b) => a - b);
  const median = all[all.length >> 1] ?? NaN,
    off = all.map((v) => Math.abs(v - median)).sort((a, b) => a - b);
  return {
    z,
    n: all.length,
    median,
    within: off[Math.floor(0.683 * off.length)] ?? NaN,
    onlyA,
    onlyB: Math.max(0, countB - met),
  };
}
