// Calibrate: one target from a recording, or everything at once with motions of the robot;
// residual of each picture; the new calibration beside the old one; accept.

import { get, picture, post, url } from "../base/api.js";
import { fill, h, num, svg } from "../base/dom.js";
import { jobs, store } from "../base/store.js";
import { t } from "../base/text.js";
import { operate, operating } from "../widgets/bar.js";
import { byTheRobot } from "../widgets/rig/auto.js";
import { axisGauge } from "../widgets/rig/axisgauge.js";
import { gauges } from "../widgets/rig/boards.js";
import { form, inputs } from "../widgets/form.js";
import { livePicture } from "../widgets/view/live.js";
import { attempt } from "../widgets/problem.js";
import { choice, follow, order, panel, recordings, table } from "../widgets/parts.js";

const TARGETS = {
  auto: "All at once, by the robot",
  joint: "All at once",
  camera: "Camera",
  hand_eye: "Hand-eye",
  laser_plane: "Laser plane",
  pointer: "Pointer",
  axis: "Axis",
};
export async function show(place, query) {
  const all = await recordings("joint");
  const named = store.jobs.get(query.get("job"));
  let target =
      query.get("target") ??
      named?.order.target ??
      { auto: "auto", joint: "joint" }[named?.order.procedure] ??
      "camera",
    name = named?.order.recording,
    out = new Set(named?.order.leave_out ?? []),
    /** Inputs that the form sets. */
    set = {};
  const problem = h("div"),
    progress = h("div"),
    pictures = h("div"),
    verdict = h("div", { class: "stack" }),
    held = h("div", { class: "stack" }),
    stops = h("div"),
    live = h("div"),
    further = h("details"),
    head = h("div", { class: "head" });
  const seen = gauges(held),
    ridden = axisGauge(stops);
  let looks = 0;
  let follows = () => {},
    result = null;
  const body = h("div", { class: "split" });
  let leave = () => {};
  const fits = () => all.filter((r) => r.suits.includes(target));
  const chosen = new Set(named?.order.recordings ?? all.map((r) => r.name));
  const current = () =>
    fits().find((r) => r.name === name) ??
    fits().find((r) => r.name.replace(/[_-]/g, "").includes(target.replace("_", ""))) ??
    fits()[0];
  const heads = () => {
    const r = current();
    name = r?.name;
    fill(
      head,
      h("h1", {}, t("Calibrate")),
      h(
        "div",
        { class: "tools", role: "group", "aria-label": t("Target") },
        Object.entries(TARGETS).map(([k, w]) =>
          h(
            "button",
            {
              "aria-pressed": String(k === target),
              "data-target": k,
              onclick: () => {
                target = k;
                name = undefined;
                out = new Set();
                set = {};
                result = null;
                latest();
              },
            },
            t(w),
          ),
        ),
      ),
      h("span", { class: "grow" }),
      target !== "auto" &&
        target !== "joint" &&
        choice(
          t("Recording"),
          fits().map((x) => [x.name, `${x.name} · ${x.frames}`]),
          name,
          (v) => {
            name = v;
            out = new Set();
            result = null;
            heads();
            thumbs();
          },
        ),
      target !== "auto" &&
        h("button", { class: "main", id: "calibrate", disabled: !r, onclick: run }, t("Calibrate")),
    );
  };
  const run = () =>
    attempt(async () => {
      const j = await order(
        target === "joint"
          ? { procedure: "joint", recordings: [...chosen], ...set }
          : { procedure: "calibrate", target, recording: name, leave_out: [...out], ...set },
      );
      follows();
      follows = follow(progress, j.id, shown);
    }, problem);
  function shown(j) {
    result = j;
    const f = j.outcome,
      keys = Object.keys(f.figures).filter((k) => !/^(n_|seed)/.test(k));
    const accept = () =>
      attempt(async () => {
        if (!operating()) await operate(false);
        shown(await post(`/jobs/${j.id}/accept`));
      }, problem);
    fill(
      verdict,
      panel(
        `${t(TARGETS[j.order.target ?? j.order.procedure])} · ${j.id}`,
        h(
          "p",
          {},
          h("span", {
            class: `dot ${f.verdict === "good" ? "good" : f.verdict === "usable" ? "poor" : "bad"}`,
          }),
          " ",
          h("b", {}, t(f.verdict)),
          f.accepted ? ` · ${t("accepted")}` : "",
        ),
        f.reasons.map((r) => h("p", { class: "small" }, r)),
        f.advice.map((a) => h("p", { class: "note small" }, `${t("Next picture")}: ${a}`)),
        h(
          "button",
          {
            class: "main",
            id: "accept",
            disabled: f.accepted || !["good", "usable"].includes(f.verdict),
            onclick: accept,
          },
          t("Accept into the station"),
        ),
      ),
      panel(
        t("Old against new"),
        table(
          [t("Figure"), `#${t("Station")}`, `#${t("New")}`],
          keys.map((k) => [k, num(f.former[k], 4), num(f.figures[k], 4)]),
        ),
      ),
      f.kind === "joint" &&
        h(
          "p",
          {},
          h(
            "a",
            { href: url(`/jobs/${j.id}/files/result/calibration/joint.html`), target: "_blank" },
            t("The whole report"),
          ),
        ),
      f.left_out.length > 0 &&
        panel(
          t("Not used"),
          f.left_out.map(([n, why]) => h("p", { class: "small" }, h("b", {}, n), `: ${why}`)),
        ),
    );
    thumbs();
  }
  function thumbs() {
    if (target === "auto") return;
    if (target === "joint")
      return void fill(
        pictures,
        h("p", { class: "small quiet" }, t("Recordings that are solved together.")),
        fits().map((x) =>
          h(
            "p",
            {},
            h(
              "label",
              {},
              h("input", {
                type: "checkbox",
                checked: chosen.has(x.name),
                onchange: (e) => (e.target.checked ? chosen.add(x.name) : chosen.delete(x.name)),
              }),
              `${x.name} · ${x.frames} · ${x.beam ?? t("room light")}`,
            ),
          ),
        ),
      );
    const r = current();
    if (!r)
      return void fill(
        pictures,
        h("p", { class: "quiet" }, t("There is no recording of a board for this.")),
      );
    const residual =
      result && result.order.recording === r.name
        ? Object.fromEntries(
            result.outcome.per_picture.map(([n, v]) => [
              Number(/(\d+)(?!.*\d)/.exec(n)?.[1] ?? -1),
              [n, v],
            ]),
          )
        : {};
    const worst = Math.max(...Object.values(residual).map(([, v]) => v), 0);
    fill(
      pictures,
      h("p", { class: "small quiet" }, t("Press a picture to exclude it, then calibrate again.")),
      h(
        "div",
        { class: "thumbs" },
        Array.from({ length: r.frames }, (_, i) => {
          const [, v] = residual[i] ?? [];
          return h(
            "button",
            {
              class: `thumb ${out.has(i) ? "out" : ""}`,
              "aria-pressed": String(out.has(i)),
              "aria-label": `${t("Exclude")} ${i}`,
              onclick: () => {
                out.has(i) ? out.delete(i) : out.add(i);
                thumbs();
              },
            },
            h("img", {
              src: picture(r.name, i, 200, r.beam ? undefined : "ambient"),
              alt: "",
              loading: "lazy",
            }),
            h(
              "span",
              { class: v !== undefined && v === worst ? "poor-ink" : "" },
              v === undefined ? `${i}` : `${i} · ${num(v, 4)}`,
            ),
          );
        }),
      ),
    );
    corners(r);
  }
  /** Loads the corners of each picture in turn, draws them, and adds them to the gauges. */
  async function corners(r) {
    const mine = ++looks;
    seen.clear();
    ridden.clear();
    for (let i = 0; i < r.frames && mine === looks; i++) {
      const v = await get(`/view?recording=${encodeURIComponent(r.name)}&frame=${i}`).catch(
        () => null,
      );
      if (!v || mine !== looks) continue;
      if (!out.has(i)) {
        seen.add(v);
        ridden.add(v);
      }
      pictures.querySelectorAll(".thumb")[i]?.append(
        svg(
          "svg",
          {
            class: "over",
            viewBox: `0 0 ${v.width} ${v.height}`,
            preserveAspectRatio: "xMidYMid slice",
            "data-corners": v.corners.length,
            "aria-hidden": "true",
          },
          v.corners.map(([x, y]) =>
            svg("circle", { cx: x + 0.5, cy: y + 0.5, r: v.width / 110, class: "corner" }),
          ),
        ),
      );
    }
  }
  /** The form of the target's inputs; what the job in the address stated is set. */
  async function options() {
    fill(further);
    if (target === "auto") return;
    const mine = target;
    const word = target.replace(/(^|_)./g, (c) => c.at(-1).toUpperCase());
    const list = await inputs(target === "joint" ? "OrderJoint" : `OrderCalibrate${word}`);
    if (mine !== target) return;
    for (const [input, { default: usual }] of list) {
      const stated = sameTarget(named) ? named.order[input] : undefined;
      if (stated !== undefined && stated !== null && stated !== (usual ?? false))
        set[input] = stated;
    }
    fill(further, h("summary", {}, t("Options")), form(list, set));
  }
  const sameTarget = (j) => (j?.order.target ?? j?.order.procedure) === target;
  const latest = () => {
    fill(verdict);
    attempt(options, problem);
    looks++;
    heads();
    leave();
    leave = () => {};
    if (target === "auto") {
      const moving = h("div", { class: "stack" });
      fill(body, moving, h("div", { class: "stack" }, verdict));
      leave = byTheRobot(moving, (j) => shown(j));
    } else {
      fill(
        body,
        panel(t("Pictures"), pictures),
        h(
          "div",
          { class: "stack" },
          target === "axis"
            ? panel(t("Stops of the axis"), stops)
            : target !== "joint" && panel(t("What the boards cover"), held),
          target !== "joint" && store.bar?.camera && panel(t("Camera"), live),
          verdict,
        ),
      );
      if (target !== "joint" && store.bar?.camera) leave = livePicture(live, undefined, seen.mark);
    }
    const same = (j) =>
      target === "auto" || target === "joint"
        ? j.order.procedure === target
        : j.order.target === target && j.order.recording === name;
    const last = jobs((j) => j.state === "done" && same(j))[0];
    last ? shown(last) : thumbs();
  };
  fill(place, head, further, problem, progress, body);
  latest();
  return () => {
    looks++;
    follows();
    leave();
  };
}
