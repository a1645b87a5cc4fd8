// Part: choose or teach a recipe, find its part in a scan, see the part's pose.

import { get, put, remove, url } from "../base/api.js";
import { all, fill, h, num } from "../base/dom.js";
import { jobs, store } from "../base/store.js";
import { t } from "../base/text.js";
import { attempt, fault } from "../widgets/problem.js";
import {
  choice,
  field,
  figures,
  follow,
  nothing,
  order,
  panel,
  scanChoice,
  storing,
} from "../widgets/parts.js";
import { operate, operating } from "../widgets/bar.js";
import { constructions } from "../widgets/part/constructions.js";
import { drawing } from "../widgets/part/drawing.js";
import { places } from "../widgets/part/holegrid.js";
import { scanMap } from "../widgets/view/scanmap.js";

export async function show(place, query) {
  const [choose, scan] = scanChoice(query, (id) => (location.hash = `#/part?job=${id}`));
  if (!scan)
    return void fill(
      place,
      h("h1", {}, t("Part")),
      nothing(t("Nothing was scanned yet."), "scan", t("Scan")),
    );
  let recipes = await get("/recipes");
  const first = () => (recipes.find((r) => !r.problem) ?? recipes[0])?.name;
  /** Whether the station itself, not only the program, has a recipe of that name. */
  const taken = (n) => recipes.some((r) => r.name === n && !r.shipped);
  let name = sessionStorage.getItem("recipe");
  if (!recipes.some((r) => r.name === name)) name = first();
  const problem = h("div"),
    progress = h("div"),
    picture = h("div", { class: "stack grow" }),
    found = h("div"),
    chooser = h("span"),
    tools = h("div", { class: "tools" }),
    side = h("div", { class: "stack" });
  let follows = () => {};
  const run = (what, ended) =>
    attempt(async () => {
      const job = await order(what);
      follows();
      follows = follow(progress, job.id, ended);
    }, problem);
  const find = () =>
    run({ procedure: "find", scans: [scan.id], recipe: name }, (j) => shown(j, j.outcome));
  const recipeChoice = () =>
    fill(
      chooser,
      choice(
        t("Recipe"),
        recipes.map((r) => [
          r.name,
          `${r.problem ? "⚠ " : ""}${r.name}${r.title ? ` · ${r.title}` : ""}${r.shipped ? "" : ` (${t("own")})`}`,
        ]),
        name,
        (v) => {
          name = v;
          sessionStorage.setItem("recipe", v);
          editor();
        },
      ),
    );
  place.classList.add("fit");
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Part")),
      choose,
      chooser,
      h("span", { class: "grow" }),
      h("button", { class: "main", id: "find", onclick: find }, t("Find")),
    ),
    problem,
    progress,
    h(
      "div",
      { class: "split" },
      h("section", { class: "panel fill stack" }, tools, picture),
      h("div", { class: "stack" }, panel(t("Found"), found), side),
    ),
  );
  recipeChoice();
  fill(
    found,
    h(
      "p",
      { class: "quiet small" },
      t("Choose a recipe and press Find, or teach a new part on the map."),
    ),
  );
  const view = await scanMap(picture, scan.id);

  let last = [],
    built = [],
    lies = null;
  function shown(j, p) {
    lies = onMap(p.part, view.head.base_from_grid);
    const colour = p.passed ? "#ffffff" : "#ff5ac8";
    last = p.outline.map((points) => ({ kind: "line", points, colour, wide: 1.5 }));
    marks();
    fill(
      found,
      h(
        "p",
        {},
        h("span", { class: `dot ${p.passed ? "good" : "bad"}`, role: "img", "aria-label": "" }),
        " ",
        h("b", {}, `${p.recipe}: ${t(p.passed ? "found" : "refused")}`),
      ),
      figures(
        [num(p.score, 3), t("score")],
        [num(p.second_score, 3), t("next best")],
        [num(Math.max(...p.sigma_mm.slice(0, 2)), 4, "mm"), t("σ in the plane")],
        [num(p.sigma_deg[2], 4, "°"), t("σ of the turn")],
      ),
      p.reasons.map((r) => h("p", { class: "note small" }, r)),
      h(
        "div",
        { class: "row" },
        h("a", { href: `#/position?job=${j.id}`, id: "to-position" }, t("Position")),
        h("a", { href: url(`/jobs/${j.id}/files/found.png`), target: "_blank" }, t("Picture")),
      ),
    );
  }
  // Teaching: an outline, windows and holes drawn on the map.
  const part = { outline: null, windows: [], holes: [], grid: null };
  const holes = () => [...part.holes, ...(part.grid ? places(part.grid, angle()) : [])];
  const marks = () =>
    view.marks([
      ...last,
      ...(lies
        ? built.map((b) => ({
            kind: "point",
            points: [lies(b.at)],
            colour: b.chosen ? "#ffd33d" : "#7cf",
            label: b.chosen ? b.name : "",
          }))
        : []),
      ...(part.outline
        ? [{ kind: "line", points: turned(part.outline, angle()), colour: "#ffd33d" }]
        : []),
      ...part.windows.map((w) => ({ kind: "line", points: turned(w, angle()), colour: "#5ad1ff" })),
      ...holes().map(([x, y, r]) => ({
        kind: "circle",
        points: [
          [x, y],
          [x + r, y],
        ],
        colour: "#5ad1ff",
      })),
    ]);
  const corners = (a, b) => [
    Math.min(a[0], b[0]),
    Math.min(a[1], b[1]),
    Math.max(a[0], b[0]),
    Math.max(a[1], b[1]),
  ];
  const angle = () => Number(turn.querySelector("input").value) || 0;
  const between = (a, b) =>
    run({ procedure: "find", scans: [scan.id], recipe: name, pins: [a, b] }, (j) =>
      j.outcome.passed ? (location.hash = `#/position?job=${j.id}`) : shown(j, j.outcome),
    );
  const kinds = {
    pins: [
      "Two pins",
      {
        shape: "line",
        says: t("Point at two pins: their midpoint sets the tool's position"),
        done: between,
      },
    ],
    outline: [
      "Outline",
      {
        shape: "box",
        says: t("Draw a box around the body"),
        done: (a, b) => {
          part.outline = corners(a, b);
          drawn();
        },
      },
    ],
    window: [
      "Window",
      {
        shape: "box",
        says: t("Draw a box around a window"),
        done: (a, b) => {
          part.windows.push(corners(a, b));
          drawn();
        },
      },
    ],
    grid: [
      "Grid",
      {
        shape: "circle",
        says: t("From the middle of the first hole of a grid to its rim"),
        done: (a, b) => {
          part.grid = {
            first: a,
            radius: Math.hypot(b[0] - a[0], b[1] - a[1]),
            columns: 2,
            rows: 1,
            pitch: [2.54, 2.54],
          };
          drawn();
        },
      },
    ],
    hole: [
      "Hole",
      {
        shape: "circle",
        says: t("From a hole's middle to its rim"),
        done: (a, b) => {
          part.holes.push([a[0], a[1], Math.hypot(b[0] - a[0], b[1] - a[1])]);
          drawn();
        },
      },
    ],
  };
  const select = (kind) => {
    for (const b of all(tools, "[data-tool]"))
      b.setAttribute("aria-pressed", String(b.dataset.tool === kind));
    view.tool(kind ? kinds[kind][1] : null);
  };
  const undo = () => {
    if (part.grid) part.grid = null;
    else if (part.holes.length) part.holes.pop();
    else if (part.windows.length) part.windows.pop();
    else part.outline = null;
    drawn();
  };
  const [pins, ...teaching] = Object.entries(kinds).map(([k, [words]]) =>
    h("button", { "data-tool": k, "aria-pressed": "false", onclick: () => select(k) }, t(words)),
  );
  fill(
    tools,
    pins,
    h("span", { class: "quiet small" }, t("Teach")),
    teaching,
    h("button", { onclick: undo }, t("Undo")),
    h("button", { onclick: () => select(null) }, t("Move the map")),
  );
  const turn = field(
    t("Turn"),
    {
      type: "number",
      value: "0",
      step: "0.5",
      min: "-180",
      max: "180",
      id: "turn",
      oninput: () => marks(),
    },
    "°",
  );
  const title = field(t("Name"), { type: "text", value: freeName(taken), maxlength: "60" });
  const bears = field(
      t("Tolerance"),
      { type: "number", value: "0.2", step: "0.05", min: "0.01" },
      "mm",
    ),
    turns = field(
      "",
      {
        type: "number",
        value: "1",
        step: "0.1",
        min: "0.01",
        "aria-label": t("Tolerance, degrees"),
      },
      "°",
    ),
    above = field(t("Approach"), { type: "number", value: "20", step: "1", min: "1" }, "mm");
  const value = (f) => f.querySelector("input").value;
  const teach = (name_, replace) =>
    run(
      {
        procedure: "teach",
        scan: scan.id,
        name: name_,
        replace,
        outline: part.outline,
        windows: part.windows,
        holes: holes(),
        angle_deg: angle(),
        tolerance_mm: Number(value(bears)),
        tolerance_deg: Number(value(turns)),
        approach_mm: Number(value(above)),
      },
      async (j) => {
        recipes = await get("/recipes");
        name = j.outcome.recipe;
        sessionStorage.setItem("recipe", name);
        Object.assign(part, { outline: null, windows: [], holes: [], grid: null });
        title.querySelector("input").value = freeName(taken);
        select(null);
        drawn();
        recipeChoice();
        shown(j, j.outcome.proof);
      },
    );
  const gridFields = () => {
    const g = part.grid,
      one = (words, value, step, min, set, id) =>
        field(words, {
          type: "number",
          id,
          value: String(value),
          step: String(step),
          min: String(min),
          oninput: (e) => {
            const v = Number(e.target.value);
            if (v >= min) {
              set(v);
              marks();
            }
          },
        });
    return h(
      "div",
      { class: "row" },
      one(t("Columns"), g.columns, 1, 1, (v) => (g.columns = Math.round(v)), "grid-columns"),
      one(t("Rows"), g.rows, 1, 1, (v) => (g.rows = Math.round(v)), "grid-rows"),
      one(t("Pitch along, mm"), g.pitch[0], 0.01, 0.1, (v) => (g.pitch[0] = v), "grid-x"),
      one(t("Pitch across, mm"), g.pitch[1], 0.01, 0.1, (v) => (g.pitch[1] = v), "grid-y"),
    );
  };
  /** Makes a recipe from a drawing, then searches for its part in the scan that is shown. */
  const made = drawing(problem, taken, async (read) => {
    recipes = await get("/recipes");
    name = read.recipe.name;
    sessionStorage.setItem("recipe", name);
    recipeChoice();
    editor();
    find();
  });
  let points = null;
  /** Shows the constructed points on the map, at the pose where the part was found. */
  function pointMarks(list) {
    built = list;
    marks();
  }
  function drawn() {
    marks();
    editor();
  }
  function editor() {
    const r = recipes.find((x) => x.name === name);
    if (part.outline) {
      const [x0, y0, x1, y1] = part.outline;
      fill(
        side,
        panel(
          t("Teach"),
          h(
            "p",
            { class: "small" },
            `${num(x1 - x0, 2)} × ${num(y1 - y0, 2, "mm")}, ` +
              `${part.windows.length} ${t("windows")}, ${holes().length} ${t("holes")}`,
          ),
          h(
            "div",
            { class: "stack" },
            part.grid && gridFields(),
            turn,
            title,
            h("div", { class: "row" }, bears, turns),
            above,
            storing(
              t("Teach"),
              { class: "main", id: "teach" },
              { name: () => value(title).trim(), taken, store: teach },
            ),
          ),
        ),
      );
      return;
    }
    if (!r) return void fill(side, made.panel);
    const text = h("textarea", {
      rows: 14,
      spellcheck: "false",
      "aria-label": t("Recipe as text"),
    });
    text.value = r.text;
    const built = h("div", { class: "stack" });
    points = constructions(built, {
      text: () => text.value,
      write: (v) => {
        text.value = v;
      },
      shown: pointMarks,
      say: (e) => fill(said, fault(e)),
    });
    const said = h("div", {}, r.problem && fault(r.problem)),
      as = field(t("Save as"), { type: "text", value: r.name, maxlength: "60" });
    const save = (new_, replace) =>
      attempt(async () => {
        if (!operating()) await operate(false);
        await put(`/recipes/${encodeURIComponent(new_)}`, { text: text.value, replace });
        recipes = await get("/recipes");
        name = new_;
        recipeChoice();
        fill(said, h("p", { class: "good-ink" }, t("Saved.")));
      }, said);
    const away = () =>
      attempt(async () => {
        if (!operating()) await operate(false);
        await remove(`/recipes/${encodeURIComponent(name)}`);
        recipes = await get("/recipes");
        name = first();
        recipeChoice();
        editor();
      }, said);
    fill(
      side,
      made.panel,
      panel(t("Constructed points"), built),
      panel(
        t("Recipe"),
        text,
        said,
        h(
          "div",
          { class: "row" },
          as,
          storing(
            t("Check and save"),
            { id: "save-recipe" },
            { name: () => value(as).trim(), taken, store: save },
          ),
          !r.shipped && h("button", { onclick: away }, t("Delete")),
        ),
      ),
    );
  }
  const former = jobs(
    (j) =>
      j.state === "done" &&
      (j.order.procedure === "find"
        ? j.order.scans[0] === scan.id
        : j.order.procedure === "teach" && j.order.scan === scan.id),
  )[0];
  if (former) shown(former, former.outcome.proof ?? former.outcome);
  editor();
  return () => {
    follows();
    view.end();
  };
}

/** A name that no recipe of the station has yet. */
function freeName(taken) {
  for (let k = 1; ; k++) {
    const name = k === 1 ? "part" : `part ${k}`;
    if (!taken(name)) return name;
  }
}

/** A function from a point of the part frame to the map, mm. */
function onMap(part, grid) {
  return ([x, y]) => {
    const base = [0, 1, 2].map(
      (r) => part[4 * r] * x + part[4 * r + 1] * y + part[4 * r + 3] - grid[4 * r + 3],
    );
    return [0, 1].map((c) => grid[c] * base[0] + grid[4 + c] * base[1] + grid[8 + c] * base[2]);
  };
}

/** Closed outline of a box rotated about its centre; degrees from x towards y. */
function turned([x0, y0, x1, y1], degrees) {
  const [cx, cy] = [(x0 + x1) / 2, (y0 + y1) / 2],
    c = Math.cos((degrees * Math.PI) / 180),
    s = Math.sin((degrees * Math.PI) / 180);
  return [
    [x0, y0],
    [x1, y0],
    [x1, y1],
    [x0, y1],
    [x0, y0],
  ].map(([x, y]) => [cx + c * (x - cx) - s * (y - cy), cy + s * (x - cx) + c * (y - cy)]);
}
