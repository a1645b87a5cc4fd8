// In: values. Out: elements that several pages use: figures, tables, choices of recordings, scans
// and recipes, a job's progress.

import { get, picture, post } from "../base/api.js";
import { fill, h, num, thousands } from "../base/dom.js";
import { on, scans, store } from "../base/store.js";
import { t } from "../base/text.js";
import { operate, operating } from "./bar.js";
import { fault } from "./problem.js";

export const figure = (value, name, mark = "") =>
  h(
    "div",
    { class: "figure" },
    h("b", { class: mark, title: String(value) }, value),
    h("span", {}, name),
  );
export const figures = (...list) =>
  h(
    "div",
    { class: "figures" },
    list.filter(Boolean).map(([v, n, m]) => figure(v, n, m)),
  );
export const panel = (name, ...children) =>
  h("section", { class: "panel" }, name && h("h2", {}, name), children);

/** A table; a head that begins with # marks a column of numbers. */
export function table(heads, rows) {
  const numeric = heads.map((x) => x.startsWith("#"));
  return h(
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
          heads.map((x, i) =>
            h("th", { scope: "col", class: numeric[i] ? "num" : null }, x.replace(/^#/, "")),
          ),
        ),
      ),
      h(
        "tbody",
        {},
        rows.map((r) =>
          h(
            "tr",
            {},
            r.map((c, i) => h("td", { class: numeric[i] ? "num" : null }, c)),
          ),
        ),
      ),
    ),
  );
}

let counter = 0;
/** A labelled choice; `list` holds pairs [value, words]. */
export function choice(name, list, current, changed) {
  const id = `choice${++counter}`;
  const select = h(
    "select",
    { id, onchange: () => changed(select.value) },
    list.map(([v, words]) => h("option", { value: v, selected: v === current }, words)),
  );
  return h("label", { for: id }, h("span", { class: "small quiet" }, name), select);
}
export function field(name, props, unit = "") {
  const id = props.id ?? `field${++counter}`;
  return h(
    "label",
    { for: id },
    h("span", { class: "small quiet" }, name),
    h("input", { ...props, id }),
    unit && h("span", { class: "small quiet" }, unit),
  );
}

/**
 * A button that calls `store(name, replace)`. If `taken(name)` says that the name exists already,
 * only the second press stores and replaces.
 */
export function storing(words, props, { name, taken, store: keep }) {
  let sure = null;
  const button = h(
    "button",
    {
      ...props,
      onclick: () => {
        const now = name(),
          replace = taken(now),
          ask = replace && sure !== now;
        sure = ask ? now : null;
        button.textContent = ask ? t("Really replace it?") : words;
        if (!ask) keep(now, replace);
      },
    },
    words,
  );
  return button;
}

/** Recipes without a problem. */
export const recipes = async () => (await get("/recipes")).filter((r) => !r.problem);

/**
 * A choice of the finished scans, newest first, and the current scan: the scan that the address or
 * this session names, otherwise the newest.
 * @returns {[HTMLElement, import("../../../../../tools/pages/types").AnyJob | undefined]}
 */
export function scanChoice(query, changed) {
  const list = scans();
  const named = query.get("job") ?? sessionStorage.getItem("scan");
  const current = list.find((j) => j.id === named) ?? list[0];
  if (current) sessionStorage.setItem("scan", current.id);
  const say = (j) =>
    `${j.id} · ${j.order.recording ?? `${j.order.scan}, ${t("filtered")}`} · ` +
    `${thousands(j.outcome.points)} ${t("points")}`;
  return [
    choice(
      t("Scan"),
      list.map((j) => [j.id, say(j)]),
      current?.id,
      (id) => {
        sessionStorage.setItem("scan", id);
        changed(id);
      },
    ),
    current,
  ];
}
export const nothing = (what, page, words) =>
  h("div", { class: "panel" }, h("p", {}, what), h("a", { href: `#/${page}` }, words));

/** Readable recordings, all of them or those that suit a procedure. */
export const recordings = async (procedure) =>
  (await get("/recordings")).filter(
    (r) => !r.problem && (!procedure || r.suits.includes(procedure)),
  );

