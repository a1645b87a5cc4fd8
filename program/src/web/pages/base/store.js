// In: events of the server. Out: the present bar, jobs and growing map; listeners are called at
// each change.

/** @typedef {import("../../../../../docs/messages").Bar} Bar */
/** @typedef {import("../../../../../tools/pages/types").AnyJob} Job */

export const store = {
  /** @type {Bar | null} */ bar: null,
  /** @type {Map<string, Job>} */ jobs: new Map(),
  /** @type {import("../../../../../docs/messages").MotionState | null} */ motion: null,
  /** Height map of the running scan: { job, columns, total, done, heights }. */ growing: null,
  /** Whether the connection is lost; "over" if the session has ended. */ lost: false,
};

const ears = new Map();

/**
 * Calls `hear` at each event `what`: bar, jobs, motion, rows, lost, problem, stop. Returns a
 * function that removes the listener.
 */
export function on(what, hear) {
  if (!ears.has(what)) ears.set(what, new Set());
  ears.get(what).add(hear);
  return () => ears.get(what).delete(hear);
}

export function tell(what, value) {
  for (const hear of [...(ears.get(what) ?? [])]) hear(value);
}

/** The jobs for which `keep` is true, newest first. @param {(job: Job) => boolean} keep */
export function jobs(keep = () => true) {
  return [...store.jobs.values()].filter(keep).sort((a, b) => (a.id < b.id ? 1 : -1));
}
/**
 * The finished jobs of a procedure, newest first.
 * @template {import("../../../../../docs/messages").Order["procedure"]} P
 * @param {P} procedure
 * @returns {import("../../../../../tools/pages/types").Done<P>[]}
 */
export const done = (procedure) =>
  /** @type {any} */ (jobs((j) => j.order.procedure === procedure && j.state === "done"));
/** Finished scans, including filtered ones, newest first. */
export const scans = () =>
  jobs((j) => ["scan", "filter"].includes(j.order.procedure) && j.state === "done");
export const busy = () => jobs((j) => j.state === "running" || j.state === "queued").length > 0;

export function take(event) {
  const { data } = event;
  switch (event.event) {
    case "state":
      store.bar = data.bar;
      store.jobs = new Map(data.jobs.map((j) => [j.id, j]));
      store.motion = data.motion;
      tell("bar");
      tell("jobs", null);
      tell("motion");
      break;
    case "motion":
      store.motion = data;
      tell("motion");
      break;
    case "bar":
      store.bar = data;
      tell("bar");
      break;
    case "job":
      store.jobs.set(data.id, data);
      tell("jobs", data);
      break;
    case "gone":
      store.jobs.delete(data);
      tell("jobs", null);
      break;
  }
}

/** Stores received rows of the running scan's height map (program/src/web/event/growing.rs). */
export function takeRows(buffer) {
  const [, job, columns, total, from, rows] = new Uint32Array(buffer, 0, 6);
  if (!store.growing || store.growing.job !== job || from === 0) {
    store.growing = {
      job,
      columns,
      total,
      done: 0,
      heights: new Float32Array(columns * total).fill(NaN),
    };
  }
  store.growing.heights.set(new Float32Array(buffer, 24, rows * columns), from * columns);
  store.growing.done = Math.max(store.growing.done, from + rows);
  tell("rows");
}
