// SPDX-License-Identifier: Apache-2.0
// The connection to the server: one WebSocket for requests and samples, opened again when it is
// lost. The page is one client of the server while it is open; what it moves stops with it.

const EVERY = "40ms"; // of the machine's time, from sample to sample
const RETRY_MS = 500;
const BEAT_MS = 1000; // between two requests that show whether the server is there
const PATIENCE_MS = 4000; // with the answer to one of them
const STOP_MS = 300; // after which a stop that is not answered is sent in the other way, too
const KEPT = "moire-token";

/** A request that the server has refused, or that it did not get. */
export class Refusal extends Error {
  constructor(values, status) {
    super(values.text);
    Object.assign(this, { cause: values.cause, to_do: values.to_do, owner: values.owner, status });
  }
}

const gone = () =>
  new Refusal({ cause: "lost", text: "the server is lost", to_do: "wait until it is back" }, 0);

/** The path of an axis, from its name such as "1.0". */
export function pathOf(name) {
  const [node, axis] = name.split(".");
  return `/api/nodes/${node}/axes/${axis}`;
}

const MOST_AXES = 32; // of a stream
const addressesOf = (nodes) => nodes.filter((node) => node.axes).map((node) => node.address);
const axesOf = (nodes) => nodes.flatMap((node) => node.axes ?? []).slice(0, MOST_AXES);

export class Link {
  /** `on` has the functions connecting, open(server, axes, addresses), lost(reason), needsToken(refusal),
   *  samples(rows), beat(server). */
  constructor(on) {
    this.on = on;
    this.socket = null;
    this.waiting = new Map(); // requests without an answer, by number
    this.numbers = 0;
    const given = new URLSearchParams(location.hash.slice(1)).get("token");
    if (given) {
      history.replaceState(null, "", location.pathname);
      sessionStorage.setItem(KEPT, given);
    }
    this.token = sessionStorage.getItem(KEPT) ?? "";
  }

  useToken(token) {
    this.token = token;
    sessionStorage.setItem(KEPT, token);
    this.connect();
  }

  get isOpen() {
    return this.socket !== null && this.socket.readyState === WebSocket.OPEN;
  }

  async connect() {
    try {
      const server = await this.http("GET", "/api");
      const { nodes } = await this.http("GET", "/api/nodes");
      this.open(server, axesOf(nodes), addressesOf(nodes));
    } catch (error) {
      if (error.status === 401) {
        sessionStorage.removeItem(KEPT);
        this.on.needsToken(error, this.token !== "");
        return;
      }
      this.on.lost(error.status ? error.message : "");
      setTimeout(() => this.connect(), RETRY_MS);
    }
  }

  /** Asks again which axes there are. */
  async lookAgain() {
    const { nodes } = await this.request("GET", "/api/nodes");
    const axes = axesOf(nodes);
    if (!axes.length) return;
    this.socket.send(JSON.stringify({ stream: { axes: axes.join(","), every: EVERY } }));
    this.on.open(await this.request("GET", "/api"), axes, addressesOf(nodes));
  }

  open(server, axes, addresses) {
    const query = new URLSearchParams({ axes: axes.join(","), every: EVERY });
    if (this.token) query.set("token", this.token);
    const socket = new WebSocket(`${location.origin.replace("http", "ws")}/api/stream?${query}`);
    this.socket = socket;
    let beat = 0;
    socket.onopen = () => {
      this.on.open(server, axes, addresses);
      beat = setInterval(() => this.beat(socket), BEAT_MS);
    };
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = () => {
      clearInterval(beat);
      if (this.socket !== socket) return;
      this.socket = null;
      const left = [...this.waiting.values()];
      this.waiting.clear();
      for (const { reject } of left) reject(gone());
      this.on.lost("");
      setTimeout(() => this.connect(), RETRY_MS);
    };
  }

  /** Asks for something small: without an answer the connection is given up. */
  beat(socket) {
    const patience = setTimeout(() => this.giveUp(socket), PATIENCE_MS);
    this.request("GET", "/api")
      .then((server) => this.on.beat(server))
      .catch(() => {})
      .finally(() => clearTimeout(patience));
  }

  giveUp(socket) {
    socket.close();
    socket.onclose?.(); // the other end may not be there to close it with
    socket.onclose = null;
  }

  take(message) {
    if (message.samples) {
      this.on.samples(message.samples);
      return;
    }
    const asked = this.waiting.get(message.id);
    if (!asked) return;
    this.waiting.delete(message.id);
    if (message.error) asked.reject(new Refusal(message.error, message.status));
    else asked.resolve(message.answer);
  }

  /** The answer to a request over the WebSocket; throws Refusal. */
  request(method, path, body) {
    if (!this.isOpen) return Promise.reject(gone());
    const id = ++this.numbers;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.socket.send(JSON.stringify({ id, method, path, body }));
    });
  }

  /** The answer to a request over HTTP; throws Refusal. */
  async http(method, path, more = {}) {
    const headers = this.token ? { Authorization: `Bearer ${this.token}` } : {};
    const options = { method, headers, cache: "no-store", signal: AbortSignal.timeout(5000) };
    let response;
    try {
      response = await fetch(path, { ...options, ...more });
    } catch {
      throw gone();
    }
    const values = await response.json();
    if (!response.ok) throw new Refusal(values.error, response.status);
    return values;
  }

  /** Stops an axis by the WebSocket, and by HTTP where that does not answer at once. */
  async stop(name) {
    const path = `${pathOf(name)}/stop`;
    const other = () => this.http("POST", path, { keepalive: true });
    if (!this.isOpen) return other();
    let late;
    const second = new Promise((resolve, reject) => {
      late = setTimeout(() => other().then(resolve, reject), STOP_MS);
    });
    try {
      return await Promise.any([this.request("POST", path), second]);
    } catch (error) {
      throw error.errors?.[0] ?? error;
    } finally {
      clearTimeout(late);
    }
  }
}
