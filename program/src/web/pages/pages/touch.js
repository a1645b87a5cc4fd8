// Touch: the pointer's spots on a surface: distances, the plane, its normal with sigma, the
// tool's tilt relative to it and a square pose.

import { fill, h, num, withSigma } from "../base/dom.js";
import { done, store } from "../base/store.js";
import { t } from "../base/text.js";
import { attempt } from "../widgets/problem.js";
import { figures, follow, gallery, order, panel, recordings, table } from "../widgets/parts.js";

export async function show(place, query) {
  const list = await recordings("touch");
  let chosen =
    store.jobs.get(query.get("job"))?.order.recording ??
    (list.find((r) => /surface|touch/.test(r.name)) ?? list[0])?.name;
  const problem = h("div"),
    progress = h("div"),
    result = h("div", { class: "stack" }),
    pick = h("div");
  let follows = () => {};
  const run = () =>
    attempt(async () => {
      const j = await order({ procedure: "touch", recording: chosen });
      follows();
      follows = follow(progress, j.id, shown);
    }, problem);
  const choose = (r) => {
    chosen = r.name;
    fill(pick, gallery(list, chosen, choose));
  };
  fill(
    pick,
    list.length
      ? gallery(list, chosen, choose)
      : h("p", { class: "quiet" }, t("There is no recording of the pointer on a surface.")),
  );
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Touch")),
      h("span", { class: "grow" }),
      h(
        "button",
        { class: "main", id: "touch", disabled: !list.length, onclick: run },
        t("Compute the perpendicular pose"),
      ),
    ),
    problem,
    progress,
    h("div", { class: "split" }, result, panel(t("Recording of the pointer"), pick)),
  );
  function shown(j) {
    const o = j.outcome,
      s = o.surface;
    fill(
      result,
      s && square(o.square),
      panel(
        `${t("Surface")} · ${j.order.recording}`,
        s
          ? figures(
              [withSigma(s.tilt_deg, s.tilt_sigma_deg[0], "°"), t("tilt against the base's z")],
              [s.normal.map((v) => num(v, 5)).join("  "), t("normal, towards the camera")],
              [num(s.rms_mm, 4, "mm"), t("spots off the plane, rms")],
              [s.centre_mm.map((v) => num(v, 2)).join("  "), t("middle of the spots, mm")],
            )
          : h("p", {}, t("The spots make no plane.")),
        s?.left_out &&
          h(
            "p",
            { class: "note small" },
            `${s.left_out} ${t("does not lie on the plane of the others and was excluded")}`,
          ),
      ),
      panel(
        t("Spots"),
        table(
          [t("Picture"), `#${t("Distance along the camera's axis, mm")}`, "#σ mm"],
          o.spots.map(([n, d, e]) => [n, num(d, 3), num(e, 4)]),
        ),
        o.missing.map(([n, why]) => h("p", { class: "note small" }, `${n}: ${why}`)),
        o.remarks.map((r) => h("p", { class: "note small" }, r)),
      ),
    );
  }
  /** Shows the square pose in the notation of the robot, for entry at its pendant. */
  function square(q) {
    if (!q)
      return panel(
        t("Perpendicular pose"),
        h(
          "p",
          { class: "note small" },
          t(
            "The station has no [tool]: tilt and perpendicular pose are unknown. Add it on the page Settings.",
          ),
        ),
      );
    const row = (name, numbers, tag) =>
      h(
        "div",
        { class: "stack", "data-square": tag },
        h("h3", { class: "small" }, name),
        figures(...numbers.map((v, i) => [num(v, 3), q.labels[i]])),
      );
    const off = q.tilt_deg > 3 * q.tilt_sigma_deg;
    return panel(
      t("Perpendicular pose"),
      figures([
        withSigma(q.tilt_deg, q.tilt_sigma_deg, "°"),
        t("the tool leans"),
        off ? "poor-ink" : "good-ink",
      ]),
      h(
        "p",
        { class: "small quiet" },
        t(
          off
            ? "This motion only turns the tool about its tip. This page moves nothing."
            : "The tool is perpendicular to the surface within 3 sigma.",
        ),
      ),
      row(`${t("Flange goes to")} · ${q.convention}`, q.flange, "flange"),
      row(`${t("Tool is at")} · ${q.convention}`, q.tool, "tool"),
    );
  }
  const last = store.jobs.get(query.get("job")) ?? done("touch")[0];
  if (last?.state === "done") shown(last);
  else
    fill(
      result,
      h(
        "p",
        { class: "quiet" },
        t(
          "The pointer's spot on three or more places gives the plane to which the tool becomes perpendicular.",
        ),
      ),
    );
  return () => follows();
}
