// Settings: language, light or dark, what the station is made of.

import { get, url } from "../base/api.js";
import { fill, h } from "../base/dom.js";
import { LANGUAGES, language, setLanguage, setTheme, t, theme } from "../base/text.js";
import { choice, panel, table } from "../widgets/parts.js";

export async function show(place) {
  const info = await get("/station");
  fill(place, h("div", { class: "head" }, h("h1", {}, t("Settings"))),
    h("div", { class: "even" },
      panel(t("This screen"), h("div", { class: "stack" },
        choice(t("Language"), Object.entries(LANGUAGES), language(), setLanguage),
        choice(t("Colours"), [["auto", t("as the system")], ["dark", t("dark")], ["light", t("light")]], theme(), setTheme),
        h("p", { class: "small quiet" }, t("Alt and a digit open a page; Tab, arrows and Enter do the rest.")))),
      panel(t("Backup"), h("p", { class: "small" }, t("A station is its folder: settings, calibrations, recipes and jobs. Copy it while the program is ended.")), h("a", { href: url("/support"), download: "sheetlight-support.json" }, t("Support file (no pictures)")))),
    panel(t("How the stripe is found"), table([t("Setting"), t("Value")], Object.entries(info.extraction).map(([k, v]) => [k, JSON.stringify(v)]))));
}