/** Shows recordings as pictures; a click chooses one. */
export function gallery(list, current, chosen) {
  return h(
    "div",
    { class: "thumbs", role: "group", "aria-label": t("Recordings") },
    list.map((r) =>
      h(
        "button",
        {
          class: "thumb",
          "aria-pressed": String(r.name === current),
          onclick: () => chosen(r),
        },
        h("img", {
          src: picture(r.name, Math.floor(r.frames / 2), 240),
          alt: "",
          loading: "lazy",
        }),
        h("span", {}, h("b", {}, r.name)),
        h("span", { class: "quiet" }, `${r.frames} × ${r.width}×${r.height}`),
      ),
    ),
  );
}

/** Orders a procedure from this tab; takes the lease first if no other tab holds it. */
export async function order(what) {
  if (!operating()) await operate(false);
  const job = await post("/jobs", what);
  // A short job may have ended, and its event arrived over the socket, before this answer.
  if (!store.jobs.has(job.id)) store.jobs.set(job.id, job);
  return job;
}

/** How a job without a result ended, in the page's language. */
const endedAs = (state) =>
  t(
    {
      cut_off: "cut off when the program ended",
      stopped: "stopped; what was done is kept",
      failed: "failed",
    }[state],
  );

/** Shows the progress of a job, then how it ended. `ended(job)` is called when the job is done. */
export function follow(place, id, ended) {
  let over = false;
  const draw = () => {
    const j = store.jobs.get(id);
    if (!j) return;
    const act = (what) => post(`/jobs/${id}/${what}`).catch((e) => fill(place, fault(e)));
    if (j.state === "running" || j.state === "queued") {
      over = false;
      fill(
        place,
        h(
          "div",
          { class: "panel row", "data-job": j.state },
          h("b", {}, j.id),
          h("progress", {
            max: j.of || 1,
            ...(j.of ? { value: j.done } : {}),
            "aria-label": t("Progress"),
          }),
          h("span", {}, j.of ? `${j.done} / ${j.of}` : t(j.state === "queued" ? "waits" : "runs")),
          h("button", { onclick: () => act("stop") }, t("Stop")),
        ),
      );
      return;
    }
    if (over) return;
    over = true;
    const resumable = ["cut_off", "stopped", "failed"].includes(j.state) && j.resumable;
    fill(
      place,
      j.problem && fault(j.problem),
      j.state !== "done" &&
        h(
          "div",
          { class: "row note", "data-job": j.state },
          h("span", {}, `${j.id}: ${endedAs(j.state)}`),
          resumable &&
            h(
              "button",
              {
                class: "resume",
                onclick: async () => {
                  await operate(false).catch(() => {});
                  act("resume");
                },
              },
              t("Resume"),
            ),
          resumable &&
            j.order.procedure === "insert" &&
            h(
              "button",
              {
                class: "back-out",
                onclick: async () => {
                  await operate(false).catch(() => {});
                  act("back_out");
                },
              },
              t("Back out"),
            ),
          resumable &&
            j.order.procedure === "insert" &&
            h(
              "span",
              { class: "quiet small" },
              t(
                "Resume measures again if the tool has not set out for the part. Otherwise the tool moves back up.",
              ),
            ),
        ),
    );
    if (j.state === "done") ended?.(j);
  };
  const off = on("jobs", (j) => (!j || j.id === id) && draw());
  draw();
  return off;
}

/** The figures that every scan reports. */
export function scanFigures(f) {
  return figures(
    [thousands(f.points), t("points")],
    [String(f.shots), `${t("shots")} ${f.width}×${f.height}`],
    f.median_sigma_mm !== null && [num(f.median_sigma_mm, 4, "mm"), t("σ of a point, median")],
    f.coverage !== null && [num(100 * f.coverage, 1, "%"), t("of the cells measured")],
    f.cell_mm !== null && [num(f.cell_mm, 3, "mm"), t("cell")],
    [String(f.dark_shots), t("shots without a stripe"), f.dark_shots ? "poor-ink" : ""],
    f.skipped.length && [String(f.skipped.length), t("excluded shots"), "poor-ink"],
    [num(f.shots_per_second, 0), t("shots a second")],
  );
}
