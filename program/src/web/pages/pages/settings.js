// Settings: language and colours; pose convention, limits and outputs of the station; its file as
// text; folders, permissions; backups and restoring them; outputs to try.

import { get, post, put, url } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { on, store } from "../base/store.js";
import { LANGUAGES, language, setLanguage, setTheme, t, theme } from "../base/text.js";
import { arming } from "../widgets/ask.js";
import { operate, operating } from "../widgets/bar.js";
import { choice, panel, table } from "../widgets/parts.js";
import { attempt } from "../widgets/problem.js";
import { settingsForm } from "../widgets/settingsform.js";

const OUTPUTS = {
  line: "Line laser",
  pointer: "Pointer",
  room: "Lamp",
  open: "Open the gripper",
  close: "Close the gripper",
};

export async function show(place) {
  let now = await get("/settings");
  const problem = h("div"),
    saved = h("p", { class: "good-ink", role: "status" }),
    form = h("div", { class: "stack" }),
    text = h("div", { class: "stack" }),
    kept = h("div", { class: "stack" });
  /** Changes the station: takes the lease first, and shows the settings again afterwards. */
  const change = (what, said) =>
    attempt(async () => {
      saved.textContent = "";
      if (!operating()) await operate(false);
      now = await what();
      saved.textContent = said;
      draw();
    }, problem);
  const draw = () => {
    settingsForm(form, now, (changes) =>
      change(() => put("/settings", { sha256: now.sha256, changes }), t("Saved.")),
    );
    const area = h("textarea", { rows: 16, spellcheck: "false", "aria-label": "station.toml" });
    area.value = now.text;
    fill(
      text,
      area,
      h(
        "div",
        { class: "row" },
        h(
          "button",
          {
            id: "save-text",
            onclick: () =>
              change(() => put("/settings", { sha256: now.sha256, text: area.value }), t("Saved.")),
          },
          t("Check and save"),
        ),
      ),
    );
    backups(kept, now, change);
  };
  const outputs = h("div", { class: "stack" });
  fill(
    place,
    h("div", { class: "head" }, h("h1", {}, t("Settings")), saved),
    problem,
    h(
      "div",
      { class: "even" },
      h(
        "div",
        { class: "stack" },
        panel(t("Notation and limits"), form),
        panel(t("Test output"), outputs),
      ),
      h(
        "div",
        { class: "stack" },
        panel(
          t("This screen"),
          h(
            "div",
            { class: "stack" },
            choice(t("Language"), Object.entries(LANGUAGES), language(), setLanguage),
            choice(
              t("Colours"),
              [
                ["auto", t("as the system")],
                ["dark", t("dark")],
                ["light", t("light")],
              ],
              theme(),
              setTheme,
            ),
            h(
              "p",
              { class: "small quiet" },
              t("Alt and a digit open a page; Tab, arrows and Enter do the rest."),
            ),
          ),
        ),
        panel(t("Connections"), connections(now.connections)),
        panel(t("Backup"), kept),
        panel(
          t("Folders"),
          table(
            [t("What"), t("Folder")],
            [
              [t("Station"), now.folder],
              [t("Recordings"), now.recordings],
            ],
          ),
        ),
        panel(
          t("Who may what"),
          table(
            [t("Who"), t("Permission")],
            [
              [
                t("This machine, with the address of this start"),
                t("Everybody may watch and stop. One person at a time may operate."),
              ],
              [
                t("Other machines"),
                t(
                  now.secured
                    ? "The same, with the password, over TLS"
                    : "No access: the screen serves only this machine",
                ),
              ],
              [
                t("Motions"),
                t(
                  store.motion?.may_move
                    ? "Who armed the robot and holds the button"
                    : "Nobody: the program was started without --allow-motion",
                ),
              ],
            ],
          ),
        ),
      ),
    ),
    panel("station.toml", text),
  );
  draw();
  return tryOutputs(outputs);
}

