// In: the motion that a job proposes. Out: the motion shown with its gates and its pose. Holding
// the button confirms it; it moves only while the button is held.

import { post, say, tab } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { on, store, tell } from "../base/store.js";
import { gateName, t } from "../base/text.js";
import { operate, operating } from "./bar.js";
import { attempt, fault } from "./problem.js";
import { figure, panel } from "./parts.js";

/** Time that the button is held before a motion starts, ms (grants.rs requires 0.8 s). */
const HELD = 900;
/** Interval at which the page reports a held button, ms; a second without a report halts the arm. */
const SAY = 150;

/** Buttons that must come before a motion: arm the robot or give it back, "I have looked". */
export function arming(place) {
  const said = h("div");
  const act = (path, body) =>
    attempt(async () => {
      if (!operating()) await operate(false);
      store.motion = await post(path, body);
      tell("motion");
    }, said);
  let before = null;
  const draw = () => {
    const m = store.motion;
    const state = JSON.stringify([m?.robot, m?.may_move, m?.armed, m?.look, store.bar?.robot]);
    if (!m || state === before) return;
    before = state;
    const mine = m.armed === tab.slice(0, 4);
    if (!m.robot)
      return void fill(
        place,
        h("p", { class: "small quiet" }, t("No robot was named when the program was started.")),
      );
    if (!m.may_move)
      return void fill(
        place,
        h(
          "p",
          { class: "small quiet" },
          t("The program was started without --allow-motion, so the robot does not move."),
        ),
      );
    fill(
      place,
      m.look &&
        h(
          "div",
          { class: "note" },
          h("p", {}, h("b", {}, t("Look at the robot."))),
          h("p", { class: "small" }, m.look),
          h("button", { id: "looked", onclick: () => act("/robot/looked") }, t("I have looked")),
        ),
      h(
        "div",
        { class: "row" },
        h(
          "button",
          {
            id: "arm",
            class: mine ? "" : "main",
            "aria-pressed": String(mine),
            onclick: () => act("/robot", { armed: !mine }),
          },
          t(mine ? "Give the arm back" : "Arm"),
        ),
        h(
          "span",
          { class: "small quiet" },
          mine
            ? t("Each motion is shown here and waits for the held button.")
            : t("Arm only while a person stands at the emergency stop."),
        ),
      ),
      said,
    );
  };
  draw();
  const offs = [on("motion", draw), on("bar", draw)];
  return () => offs.forEach((off) => off());
}

