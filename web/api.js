// Requests to the laboratory's server, and its events. The documentation of what it answers is src/lab/api.rs.

import { set } from "./state.js";

const KEY = "misclosure-lab-token";

/** The token of the address; kept for this tab and taken out of the address, so that it is in no history and no picture
 * of the screen. */
function takeToken() {
  const address = new URL(location.href);
  const given = address.searchParams.get("token");
  if (given) {
    sessionStorage.setItem(KEY, given);
    address.searchParams.delete("token");
    history.replaceState(null, "", address);
  }
  return sessionStorage.getItem(KEY) ?? "";
}

const token = takeToken();

/** What went wrong with a request: `status` 0 where the server did not answer at all. */
export class RequestError extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

async function request(path, options = {}) {
  let response;
  try {
    response = await fetch(`/api/${path}`, { ...options, headers: { "x-token": token, ...options.headers } });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    set({ connection: "gone" });
    throw new RequestError("The server does not answer.", 0);
  }
  if (response.ok) {
    set({ connection: "open" });
    return response;
  }
  if (response.status === 401) set({ connection: "refused" });
  const answer = await response.json().catch(() => null);
  throw new RequestError(answer?.error ?? `The server answered ${response.status} to ${path}.`, response.status);
}

export const json = async (path, options) => (await request(path, options)).json();
export const text = async (path, options) => (await request(path, options)).text();
export const binary = async (path, options) => (await request(path, options)).arrayBuffer();

/** The tree, and with it the longest arrows of all its steps, which locked scales have to fit. */
export async function readTree() {
  const [tree, longest] = await Promise.all([json("tree"), text("longest")]);
  set({ tree, longest });
  return tree;
}

export function post(path, body = {}) {
  return json(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
}

/** Path with a query; what is null is left out, objects go as JSON. */
export function query(path, parameters) {
  const search = new URLSearchParams();
  for (const [key, value] of Object.entries(parameters)) {
    if (value === null || value === undefined) continue;
    search.set(key, typeof value === "object" ? JSON.stringify(value) : String(value));
  }
  const tail = search.toString();
  return tail ? `${path}?${tail}` : path;
}

/** An address that the browser itself opens: a report, a download. */
export const address = (path) => query(`/api/${path}`, { token });

/**
 * Listens to the server's events. A lost connection is said at once and tried again every second; a server that was
 * started anew has
 * another token, which only its own address can tell.
 */
export function listen(handlers) {
  const source = new EventSource(address("events"));
  for (const [name, handler] of Object.entries(handlers)) {
    source.addEventListener(name, (event) => handler(JSON.parse(event.data || "{}")));
  }
  source.onopen = () => {
    set({ connection: "open" });
    // A step that ended before anybody listened told nobody.
    handlers.tree({});
  };
  source.onerror = () => {
    source.close();
    set({ connection: "gone" });
    setTimeout(async () => {
      const answer = await fetch("/api/tree", { headers: { "x-token": token } }).catch(() => null);
      if (answer?.status === 401) return set({ connection: "refused" });
      listen(handlers);
    }, 1000);
  };
}