/** Links to other programs, as they were when the page was opened. */
function connections(links) {
  if (links.length === 0) {
    return h(
      "p",
      { class: "small quiet" },
      t(
        "None. --mqtt URI publishes state, jobs and results; --modbus ADDR serves registers to a PLC.",
      ),
    );
  }
  const state = (l) =>
    l.problem ?? t(l.peers.length > 0 ? "connected" : "waits for other programs");
  return table(
    [
      t("Door"),
      t("Address"),
      t("State"),
      t("Connected programs"),
      t("Messages"),
      t("Messages a second"),
      t("Not sent or refused"),
      t("Last error"),
    ],
    links.map((l) => [
      { mqtt: "MQTT", modbus: "Modbus TCP" }[l.door] ?? l.door,
      l.address,
      state(l),
      l.peers.join(", ") || "–",
      String(l.sent),
      num(l.rate_hz, 1),
      String(l.lost),
      l.last_error ?? "–",
    ]),
  );
}

/** Backups, made by hand and before each change; each can be downloaded or restored. */
function backups(place, now, change) {
  let sure = null;
  const list = h("div");
  const draw = () =>
    fill(
      list,
      now.backups.slice(0, 8).map((b) =>
        h(
          "div",
          { class: "light" },
          h("span", {}, ""),
          h(
            "span",
            {},
            h(
              "a",
              { href: url(`/backups/${encodeURIComponent(b.name)}`), download: b.name },
              b.name,
            ),
            h(
              "div",
              { class: "small quiet" },
              `${b.files} ${t("files")}, ${num(b.bytes / 1e3, 0, "kB")}`,
            ),
          ),
          h(
            "button",
            {
              class: "plain restore",
              onclick: () => {
                if (sure === b.name)
                  return change(
                    () => post(`/backups/${encodeURIComponent(b.name)}/restore`),
                    t("Restored; the previous state is a backup too."),
                  );
                sure = b.name;
                draw();
              },
            },
            t(sure === b.name ? "Really restore?" : "Restore"),
          ),
        ),
      ),
    );
  fill(
    place,
    h(
      "p",
      { class: "small quiet" },
      t(
        "Settings, calibrations, recipes and boards in one file, without jobs. One is made before each change.",
      ),
    ),
    h(
      "div",
      { class: "row" },
      h(
        "button",
        { id: "backup", onclick: () => change(() => post("/backups"), t("Backed up.")) },
        t("Back up now"),
      ),
      h(
        "a",
        { href: url("/support"), download: "sheetlight-support.json" },
        t("Support file (no pictures)"),
      ),
    ),
    list,
  );
  draw();
}

/**
 * Buttons that try each output of the robot's controller. A laser is switched on for a moment. The
 * gripper opens only at the second press.
 */
function tryOutputs(place) {
  const armed = h("div", { class: "stack" }),
    buttons = h("div", { class: "tools" }),
    said = h("div");
  const act = (name) =>
    attempt(async () => {
      if (!operating()) await operate(false);
      const { number } = await post("/robot/output", { output: name });
      fill(
        said,
        h(
          "p",
          { class: "small", role: "status" },
          `${t(OUTPUTS[name])}: ${t("output")} ${number} ${t("was switched")}`,
        ),
      );
    }, said);
  let sure = false,
    before = null;
  const draw = () => {
    const state = JSON.stringify([store.motion?.armed, store.bar?.running, sure]);
    if (state === before) return;
    before = state;
    fill(
      buttons,
      Object.entries(OUTPUTS).map(([name, words]) =>
        h(
          "button",
          {
            "data-output": name,
            disabled: !store.motion?.armed || !!store.bar?.running,
            onclick: () => {
              if (name === "open" && !sure) {
                sure = true;
                return draw();
              }
              sure = false;
              draw();
              act(name);
            },
          },
          t(name === "open" && sure ? "The part will drop. Open the gripper?" : words),
        ),
      ),
    );
  };
  fill(
    place,
    armed,
    buttons,
    h(
      "p",
      { class: "small quiet" },
      t(
        "Lasers and lamp for a second and a half; look away from the lasers. Nothing moves but the gripper.",
      ),
    ),
    said,
  );
  draw();
  const ends = [arming(armed), on("motion", draw), on("bar", draw)];
  return () => ends.forEach((end) => end());
}
