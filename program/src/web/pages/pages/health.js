// Health: where a scan's time went, what this machine can do at full and at half resolution, a
// support file.

import { url } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { done, on, store } from "../base/store.js";
import { t } from "../base/text.js";
import { attempt } from "../widgets/problem.js";
import { bars } from "../widgets/view/plot.js";
import { field, figures, follow, nothing, order, panel, table } from "../widgets/parts.js";

const WORDS = {
  start_s: "start",
  first_profile_s: "first profile",
  pictures_s: "waiting for pictures",
  stages_s: "waiting for stages",
  writing_s: "writing",
  products_s: "height map and pictures",
};

export async function show(place, query) {
  const problem = h("div"),
    progress = h("div"),
    bench = h("div"),
    time = h("div"),
    counters = h("div");
  const support = h(
    "a",
    { href: url("/support"), id: "support", download: "sheetlight-support.json" },
    t("Support file"),
  );
  let rate = 30;
  let follows = () => {};
  const run = () =>
    attempt(async () => {
      const j = await order({ procedure: "benchmark", rate_hz: rate });
      follows();
      follows = follow(progress, j.id, draw);
    }, problem);
  const scan = done("scan").find((j) => j.id === query.get("job")) ?? done("scan")[0];
  fill(
    time,
    scan
      ? [
          h("p", { class: "small quiet" }, `${scan.id} · ${scan.outcome.ran_on}`),
          bars(
            Object.entries(scan.outcome.spent).map(([k, v]) => [t(WORDS[k] ?? k), v]),
            "s",
            2,
          ),
          figures(
            [num(scan.outcome.shots_per_second, 0), t("shots a second")],
            [num(1000 / scan.outcome.shots_per_second, 2, "ms"), t("a shot")],
            [num(scan.outcome.seconds, 1, "s"), t("in all")],
          ),
        ]
      : nothing(t("Nothing was scanned yet."), "scan", t("Scan")),
  );
  const draw = () => {
    const last = done("benchmark")[0];
    if (!last)
      return void fill(
        bench,
        h(
          "p",
          { class: "quiet" },
          t(
            "The benchmark measures the whole chain, every pixel, on this machine's processor and its GPU.",
          ),
        ),
      );
    const fits = (ms) => `${num(1000 / ms, 0)} ${t("pictures a second")}`,
      { rows } = last.outcome,
      mine = new Set(rows.map((r) => r.on));
    // Pictures that a camera of this frame rate sends faster than they can be measured are
    // skipped and counted.
    const drops = (ms) => {
      const share = Math.max(0, 1 - 1000 / ms / rate);
      return h("span", { class: share ? "bad-ink" : "good-ink" }, `${num(100 * share, 0)} %`);
    };
    const all = [...rows, ...(last.outcome.recorded ?? [])].sort(
      (a, b) => a.width - b.width || a.ms_per_shot - b.ms_per_shot,
    );
    const kept = last.outcome.kept_up ?? [],
      share = (k, n) =>
        h(
          "span",
          { class: n ? "bad-ink" : "good-ink" },
          `${n} (${num((100 * n) / Math.max(1, k.sent), 1)} %)`,
        );
    fill(
      bench,
      kept.length > 0 && [
        h(
          "h3",
          {},
          `${t("Measured on this machine with a camera of")} ${kept[0].rate_hz} ${t("pictures a second")}`,
        ),
        h(
          "div",
          { "data-kept": String(kept.length) },
          table(
            [
              t("On"),
              `#${t("Picture")}`,
              `#${t("sent")}`,
              `#${t("measured")}`,
              `#${t("skipped")}`,
              `#${t("lost")}`,
              "#ms p50 / p99",
            ],
            kept.map((k) => [
              k.on,
              `${k.width}×${k.height}`,
              String(k.sent),
              String(k.measured),
              share(k, k.passed_over),
              share(k, k.lost),
              `${num(k.ms[0], 1)} / ${num(k.ms[1], 1)}`,
            ]),
          ),
        ),
      ],
      h(
        "h3",
        {},
        `${t("Estimated from the time per shot, for a camera of")} ${rate} ${t("pictures a second")}`,
      ),
      table(
        [
          t("On"),
          `#${t("Picture")}`,
          `#${t("ms a shot")}`,
          `#${t("keeps up with")}`,
          `#${t("dropped")}`,
        ],
        all.map((r) => [
          mine.has(r.on) ? h("b", {}, `${r.on} · ${t("here")}`) : r.on,
          `${r.width}×${r.height}`,
          num(r.ms_per_shot, 2),
          fits(r.ms_per_shot),
          drops(r.ms_per_shot),
        ]),
      ),
      h(
        "p",
        { class: "small quiet" },
        t(
          "1280×960 has four times the pixels of 640×480. Other machines were measured earlier, with one clean stripe.",
        ),
      ),
    );
  };
  const count = () => {
    const b = store.bar;
    if (!b) return;
    fill(
      counters,
      figures(
        [String(b.frames.seen), t("frames in")],
        [String(b.frames.measured), t("measured")],
        ...Object.entries(b.frames.dropped).map(([k, n]) => [String(n), k, "poor-ink"]),
        [String(b.viewers), t("browsers look on")],
        store.motion?.silence_ms != null && [
          num(store.motion.silence_ms, 0, "ms"),
          t("longest gap between messages of the held button, limit 1 s"),
        ],
        b.memory_mb && [
          `${num(b.memory_mb[0], 0)} / ${num(b.memory_mb[1], 0, "MB")}`,
          t("memory, now and at most"),
        ],
        [num(b.disk_left_gb, 1, "GB"), t("disk left")],
      ),
    );
  };
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Health")),
      h("span", { class: "grow" }),
      h(
        "label",
        {},
        h("input", {
          type: "checkbox",
          id: "support-pictures",
          onchange: (e) => {
            support.href = url(e.target.checked ? "/support?pictures=true" : "/support");
          },
        }),
        t("with pictures"),
      ),
      support,
      field(
        t("A camera of"),
        {
          type: "number",
          min: "1",
          step: "1",
          value: String(rate),
          id: "rate",
          class: "short",
          onchange: (e) => {
            rate = Math.max(1, Number(e.target.value) || 30);
            draw();
          },
        },
        t("pictures a second"),
      ),
      h("button", { class: "main", id: "benchmark", onclick: run }, t("Benchmark")),
    ),
    problem,
    progress,
    h(
      "div",
      { class: "even" },
      panel(t("Time of the last scan"), time),
      h("div", { class: "stack" }, panel(t("This machine"), bench), panel(t("Counters"), counters)),
    ),
  );
  draw();
  count();
  const off = on("bar", count);
  return () => {
    off();
    follows();
  };
}
