// SPDX-License-Identifier: Apache-2.0
// The page as a whole: the connection, the axes, the stop of all of them, the plots, the panels.

import { AxisView } from "./axis.js";
import { BusPanel } from "./bus.js";
import { CalibrationPanel } from "./calibration.js";
import { History, QUANTITIES } from "./history.js";
import { releaseAll } from "./hold.js";
import { JobPanel } from "./job.js";
import { Link } from "./link.js";
import { LivePlot } from "./live.js";
import { ParameterTable } from "./parameters.js";
import { ScopePanel } from "./scope.js";
import { SetupPanel } from "./setup.js";
import { SignalPanel } from "./signal.js";

const DRAW_MS = 80; // between two pictures of the plots
const DESCRIBE_MS = 2000; // between two descriptions of them in words
const at = (id) => document.getElementById(id);

const views = new Map(); // axes by their names
const histories = new Map();
let mayChange = false;
let beats = 0;

const link = new Link({
  open(server, names, nodes) {
    mayChange = server.may_change;
    at("access").hidden = true;
    at("lost").hidden = true;
    at("empty").hidden = names.length > 0;
    at("stop").hidden = !mayChange || names.length === 0;
    at("plots").hidden = names.length === 0;
    document.body.classList.remove("stale");
    document.querySelector(".keys").hidden = !mayChange;
    setLink("connected", mayChange ? "connected" : "connected, read only");
    if (names.join() !== [...views.keys()].join()) build(names);
    for (const [name, view] of views) {
      view.mayChange(mayChange);
      view.call(server.names[name]);
      view.readLimits().catch((error) => view.fail(error, null));
    }
    parameters.open([...views.keys()], mayChange);
    scope.open([...views.keys()], mayChange);
    signal.open([...views.keys()]);
    calibration.open([...views.keys()], mayChange);
    setup.open([...views.keys()], mayChange);
    job.open(nodes, mayChange).catch(() => {});
    bus.read().catch(() => {});
    showServer(server);
  },
  lost(reason) {
    releaseAll();
    at("stop").hidden = true;
    document.body.classList.add("stale");
    setLink("lost", "not connected");
    at("lost").hidden = false;
    at("lost").textContent =
      `The server is lost${reason ? ` (${reason})` : ""}: what is shown is old. What this page ` +
      "moved is being stopped by the server or by the watchdog of the node. The page connects " +
      "again as soon as it can.";
  },
  needsToken(refusal, wasGiven) {
    setLink("token", "needs a token");
    at("lost").hidden = true;
    at("access").hidden = false;
    at("access-text").textContent = wasGiven ? `${refusal.message}.` : "";
    at("access").elements.token.focus();
  },
  samples(rows) {
    for (const row of rows) {
      const name = `${row.address}.${row.axis}`;
      const view = views.get(name);
      if (!view) continue;
      view.show(row);
      setup.show(row);
      if (!row.error && !frozen) histories.get(name).add(row);
    }
  },
  beat(server) {
    showServer(server);
    bus.read().catch(() => {}); // a lost server is shown by what asks on
    job.read().catch(() => {});
    if (++beats % 2 === 0) {
      for (const view of views.values()) view.readSpeed().catch(() => {});
    }
    if (views.size === 0 && beats % 2 === 0) link.lookAgain().catch(() => {});
  },
});
const parameters = new ParameterTable(at("parameters"), link);
const scope = new ScopePanel(at("scope"), link);
const signal = new SignalPanel(at("signal"), link);
const bus = new BusPanel(at("bus"), link);
const calibration = new CalibrationPanel(at("calibration"), link);
const job = new JobPanel(at("job"), link);
const setup = new SetupPanel(at("setup"), link);

function setLink(state, text) {
  at("link").dataset.state = state;
  at("link").textContent = text;
}

function showServer(server) {
  at("speed").textContent =
    server.speed === null ? "" : `simulated machine at ${server.speed.toFixed(2)} × real time`;
}

function build(names) {
  views.clear();
  histories.clear();
  for (const name of names) {
    views.set(name, new AxisView(name, link));
    histories.set(name, new History());
  }
  at("axes").replaceChildren(...[...views.values()].map((view) => view.element));
  at("legend").replaceChildren(
    ...names.map((name, number) => {
      const item = document.createElement("li");
      item.className = `series-${(number % 4) + 1}`;
      item.textContent = `axis ${name}`;
      return item;
    }),
  );
}

// ------------------------------------------------------------------ stop

function stopAll() {
  releaseAll();
  if (!mayChange) return;
  for (const view of views.values()) view.stop();
}

at("stop").addEventListener("pointerdown", stopAll); // sooner than a click
at("stop").addEventListener("click", (event) => event.detail === 0 && stopAll());
for (const name of ["keydown", "keyup", "keypress"]) {
  document.addEventListener(
    name,
    (event) => {
      if (event.key !== " " || !mayChange) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      if (name === "keydown" && !event.repeat) stopAll();
    },
    true,
  );
}

document.addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || event.target.type !== "checkbox") return;
  event.preventDefault(); // the space bar, which would do this, stops the axes
  event.target.click();
});

at("access").addEventListener("submit", (event) => {
  event.preventDefault();
  const { token } = event.target.elements;
  link.useToken(token.value.trim());
  token.value = "";
});

// ------------------------------------------------------------------ plots

const plots = QUANTITIES.map(
  (quantity, index) => new LivePlot(quantity, index + 1, at("charts")),
);
let frozen = false;
let drawn = 0;
let described = -Infinity;

at("freeze").addEventListener("click", () => {
  frozen = !frozen;
  at("freeze").setAttribute("aria-pressed", String(frozen));
});

function draw(now) {
  requestAnimationFrame(draw);
  if (now - drawn < DRAW_MS || at("plots").hidden) return;
  drawn = now;
  const span = Number(at("span").value);
  const end = Math.max(...[...histories.values()].map((history) => history.end ?? 0));
  const columns = [...histories.values()].map((history) => history.since(end - span));
  for (const plot of plots) plot.show(columns, end, span);
  if (now - described < DESCRIBE_MS) return;
  described = now;
  for (const plot of plots) plot.say([...histories.keys()], columns, span);
}

requestAnimationFrame(draw);
link.connect();
