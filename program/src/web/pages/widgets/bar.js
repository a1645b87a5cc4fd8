// In: the bar's message. Out: the bar that every page shows: source of the pictures, robot, stop,
// the tab that operates, alarms.

import { post, tab } from "../base/api.js";
import { fill, h, num } from "../base/dom.js";
import { t } from "../base/text.js";
import { jobs, on, store, tell } from "../base/store.js";
import { attempt } from "./problem.js";

const ROBOT = {
  no_link: ["no link", ""],
  read_only: ["linked, not armed", ""],
  armed: ["armed", "good"],
  moving: ["moving", "poor"],
};

/** Whether this tab holds the lease. */
export const operating = () => store.bar?.lease.holder === tab.slice(0, 4);

/** Takes the lease if no other tab holds it; with `firmly` also from another tab. */
export async function operate(firmly = false) {
  await post("/lease", { firmly });
}

export async function stopAll() {
  await attempt(() => post("/stop"));
  tell("stop");
}

export function bar(place) {
  const main = h("div", { class: "bar-main" });
  const cells = h("div", { class: "bar-cells" });
  fill(place, main, cells);
  const stop = h("button", { class: "stop", id: "stop", onclick: stopAll }, "STOP");
  const lease = h("button", { id: "lease", onclick: () => attempt(() => operate(true)) });
  const mode = h("span", { class: "badge" }),
    name = h("span", { class: "bar-name" });
  const robot = h("span", { class: "pill" }),
    laser = h("span", { class: "pill" });
  const running = h("span", { class: "bar-job grow" });
  fill(main, mode, name, robot, laser, running, lease, stop);
  const draw = () => {
    const b = store.bar;
    if (!b) return;
    document.documentElement.dataset.mode = b.mode;
    mode.className = `badge ${b.mode}`;
    mode.textContent = t({ live: "LIVE", replay: "REPLAY", simulated: "SIMULATED" }[b.mode]);
    name.textContent = b.station;
    const [word, state] = ROBOT[b.robot];
    robot.className = `pill ${state}`;
    robot.textContent = `${t("Robot")}: ${t(word)}`;
    laser.textContent = `${t("Laser")}: ${b.laser === null ? t("not switched here") : t(b.laser ? "on" : "off")}`;
    laser.className = `pill ${b.laser ? "bad" : ""}`;
    lease.textContent = operating()
      ? `✓ ${t("You operate")}`
      : b.lease.holder
        ? `${t("Take over from")} ${b.lease.holder}`
        : t("Operate");
    lease.setAttribute("aria-pressed", String(operating()));
    const dropped = Object.values(b.frames.dropped).reduce((a, n) => a + n, 0);
    const why = Object.entries(b.frames.dropped)
      .map(([k, n]) => `${k}: ${n}`)
      .join("\n");
    const c = b.calibration;
    fill(
      cells,
      cell(
        t("Frames"),
        `${b.frames.seen} / ${b.frames.measured} / ${dropped}`,
        `${t("in / measured / dropped")}\n${why}`,
      ),
      cell(
        t("Delay"),
        b.delay_ms ? `${num(b.delay_ms[0], 0)} / ${num(b.delay_ms[1], 0)} ms` : "–",
        "p50 / p99",
      ),
      cell(
        "GPU",
        b.adapter_is_software ? `${t("software")}, ${b.adapter}` : b.adapter,
        "",
        b.adapter_is_software ? "amber" : "",
      ),
      cell(
        t("Calibration"),
        c
          ? `${t(c.verdict)}${c.verdict === "good" ? "" : ` (${t(c.worst)})`}, ${age(c.days)}` +
              (c.expected_mm === null ? "" : `, ${num(c.expected_mm, 3)} mm`)
          : t("missing"),
        "",
        c && c.verdict === "good" ? "" : "amber",
      ),
      cell(t("Disk"), b.disk_left_gb === null ? "–" : num(b.disk_left_gb, 0, "GB")),
      store.lost && h("span", { class: "alarm", role: "alert" }, t("The program does not answer.")),
      b.alarms.length > 0 &&
        h(
          "span",
          { class: "alarm", role: "alert", title: b.alarms.join("\n") },
          `⚠ ${b.alarms.join(" · ")}`,
        ),
    );
    work();
  };
  const advance = h("progress"),
    count = h("span");
  let shown = null;
  const work = () => {
    const now = jobs((j) => j.state === "running")[0];
    if (shown !== now?.id) {
      shown = now?.id;
      advance.removeAttribute("value");
      advance.setAttribute("aria-label", shown ?? "");
      fill(
        running,
        now && [h("a", { href: `#/${pageOf(now)}?job=${shown}` }, shown), advance, count],
      );
    }
    if (!now) return;
    if (now.of) [advance.max, advance.value] = [now.of, now.done];
    count.textContent = now.of ? `${now.done} / ${now.of}` : `${now.done}`;
  };
  on("bar", draw);
  on("lost", draw);
  // A job's progress is drawn with the rest of the bar, once a second. Drawing it separately
  // would cost two browsers on the station 1 % of two cores, which the job needs. A job that
  // begins or ends is shown at once.
  on("jobs", () => {
    if (jobs((j) => j.state === "running")[0]?.id !== shown) work();
  });
  addEventListener("language", draw);
  draw();
}

function cell(name, value, title = "", mark = "") {
  return h("span", { class: "cell", title }, `${name} `, h("b", { class: mark }, value));
}

const age = (days) => (days < 1 ? t("today") : `${Math.round(days)} d`);

/** The page that shows a job of this kind. */
export function pageOf(job) {
  return {
    check: "station",
    tune: "picture",
    scan: "scan",
    filter: "surface",
    find: "position",
    teach: "part",
    touch: "touch",
    calibrate: "calibrate",
    joint: "calibrate",
    auto: "calibrate",
    insert: "position",
    benchmark: "health",
  }[job.order.procedure];
}
