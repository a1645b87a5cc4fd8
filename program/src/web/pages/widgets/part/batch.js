// In: recordings, a recipe, settings. Out: each recording scanned and searched, one job after the
// other; the scatter of the found poses beside their stated uncertainty.

import { get, post } from "../../base/api.js";
import { fill, h, num, svg } from "../../base/dom.js";
import { done, on } from "../../base/store.js";
import { t } from "../../base/text.js";
import { choice, order, recipes as known, recordings, table } from "../parts.js";
import { attempt } from "../problem.js";

/** Most recordings of a batch: two jobs each, and the server queues 32 jobs. */
const MOST = 15;

/**
 * Fills `place`; `settings()` returns the settings that differ from the station's. Returns a function
 * that ends it.
 */
export async function batch(place, settings, problem) {
  const [list, recipes] = [await recordings("scan"), await known()];
  const chosen = new Set(list.slice(0, MOST).map((r) => r.name));
  let recipe = sessionStorage.getItem("recipe") ?? recipes[0]?.name ?? "";
  const shown = h("div", { class: "stack" });
  const run = () =>
    attempt(async () => {
      for (const name of [...chosen].slice(0, MOST)) {
        const scan = await order({
          procedure: "scan",
          recording: name,
          settings: { ...settings() },
        });
        if (recipe) await order({ procedure: "find", scans: [scan.id], recipe });
      }
    }, problem);
  let turn = 0,
    before = null;
  const draw = () =>
    attempt(async () => {
      const mine = ++turn,
        found = done("find")
          .filter((j) => j.outcome.recipe === recipe && !j.order.pins)
          .map((j) => j.id),
        names = found.join(" ");
      // Running jobs send events all the time: the repeatability changes only with the list of
      // found poses.
      if (names === before) return;
      const repeats = await post("/repeats", { jobs: found });
      if (mine !== turn) return;
      before = names;
      fill(shown, spread(repeats));
    }, problem);
  fill(
    place,
    h(
      "div",
      { class: "row" },
      choice(
        t("Recipe"),
        [["", t("none: scan only")], ...recipes.map((r) => [r.name, r.name])],
        recipe,
        (v) => {
          recipe = v;
          before = null;
          draw();
        },
      ),
      h(
        "button",
        {
          class: "main",
          id: "run-batch",
          disabled: !list.length,
          onclick: run,
        },
        t("Run batch"),
      ),
    ),
    h(
      "div",
      { class: "row" },
      list.map((r) =>
        h(
          "label",
          {},
          h("input", {
            type: "checkbox",
            checked: chosen.has(r.name),
            onchange: (e) => (e.target.checked ? chosen.add(r.name) : chosen.delete(r.name)),
          }),
          r.name,
        ),
      ),
    ),
    shown,
  );
  await draw();
  const off = on("jobs", draw);
  return () => {
    turn++;
    off();
  };
}

const NAMES = { x: "x", y: "y", z: "z", turn: "Turn" },
  UNITS = { mm: "mm", degrees: "°" };

/** Shows the scatter of the poses, which the server computes as `sheetlight batch` does. */
function spread(r) {
  if (r.places < 2)
    return h(
      "p",
      { class: "small quiet" },
      t("Two or more places of one recipe show how well they repeat."),
    );
  const name = (s) => t(NAMES[s.name]),
    unit = (s) => UNITS[s.unit];
  return h(
    "div",
    { class: "stack", "data-repeats": String(r.places) },
    h(
      "div",
      { class: "even" },
      r.along.map((s) => histogram(s, `${name(s)}, ${unit(s)}`)),
    ),
    table(
      [
        t("Along"),
        `#${t("repeats")}`,
        `#${t("scatter, 1 σ")}`,
        `#${t("stated, 1 σ")}`,
        `#${t("apart at most")}`,
      ],
      r.along.map((s) => [
        name(s),
        String(r.places),
        num(s.scatter, 4, unit(s)),
        num(s.stated, 4, unit(s)),
        num(s.apart, 4, unit(s)),
      ]),
    ),
    h(
      "p",
      { class: "small quiet" },
      t(
        "Deviation from the median, in the scan's frame. It is valid only if the part did not move between recordings.",
      ),
    ),
  );
}

function histogram({ bars, half }, name) {
  const high = Math.max(...bars, 1);
  return h(
    "figure",
    { class: "histogram" },
    svg(
      "svg",
      {
        class: "plot",
        viewBox: `0 0 ${bars.length} 100`,
        preserveAspectRatio: "none",
        role: "img",
        "aria-label": `${t("Histogram of repeats")}: ${name}`,
      },
      bars.map((n, i) =>
        svg("rect", {
          class: "bar",
          x: i + 0.04,
          width: 0.92,
          y: 100 - (95 * n) / high,
          height: (95 * n) / high,
        }),
      ),
    ),
    h("figcaption", { class: "small quiet" }, `${name}: ±${num(half, 4)}`),
  );
}
