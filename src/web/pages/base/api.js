// In: paths and messages (docs/messages.d.ts). Out: answers; faults as errors with their four
// sentences. Only this module talks to the server.

const ROOT = "/api/v1";

/** A page that is stuck does not say that it lives under a name: it is waited for so long, ms. */
const STUCK = 10000;
/**
 * Takes a name for as long as this page lives; false where another page lives under it, which says
 * so. One that is being left says nothing, and its name is free in a moment.
 */
const takes = (name) =>
  new Promise((done) => {
    const others = new BroadcastChannel(`tab-${name}`),
      lives = new AbortController();
    const taken = () => {
      others.onmessage = (m) => m.data === "whose" && others.postMessage("mine");
      done(true);
      return new Promise(() => {});
    };
    navigator.locks.request(`tab-${name}`, { signal: lives.signal }, taken).catch(() => {
      others.close();
      done(false);
    });
    others.onmessage = (m) => m.data === "mine" && lives.abort();
    others.postMessage("whose");
    setTimeout(() => lives.abort(), STUCK);
  });
/**
 * This tab's name: it operates or watches by it, also after a reload. A copied tab gets one of its
 * own: two that share a name would hold one button.
 */
export const tab = await (async () => {
  let name = sessionStorage.getItem("tab");
  while (!name || !(await takes(name)))
    name = Array.from(crypto.getRandomValues(new Uint8Array(8)), (b) =>
      b.toString(16).padStart(2, "0"),
    ).join("");
  sessionStorage.setItem("tab", name);
  return name;
})();

/** A fault of the server. */
export class Problem extends Error {
  constructor(status, problem) {
    super(problem.what);
    this.status = status;
    this.problem = problem;
  }
}

async function send(method, path, body) {
  const headers = { "X-Sheetlight-Tab": tab };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer;
  try {
    answer = await fetch(ROOT + path, {
      method,
      headers,
      body: body === undefined ? undefined : JSON.stringify(body),
      cache: "no-store",
    });
  } catch {
    throw new Problem(0, {
      kind: "output",
      what: "the program does not answer",
      cause: "it was ended, or the network is down",
      next: "start it again; jobs are kept",
    });
  }
  if (answer.ok) return answer;
  const said = await answer.json().catch(() => null);
  throw new Problem(
    answer.status,
    said?.error ?? { kind: "input", what: `the server said ${answer.status}`, cause: "", next: "" },
  );
}

export const get = async (path) => (await send("GET", path)).json();
export const post = async (path, body) => (await send("POST", path, body ?? {})).json();
export const put = async (path, body) => (await send("PUT", path, body)).json();
export const remove = async (path) => (await send("DELETE", path)).json();
export const bytes = async (path) => (await send("GET", path)).arrayBuffer();

/** Address of a picture or a file. */
export const url = (path) => ROOT + path;
export const picture = (recording, frame, width, light) =>
  url(
    `/picture?recording=${encodeURIComponent(recording)}&frame=${frame}` +
      (width ? `&width=${width}` : "") +
      (light ? `&light=${light}` : ""),
  );

let socket = null;
/** Says something over the socket; false where it is not open. */
export function say(text) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(text);
  return true;
}
/**
 * Listens to the server for as long as the page is open; opens the socket again where it breaks.
 * Done when the server has told how things stand, or the socket broke: a page that is drawn before
 * would say that there is nothing.
 */
export const listen = ({ event, rows, lost }) =>
  new Promise((told) => {
    let wait = 300;
    const open = () => {
      socket = new WebSocket(
        `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${ROOT}/events?tab=${tab}`,
      );
      socket.binaryType = "arraybuffer";
      socket.onopen = () => {
        wait = 300;
        lost(false);
      };
      socket.onmessage = (m) => {
        if (typeof m.data !== "string") return rows(m.data);
        event(JSON.parse(m.data));
        told();
      };
      socket.onclose = async () => {
        lost(true);
        told();
        try {
          await get("/session");
        } catch (e) {
          // The program was restarted: this page's address is no longer valid.
          if (e.status === 401) return lost("over");
        }
        setTimeout(open, (wait = Math.min(wait * 1.6, 5000)));
      };
    };
    open();
  });
