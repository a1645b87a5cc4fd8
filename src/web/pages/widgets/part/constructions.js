// In: a recipe's text. Out: its constructed points beside the picture: built of pins and of each other, chosen for the tool, written into
// the text.

import { post } from "../../base/api.js";
import { fill, h, num } from "../../base/dom.js";
import { t } from "../../base/text.js";
import { choice, field, table } from "../parts.js";

const KINDS = { midpoint: "Midpoint", line: "Line", offset: "Offset", lattice: "Lattice" };

/** `recipe.text()` and `recipe.write(text)` are the editor's; `recipe.shown(points)` hears of the points, `recipe.say(fault)` of what is wrong. */
export function constructions(place, recipe) {
  let points = [], kind = "midpoint", turn = 0;
  const now = { of: [], along: "", by: [0, 0] };
  const load = async () => {
    const mine = ++turn;
    try {
      const read = await post("/points", { text: recipe.text() });
      if (mine !== turn) return;
      points = read;
      recipe.shown(points.filter((p) => p.kind !== "grid"));
      draw();
    } catch (e) {
      if (mine === turn) recipe.say(e);
    }
  };
  const write = (text) => { recipe.write(text); return load(); };
  const built = () => points.filter((p) => p.kind in KINDS || p.kind === "intersection");
  function draw() {
    const name = field(t("Name"), { type: "text", value: free(), maxlength: "60", id: "point-name" });
    const names = (kinds) => points.filter((p) => (kinds ? kinds.includes(p.kind) : p.kind !== "grid")).map((p) => [p.name, p.name]);
    const one = (words, list, k) => { if (!list.some(([v]) => v === now.of[k])) now.of[k] = list[Math.min(k, list.length - 1)]?.[0]; return choice(words, list, now.of[k], (v) => { now.of[k] = v; }); };
    const number = (words, k, id) => field(words, { type: "number", id, step: "0.01", value: String(now.by[k]), oninput: (e) => { now.by[k] = Number(e.target.value); } }, "mm");
    const ways = names(["line", "lattice"]);
    if (!ways.some(([v]) => v === now.along)) now.along = ways[0]?.[0] ?? "";
    const inputs = {
      midpoint: () => [one(t("Of"), names(), 0), one(t("and"), names(), 1)],
      line: () => [one(t("Of"), names(), 0), one(t("and"), names(), 1)],
      offset: () => [one(t("Of"), names(), 0), choice(t("Along"), ways, now.along, (v) => { now.along = v; }), number(t("Along, mm"), 0, "by-along"), number(t("Across, mm"), 1, "by-across")],
      lattice: () => [one(t("Of"), names(["grid"]), 0)],
    }[kind]();
    const need = { lattice: names(["grid"]).length > 0, offset: ways.length > 0 && names().length > 0 }[kind] ?? names().length > 1;
    fill(place,
      built().length > 0 && table([t("Point"), "#x, mm", "#y, mm", t("Tool"), ""], built().map((p) => [h("span", { "data-point": p.name }, p.name), num(p.at[0], 3), num(p.at[1], 3),
        p.kind === "line" ? "" : h("input", { type: "radio", name: "chosen", checked: p.chosen, "aria-label": `${t("Tool goes to")} ${p.name}`, onchange: () => write(chosen(recipe.text(), p.name)) }),
        h("button", { class: "plain", "aria-label": `${t("Take away")} ${p.name}`, onclick: () => write(without(recipe.text(), p.name)) }, "×")])),
      built().some((p) => p.chosen) && h("button", { onclick: () => write(chosen(recipe.text(), null)) }, t("Tool goes to the part's own place")),
      h("div", { class: "row" }, choice(t("Construct"), Object.entries(KINDS).map(([k, w]) => [k, t(w)]), kind, (v) => { kind = v; now.of = []; draw(); }), inputs, name,
        h("button", { id: "add-point", disabled: !need, onclick: () => write(added(recipe.text(), { name: name.querySelector("input").value.trim(), kind, ...now })) }, t("Add"))),
      !need && h("p", { class: "small quiet" }, t("Shapes need names for this; a lattice needs a grid, an offset a line or lattice.")));
  }
  const free = () => { for (let k = 1; ; k++) if (!points.some((p) => p.name === `point ${k}`)) return `point ${k}`; };
  load();
  return { load };
}

/** The text with a construction more: before the insertion that may use it, behind those it may be built of. */
export function added(text, { name, kind, of, along, by }) {
  const q = (s) => JSON.stringify(s), used = of.slice(0, { midpoint: 2, line: 2 }[kind] ?? 1).filter(Boolean);
  const more = kind === "offset" ? `along = ${q(along)}\nby_mm = [${by.join(", ")}]\n` : "";
  const block = `[[construction]]\nname = ${q(name)}\nkind = ${q(kind)}\nof = [${used.map(q).join(", ")}]\n${more}\n`;
  const at = text.search(/^\[insertion\]/m);
  return at < 0 ? `${text.trimEnd()}\n\n${block}` : text.slice(0, at) + block + text.slice(at);
}

/** The text without the construction of that name. */
export function without(text, name) {
  const parts = text.split(/^(?=\[)/m), named = (p) => p.startsWith("[[construction]]") && new RegExp(`^name\\s*=\\s*(["'])${escaped(name)}\\1`, "m").test(p);
  return parts.filter((p) => !named(p)).join("");
}

/** The text whose insertion goes to that construction; null: to the part's own place. */
export function chosen(text, name) {
  const parts = text.split(/^(?=\[)/m), line = name === null ? "" : `construction = ${JSON.stringify(name)}\n`;
  return parts.map((p) => (!/^\[insertion\]/.test(p) ? p : (() => { const bare = p.replace(/^construction\s*=.*\n/m, ""), end = bare.indexOf("\n") + 1; return bare.slice(0, end) + line + bare.slice(end); })())).join("");
}

const escaped = (s) => s.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