/** Shows the motion that waits for confirmation, and the button that confirms it. */
export function ask(place) {
  const shown = h("div", { class: "stack" }),
    said = h("div", { role: "status" }),
    lines = h("div", { class: "small said", role: "log" });
  const button = h("button", { class: "main hold", id: "send" }, h("span", {}, t("Hold to move")));
  const no = h(
    "button",
    { id: "no", onclick: () => attempt(() => post("/motion/refuse", what()), said) },
    t("No"),
  );
  const what = () => ({ job: store.motion.asked.job, hash: store.motion.asked.hash });
  // The hash that the button was pressed over, or that was confirmed; one press may continue to a
  // following motion.
  let down = false,
    over = null,
    timer = 0,
    beat = 0,
    grant = null;
  const idle = () => {
    clearTimeout(timer);
    over = null;
    button.classList.remove("down");
  };
  const press = async () => {
    const m = store.motion,
      a = m?.asked;
    if (!down || !a || m.moving || over === a.hash) return;
    const mine = (over = a.hash),
      body = what();
    fill(said);
    button.classList.add("down");
    try {
      if (!operating()) await operate(false);
      const given = (await post("/motion/press", body)).grant;
      if (!down || over !== mine) return;
      timer = setTimeout(async () => {
        if (!down || over !== mine || store.motion?.asked?.hash !== mine) return;
        try {
          grant = given;
          say(`held ${grant}`);
          await post("/motion/go", { grant: given, what: body });
        } catch (error) {
          fill(said, fault(error));
          up();
        }
      }, HELD);
    } catch (error) {
      fill(said, fault(error));
      up();
    }
  };
  const go = (e) => {
    if (
      button.disabled ||
      down ||
      (e.type === "keydown" && (e.repeat || ![" ", "Enter"].includes(e.key)))
    )
      return;
    e.preventDefault();
    if (e.pointerId !== undefined) button.setPointerCapture(e.pointerId);
    down = true;
    beat = setInterval(() => grant && say(`held ${grant}`), SAY);
    press();
  };
  function up() {
    if (!down) return;
    down = false;
    clearInterval(beat);
    idle();
    grant = null;
    post("/motion/release").catch(() => {});
  }
  button.addEventListener("pointerdown", go);
  button.addEventListener("keydown", go);
  for (const kind of ["pointerup", "pointercancel", "keyup", "blur", "contextmenu"])
    button.addEventListener(kind, up);
  const hidden = () => document.hidden && up();
  document.addEventListener("visibilitychange", hidden);
  addEventListener("blur", up);
  addEventListener("pagehide", up);
  let before = null;
  const draw = () => {
    const m = store.motion,
      a = m?.asked;
    const mine = m?.armed === tab.slice(0, 4);
    const state = JSON.stringify([a?.hash, m?.moving, mine, m?.said.length, m?.job]);
    if (!m || state === before) return;
    before = state;
    fill(
      lines,
      m.said.slice(-8).map((l) => h("p", {}, l)),
    );
    place.dataset.step = a?.step ?? "";
    place.dataset.moving = String(m.moving);
    button.disabled = !a || !mine;
    no.disabled = !a || m.moving || !mine;
    if (!a) {
      over = null;
      button.classList.remove("down");
      fill(
        shown,
        h(
          "p",
          { class: "quiet" },
          store.bar?.running
            ? t("The job works; no motion waits.")
            : t("No motion waits for a confirmation."),
        ),
      );
      return;
    }
    fill(
      shown,
      h("p", {}, h("b", {}, `${t(a.step)}: ${t(m.moving ? "moves" : a.question)}`)),
      a.says.map((s) => h("p", { class: "small" }, s)),
      h(
        "div",
        { class: "pose" },
        a.labels.map((l, i) => {
          const [name, unit] = l.split(" ");
          return figure(
            num(a.numbers[i], unit === "mm" ? 3 : 4),
            `${name}${unit ? `, ${unit}` : ""}`,
          );
        }),
      ),
      h(
        "p",
        { class: "small quiet" },
        `${a.motions} ${t("motions")} · ${num(a.speed_mm_s, 0, "mm/s")} · ` +
          `${t("flange, at the end")} · ${a.convention} · ${a.hash.slice(0, 12)}`,
      ),
      h(
        "details",
        {},
        h("summary", {}, `${a.gates.length} ${t("gates passed")}`),
        a.gates.map(gate),
      ),
    );
    if (down && a.stays_down && !m.moving) press();
  };
  fill(
    place,
    shown,
    h("div", { class: "row hold-row" }, button, no),
    said,
    h(
      "p",
      { class: "small quiet" },
      t(
        "The arm makes the shown motion once, while the button is held. Releasing the button halts it.",
      ),
    ),
    lines,
  );
  draw();
  const offs = [on("motion", draw), on("bar", draw), on("lost", () => store.lost && up())];
  return () => {
    up();
    offs.forEach((off) => off());
    document.removeEventListener("visibilitychange", hidden);
    removeEventListener("blur", up);
    removeEventListener("pagehide", up);
  };
}

export function gate(g) {
  return h(
    "div",
    { class: "light" },
    h("span", {
      class: `dot ${g.passed ? "good" : "bad"}`,
      role: "img",
      "aria-label": t(g.passed ? "kept" : "missed"),
    }),
    h("span", {}, gateName(g.name)),
    h(
      "span",
      { class: "small num" },
      h("b", {}, num(g.value, 3)),
      h("span", { class: "quiet" }, ` / ${num(g.limit, 3)}`),
    ),
  );
}

/** Buttons of the simulated cell: the component in the gripper, and where the arm is jogged to. */
export function inTheCell(place, overBoard, changed) {
  let before = null;
  const draw = () => {
    const s = store.motion?.simulated,
      state = JSON.stringify([s, store.motion?.asked?.hash]);
    if (!s || state === before) return;
    before = state;
    const said = h("div");
    const put = (body) =>
      attempt(async () => {
        if (!operating()) await operate(false);
        store.motion = await post("/simulated", body);
        tell("motion");
        changed?.(store.motion.simulated);
      }, said);
    fill(
      place,
      h(
        "div",
        { class: "row" },
        !overBoard &&
          s.parts.map((p) =>
            h(
              "button",
              {
                "data-part": p,
                "aria-pressed": String(p === s.holds && !s.over_board),
                onclick: () => put({ holds: p }),
              },
              p,
            ),
          ),
        overBoard &&
          h(
            "button",
            {
              id: "over-board",
              "aria-pressed": String(s.over_board),
              onclick: () => put({ over_board: true }),
            },
            t("Jog over the board"),
          ),
      ),
      said,
    );
  };
  draw();
  return on("motion", draw);
}
