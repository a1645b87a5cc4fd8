// In: the address. Out: a session, the bar, one page at a time.

import { Problem, get, listen, post, tab } from "./api.js";
import { fill, h } from "./dom.js";
import { apply, t } from "./text.js";
import { store, take, takeRows, tell } from "./store.js";
import { bar } from "../widgets/bar.js";
import { fault } from "../widgets/problem.js";

/**
 * Pages in the order in which a shift uses them. Each module exports `show(place, query)`, which
 * returns a function that ends the page.
 */
const PAGES = [
  "station",
  "picture",
  "calibrate",
  "touch",
  "scan",
  "surface",
  "part",
  "position",
  "replay",
  "health",
  "settings",
];
const NAMES = {
  station: "Station",
  picture: "Picture",
  calibrate: "Calibrate",
  touch: "Touch",
  scan: "Scan",
  surface: "Surface",
  part: "Part",
  position: "Position",
  replay: "Replay",
  health: "Health",
  settings: "Settings",
};

let leave = () => {};
let turn = 0;

async function page() {
  const [name, query] = location.hash.replace(/^#\/?/, "").split("?");
  const known = PAGES.includes(name) ? name : "station";
  const mine = ++turn;
  delete document.getElementById("main").dataset.ready;
  leave();
  leave = () => {};
  nav(known);
  const main = document.getElementById("main");
  const module = await import(`../pages/${known}.js`);
  if (mine !== turn) return;
  const place = h("div", { class: "page" });
  fill(main, place);
  document.title = `${t(NAMES[known])} · Sheetlight`;
  main.dataset.page = known;
  main.scrollTop = 0;
  try {
    leave = (await module.show(place, new URLSearchParams(query ?? ""))) ?? (() => {});
    main.dataset.ready = known;
    performance.mark("usable");
  } catch (e) {
    fill(place, fault(e));
  }
}

/** Draws the navigation. The links are created once, so that a focused link keeps the focus. */
function nav(current) {
  const place = document.getElementById("nav");
  if (!place.children.length)
    fill(
      place,
      PAGES.map((p, i) => h("a", { href: `#/${p}`, title: `Alt+${(i + 1) % 10}` })),
    );
  PAGES.forEach((p, i) => {
    const link = place.children[i];
    if (link.textContent !== t(NAMES[p])) link.textContent = t(NAMES[p]);
    p === current
      ? link.setAttribute("aria-current", "page")
      : link.removeAttribute("aria-current");
  });
}

function keys(e) {
  if (e.altKey && /^[0-9]$/.test(e.key)) {
    location.hash = `#/${PAGES[(Number(e.key) + 9) % 10]}`;
    e.preventDefault();
  }
}

/**
 * Opens a session with the token behind `#`, or uses the session of the cookie. Throws if there is
 * neither; `door` then asks for the password.
 */
async function enter() {
  const token = /[#&]token=([0-9a-f]+)/.exec(location.hash)?.[1];
  if (token) {
    history.replaceState(null, "", "#/station");
    await post("/session", { token });
    return;
  }
  await get("/session");
}

function door(e) {
  const field = h("input", { type: "password", id: "password", autocomplete: "current-password" });
  const knock = async (event) => {
    event.preventDefault();
    try {
      await post("/session", { password: field.value });
      location.reload();
    } catch (again) {
      tell("problem", again);
    }
  };
  fill(
    document.getElementById("main"),
    h(
      "form",
      { class: "panel door stack", onsubmit: knock },
      h("h1", {}, "Sheetlight"),
      fault(e),
      location.protocol === "https:" && [
        h("label", { for: "password" }, t("Password")),
        field,
        h("button", { class: "main" }, t("Open")),
      ],
    ),
  );
}

function lost(how) {
  store.lost = how;
  tell("lost");
  if (how === "over")
    door(
      new Problem(401, {
        what: t("The program was started again."),
        cause: "",
        next: t("Open the address that it printed."),
      }),
    );
}

async function start() {
  apply();
  try {
    await enter();
  } catch (e) {
    door(e);
    return;
  }
  bar(document.getElementById("bar"));
  const told = listen({ event: take, rows: takeRows, lost });
  addEventListener("hashchange", page);
  addEventListener("keydown", keys);
  // Touching the screen renews the lease; a screen that nobody touches loses it after a minute.
  let touched = 0;
  const touch = () => {
    if (store.bar?.lease.holder === tab.slice(0, 4) && Date.now() - touched > 15000) {
      touched = Date.now();
      post("/lease").catch(() => {});
    }
  };
  for (const kind of ["pointerdown", "keydown", "wheel"])
    addEventListener(kind, touch, { passive: true });
  addEventListener("language", page);
  await told;
  await page();
}

start();
