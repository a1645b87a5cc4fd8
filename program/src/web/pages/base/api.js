// In: paths and messages (docs/messages.d.ts). Out: answers; faults as errors with their four
// sentences. Only this module talks to the server.

const ROOT = "/api/v1";

/** Longest wait for a tab name, ms: a page that hangs keeps its name but does not answer. */
const STUCK = 10000;
/**
 * Reserves a tab name until this page closes. Resolves to false if another page answers that it has
 * the name, or still holds it after `STUCK`. A page that is closing does not answer, and its lock
 * is free a moment later.
 */
const takes = (name) =>
  new Promise((done) => {
    const others = new BroadcastChannel(`tab-${name}`),
      wait = new AbortController();
    let taken = false;
    // Resolved here, not by the request's rejection: Chromium 156 forgets an abort that arrives
    // while it still prepares the request.
    const refuse = () => {
      if (taken) return;
      wait.abort();
      others.close();
      done(false);
    };
    const grant = () => {
      if (wait.signal.aborted) return null;
      taken = true;
      others.onmessage = (m) => m.data === "whose" && others.postMessage("mine");
      done(true);
      return new Promise(() => {});
    };
    navigator.locks.request(`tab-${name}`, { signal: wait.signal }, grant).catch(refuse);
    others.onmessage = (m) => m.data === "mine" && refuse();
    others.postMessage("whose");
    setTimeout(refuse, STUCK);
  });
/**
 * This tab's name, by which the server knows it; it survives a reload. A copied tab gets a new name,
 * because two tabs with one name could both hold the same button.
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

/** A fault that the server reported; status 0 if the server does not answer. */
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
/** Sends a text over the WebSocket; false if the socket is not open. */
export function say(text) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(text);
  return true;
}
/**
 * Receives the server's events while the page is open, and reconnects when the socket closes.
 * Resolves at the first message, which holds the whole state, or when the socket closes. A page
 * that is drawn earlier would show that there are no jobs.
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
