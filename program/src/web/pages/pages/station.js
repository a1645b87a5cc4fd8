// Station: its settings, the quality of its calibrations, and one list of checks.

import { get } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { done, jobs, on } from "../base/store.js";
import { t } from "../base/text.js";
import { attempt, fault } from "../widgets/problem.js";
import { follow, nothing, order, panel, table } from "../widgets/parts.js";
import { MOUNTS } from "../widgets/settingsform.js";

export async function show(place) {
  const info = await get("/station");
  const progress = h("div"),
    checks = h("div"),
    problem = h("div");
  let follows = () => {};
  const run = () =>
    attempt(async () => {
      const job = await order({ procedure: "check" });
      follows();
      follows = follow(progress, job.id, list);
    }, problem);
  const list = () => {
    const last = done("check")[0];
    fill(
      checks,
      last
        ? last.outcome.lines.map(line)
        : h("p", { class: "quiet" }, t("Nothing was checked yet.")),
    );
  };
  const cut = jobs((j) => j.state === "cut_off");
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, info.name || t("Station")),
      h("span", { class: "quiet" }, info.program),
      h("span", { class: "grow" }),
      h("button", { class: "main", id: "check", onclick: run }, t("Check all")),
    ),
    problem,
    progress,
    info.problem && fault(info.problem),
    cut.length > 0 &&
      panel(
        t("Cut off when the program ended"),
        cut.map((j) =>
          h(
            "div",
            { class: "row" },
            h("b", {}, j.id),
            h(
              "a",
              { href: `#/${j.order.procedure === "scan" ? "scan" : "replay"}?job=${j.id}` },
              t("Resume or delete"),
            ),
          ),
        ),
      ),
    h(
      "div",
      { class: "even" },
      h(
        "div",
        { class: "stack" },
        panel(
          t("Calibrations"),
          info.calibrations.length
            ? table(
                [t("What"), t("Verdict"), `#${t("Age, days")}`, `#${t("Expected error")}`],
                info.calibrations.map((c) => [
                  t(c.words),
                  h(
                    "span",
                    { class: c.verdict === "good" ? "good-ink" : "poor-ink" },
                    t(c.verdict),
                  ),
                  num(c.days, 0),
                  num(c.expected_mm, 4, "mm"),
                ]),
              )
            : nothing(t("This station is not calibrated yet."), "calibrate", t("Calibrate")),
        ),
        panel(
          t("Station"),
          table(
            [t("Setting"), t("Value")],
            [
              [t("Poses are written as"), info.robot ?? "matrix"],
              [t("Camera is mounted"), t(MOUNTS[info.mount] ?? "not stated")],
              [t("Tolerance of the work"), num(info.tolerance_mm, 3, "mm")],
              [t("Scans and poses are in the frame"), t(info.work_frame)],
              ...info.frames.map((f) => [
                `${t(f.name)} ${t("fixed to")} ${t(f.on)}`,
                h(
                  "span",
                  { "data-frame": f.name },
                  f.numbers.map((v, i) => `${f.labels[i]} ${num(v, 3)}`).join("  "),
                ),
              ]),
              !info.frames.some((f) => f.name === "tool") && [
                t("tool"),
                t("not stated: [tool] in Settings"),
              ],
              [
                t("Working volume, camera depth"),
                info.volume_mm
                  ? `${num(info.volume_mm[0], 0)} … ${num(info.volume_mm[1], 0, "mm")}`
                  : t("where the boards of the laser plane stood"),
              ],
            ].filter(Boolean),
          ),
        ),
      ),
      panel(t("Checks"), checks),
    ),
  );
  list();
  const off = on("jobs", list);
  return () => {
    follows();
    off();
  };
}

const MARK = { good: "good", poor: "poor", bad: "bad", absent: "" };

function line(l) {
  return h(
    "div",
    { class: "light" },
    h("span", { class: `dot ${MARK[l.state]}`, role: "img", "aria-label": t(l.state) }),
    h("span", {}, h("b", {}, t(l.name)), " ", h("span", { class: "small quiet" }, l.says)),
    h("span", { class: "small quiet" }, l.group),
  );
}
