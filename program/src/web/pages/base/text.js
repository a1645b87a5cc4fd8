// In: an English text. Out: its translation into the screen's language, from one table; English
// if the table has none.

import { GATES, TABLE } from "./texts.js";

export const LANGUAGES = { en: "English", de: "Deutsch", zh: "中文", ja: "日本語" };
const COLUMN = { de: 0, zh: 1, ja: 2 };

const stored = (key) => {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
};

export function language() {
  const chosen = stored("language") ?? navigator.language.slice(0, 2);
  return chosen in LANGUAGES ? chosen : "en";
}
export function t(english) {
  const column = COLUMN[language()];
  return (column === undefined ? undefined : TABLE[english]?.[column]) ?? english;
}
/** What the condition of a report is called on the screen; its own name if the table has none. */
export function gateName(name) {
  return GATES[name]?.[(COLUMN[language()] ?? -1) + 1] ?? name;
}
export function setLanguage(name) {
  localStorage.setItem("language", name);
  apply();
  dispatchEvent(new Event("language"));
}

export const theme = () => stored("theme") ?? "auto";
export function setTheme(name) {
  localStorage.setItem("theme", name);
  apply();
}

/** Sets the language and the colour theme of the document. */
export function apply() {
  document.documentElement.lang = language();
  const light =
    theme() === "light" ||
    (theme() === "auto" && matchMedia("(prefers-color-scheme: light)").matches);
  document.documentElement.dataset.theme = light ? "light" : "dark";
}
matchMedia("(prefers-color-scheme: light)").addEventListener("change", apply);
