// Surface: a scan's height, intensity and sigma; sections, distances, the cloud in three
// dimensions, files to download.

import { post, url } from "../base/api.js";
import { all, fill, h, num, withSigma } from "../base/dom.js";
import { t } from "../base/text.js";
import { cloud } from "../widgets/view/cloud.js";
import { filters } from "../widgets/part/filters.js";
import { section } from "../widgets/view/plot.js";
import { attempt } from "../widgets/problem.js";
import { nothing, panel, scanChoice, scanFigures, table } from "../widgets/parts.js";
import { scanMap } from "../widgets/view/scanmap.js";

const FILES = [
  ["scan/cloud.ply", "PLY"],
  ["scan/cloud.pcd", "PCD"],
  ["scan/height.tif", "TIFF"],
  ["scan/height.png", "PNG 16"],
  ["scan/scan.json", "JSON"],
];

export async function show(place, query) {
  const go = (id) => (location.hash = `#/surface?job=${id}`);
  const [choose, job] = scanChoice(query, go);
  if (!job)
    return void fill(
      place,
      h("h1", {}, t("Surface")),
      nothing(t("Nothing was scanned yet."), "scan", t("Scan")),
    );
  const picture = h("div", { class: "stack grow" }),
    solid = h("div", { hidden: true, class: "stack grow" }),
    line = h("div"),
    said = h("div"),
    sieve = h("div", { class: "stack sieve" }),
    problem = h("div");
  const tools = h("div", { class: "tools", role: "group", "aria-label": t("Tools") });
  let view3 = null;
  const flat = h("button", { "aria-pressed": "true", onclick: () => mode(false) }, t("Map"));
  const deep = h(
    "button",
    { id: "three", "aria-pressed": "false", onclick: () => mode(true) },
    "3-D",
  );
  place.classList.add("fit");
  fill(
    place,
    h(
      "div",
      { class: "head" },
      h("h1", {}, t("Surface")),
      choose,
      h("span", { class: "grow" }),
      flat,
      deep,
    ),
    problem,
    h(
      "div",
      { class: "split" },
      h("section", { class: "panel fill stack" }, tools, picture, solid, line),
      h(
        "div",
        { class: "stack" },
        panel(t("Measured"), said),
        panel(t("Filters"), sieve),
        panel(t("Figures"), scanFigures(job.outcome)),
        panel(
          t("Download"),
          h(
            "div",
            { class: "row" },
            FILES.map(([f, n]) =>
              h(
                "a",
                {
                  href: url(`/jobs/${job.id}/files/${f}`),
                  download: `${job.id}-${f.split("/")[1]}`,
                },
                n,
              ),
            ),
          ),
        ),
      ),
    ),
  );
  const view = await scanMap(picture, job.id);
  picture.lastElementChild.classList.add("map");
  fill(
    said,
    h("p", { class: "quiet small" }, t("Choose a tool above the map, then drag or click.")),
  );

  const kept = await filters(sieve, job.id, view.head, {
    problem,
    saved: (j) => {
      sessionStorage.setItem("scan", j.id);
      go(j.id);
    },
    changed: async () => {
      await view.again();
      // Results measured with other filters do not apply any more.
      results.length = 0;
      list();
      view3?.end();
      view3 = null;
      if (!solid.hidden) await mode(true);
    },
  });
  const results = [];
  const keep = (words, detail, marks) => {
    results.unshift({ words, detail, marks });
    results.length = Math.min(results.length, 8);
    list();
  };
  const list = () => {
    view.marks(results.flatMap((r) => r.marks));
    fill(
      said,
      results.map((r, i) =>
        h(
          "div",
          { class: "light" },
          h("span", {}, ""),
          h("span", {}, h("b", {}, r.words), h("div", { class: "small quiet" }, r.detail)),
          h(
            "button",
            {
              class: "plain",
              "aria-label": t("Undo"),
              onclick: () => {
                results.splice(i, 1);
                list();
              },
            },
            "×",
          ),
        ),
      ),
    );
  };

  const plot = section(line, (pieces) => ask(last.from, last.to, pieces));
  line.hidden = true;
  /** @type {{ from: any, to: any, mark?: any[] } | null} */
  let last = null;
  const ask = (from, to, fits = []) =>
    attempt(async () => {
      const answer = await post(`/scans/${job.id}/section`, { from, to, fits });
      last = { from, to };
      line.hidden = false;
      plot.show(answer, fits.length > 0);
      if (fits.length) {
        const f = answer.fits.map(
          (x) =>
            `${num(x.piece[0], 2)}…${num(x.piece[1], 2)} mm: ` +
            `z ${withSigma(x.height_mm, x.height_sigma_mm, "mm")}, ` +
            withSigma(x.angle_deg, x.angle_sigma_deg, "°"),
        );
        keep(
          answer.step
            ? `${t("Step")} ${withSigma(answer.step.value, answer.step.sigma, "mm")}, ` +
                `${t("angle")} ${withSigma(answer.angle.value, answer.angle.sigma, "°")}`
            : `${t("Piece")} ${f[0]}`,
          f.join(" · "),
          [{ kind: "line", points: [from, to], colour: "#ffd33d" }],
        );
      } else if (!results.some((r) => r.marks[0]?.points === last.mark)) {
        last.mark = [from, to];
        keep(
          `${t("Section")} ${num(answer.length_mm, 2, "mm")}`,
          t("Drag over one or two pieces of the curve: lines are fitted, step and angle measured."),
          [{ kind: "line", points: last.mark, colour: "#ffd33d" }],
        );
      }
    }, problem);
  const measure = (what, marks, words) =>
    attempt(async () => {
      const m = await post(`/scans/${job.id}/measure`, what);
      const detail = m.along
        ? `Δx ${num(m.along[0], 3)}  Δy ${num(m.along[1], 3)}  Δz ${num(m.along[2], 3, "mm")}`
        : `${t("plane")}: ${m.cells} ${t("cells")}, rms ${num(m.rms_mm, 4, "mm")}, ` +
          `${t("tilt")} ${withSigma(m.tilt.value, m.tilt.sigma, "°")}`;
      const text = withSigma(m.distance.value, m.distance.sigma, "mm");
      marks.at(-1).label = text;
      keep(`${words} ${text}`, detail, marks);
    }, problem);

  const choices = {
    move: null,
    section: { shape: "line", says: t("Section: from, to"), done: (a, b) => ask(a, b) },
    points: {
      shape: "line",
      says: t("Two points"),
      done: (a, b) =>
        measure({ measure: "two_points", a, b }, [{ kind: "line", points: [a, b] }], t("Distance")),
    },
    plane: {
      shape: "box",
      says: t("Draw a box over the plane"),
      done: (a, b) => {
        view.marks([
          ...results.flatMap((r) => r.marks),
          { kind: "box", points: [a, b], colour: "#5ad1ff" },
        ]);
        view.tool({
          shape: "point",
          says: t("Now the point"),
          done: (p) => {
            select("plane");
            measure(
              { measure: "point_to_plane", point: p, plane: [...a, ...b] },
              [
                { kind: "box", points: [a, b], colour: "#5ad1ff" },
                { kind: "point", points: [p] },
              ],
              t("Above the plane"),
            );
          },
        });
      },
    },
    cut: kept.cut,
    keep: kept.keep,
  };
  const words = {
    move: "Move",
    section: "Section",
    points: "Two points",
    plane: "Point to plane",
    cut: "Cut out",
    keep: "Keep",
  };
  const select = (name) => {
    for (const b of all(tools, "[data-tool]"))
      b.setAttribute("aria-pressed", String(b.dataset.tool === name));
    view.tool(choices[name]);
  };
  fill(
    tools,
    Object.keys(choices).map((name) =>
      h("button", { "data-tool": name, onclick: () => select(name) }, t(words[name])),
    ),
  );
  select("move");

  async function mode(three) {
    flat.setAttribute("aria-pressed", String(!three));
    deep.setAttribute("aria-pressed", String(three));
    picture.hidden = tools.hidden = three;
    solid.hidden = !three;
    line.hidden = three || !last;
    if (three && !view3) view3 = await attempt(() => cloud(solid, job.id), problem);
  }
  if (query.get("view") === "3d") await mode(true);
  return () => {
    view.end();
    view3?.end();
    kept.end();
  };
}
