// SPDX-License-Identifier: Apache-2.0
// The scope: settings of a record or of a stream, its progress, its signals over time and as spectra,
// cursors, CSV. A node with a recorder of ticks is recorded with it, any other one with its scope.

import { Chart } from "./chart.js";
import { sentence, signed } from "./format.js";
import { pathOf } from "./link.js";

const LOOK_MS = 200; // between two questions how far a record is
const TRIGGERS = {
  now: "at once",
  motion: "the axis moves or homes",
  settling: "settling begins",
  error: "the error reaches a level",
  fault: "a fault latches",
};
const AT_FIRST = ["target", "error", "command"]; // signals of a record of ticks
const LEVELS = { bits: "", rises: "1 um", falls: "1 um", beyond: "1 um" }; // with the error
const UNITS = [ // of the ends of names of columns: unit, scale, digits
  ["_nm_per_s", "mm/s", 1e-6, 4],
  ["error_nm", "µm", 1e-3, 4],
  ["_nm", "mm", 1e-6, 6],
  ["_of_full_scale", "%", 100, 2],
  ["drive_command", "%", 100, 2],
  ["_counts", "counts", 1, 0],
  ["_periods", "periods", 1, 4],
  ["_bits", "bits", 1, 0],
];

/** The signal of a column: its name in words, unit, scale, digits. */
function signalOf(key, number) {
  const [end, unit, scale, digits] = UNITS.find(([one]) => key.endsWith(one));
  const name = (end.startsWith("_") ? key.slice(0, -end.length) : key.replace(/_nm$/, ""))
    .replace(/_/g, " ")
    .replace(/^\w/, (letter) => letter.toUpperCase());
  return { name, key, unit, scale, digits, series: number };
}
const POSITION_SHARES = [0, 10, 25, 50, 90]; // of the samples, before the trigger
const COUNTS = [128, 64, 32, 16]; // samples of the scope of a node

const choices = (list) => list.map(([value, text]) => `<option value="${value}">${text}</option>`);

export class ScopePanel {
  constructor(section, link) {
    Object.assign(this, { section, link, record: null, cursors: [0, 0], turn: 0 });
    Object.assign(this, { signals: [], charts: [], boxes: [], recorder: { words: 0 } });
    section.innerHTML = `
      <div class="bar"><h2 id="scope-title">Scope</h2></div>
      <form class="row">
        <label>Axis <select name="axis"></select></label>
        <label data-field="recorder" hidden>Recorder <select name="recorder">
          <option value="ticks">each servo tick</option>
          <option value="scope">128 samples</option></select></label>
        <div class="signals" data-of="ticks" role="group" aria-label="Recorded signals"></div>
        <label>Trigger <select name="trigger"></select></label>
        <label data-of="ticks">of <select name="of"></select></label>
        <label data-field="level">Level <input name="level" size="8" autocomplete="off" spellcheck="false"></label>
        <label>Trigger at <select name="share">${choices(
          POSITION_SHARES.map((one) => [one, `${one} % of the record`]),
        ).join("")}</select></label>
        <label data-of="ticks">Delay <input name="delay" size="6" value="0ms" autocomplete="off" spellcheck="false"></label>
        <label data-of="scope">Samples <select name="samples">${choices(COUNTS.map((one) => [one, one])).join("")}</select></label>
        <label data-of="ticks">Samples <input name="count" type="number" min="16" value="1000"></label>
        <label>One every <input name="every" size="6" autocomplete="off" spellcheck="false"></label>
        <button type="submit" data-do="record">Record</button>
        <label data-of="ticks">Duration <input name="duration" size="6" value="10s" autocomplete="off" spellcheck="false"></label>
        <button type="button" data-of="ticks" data-do="stream">Stream</button>
        <button type="button" data-do="cancel" hidden>Give up</button>
        <button type="button" data-do="take" hidden>Take the scope over</button>
      </form>
      <progress aria-label="Samples read" hidden></progress>
      <p class="message" role="status"></p>
      <div data-field="result" hidden>
        <div class="row" role="group" aria-label="What is shown">
          <span data-field="shown"></span>
          <label>Shown <select name="view">
            <option value="time">over time</option><option value="spectrum">as spectrum</option>
          </select></label>
          <button type="button" data-do="csv">Export CSV</button>
        </div>
        <p class="note" data-field="note"></p>
        <div class="charts"></div>
        <div class="row cursors" role="group" aria-label="Cursors">
          <label>Cursor A <input type="range" name="a" min="0"></label>
          <label>Cursor B <input type="range" name="b" min="0"></label>
        </div>
        <div class="table"><table><caption>Cursors</caption>
          <thead><tr><th scope="col">Quantity</th><th scope="col">A</th><th scope="col">B</th>
            <th scope="col">B − A</th></tr></thead>
          <tbody></tbody></table></div>
      </div>`;
    const find = (selector) => section.querySelector(selector);
    this.form = find("form");
    this.message = find(".message");
    this.progress = find("progress");
    this.result = find("[data-field=result]");
    this.note = find("[data-field=note]");
    this.rows = find("tbody");
    this.view = find("[name=view]");
    this.sliders = [find("[name=a]"), find("[name=b]")];
    this.buttons = Object.fromEntries(
      ["record", "stream", "cancel", "take", "csv"].map((name) => [name, find(`[data-do=${name}]`)]),
    );
    this.pictures = find(".charts");
    this.shown = find("[data-field=shown]");
    this.connectControls();
    this.choose();
  }

  connectControls() {
    const { axis, recorder, trigger, of } = this.form.elements;
    axis.onchange = () => this.ask();
    recorder.onchange = () => this.choose();
    trigger.onchange = () => this.showLevel();
    of.onchange = () => this.showLevel();
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.begin(false, false);
    });
    this.buttons.stream.onclick = () => this.begin(false, true);
    this.buttons.take.onclick = () => this.begin(true, this.streams);
    this.buttons.cancel.onclick = () => this.giveUp();
    this.buttons.csv.onclick = () => this.save();
    this.view.onchange = () => this.show();
    this.sliders.forEach((slider, number) => {
      slider.oninput = () => this.moveCursor(number, Number(slider.value));
    });
  }

  open(names, mayChange) {
    this.section.hidden = names.length === 0 || !mayChange;
    const { axis } = this.form.elements;
    if (names.join() !== [...axis.options].map((one) => one.value).join()) {
      axis.replaceChildren(...names.map((name) => new Option(name)));
      if (names.length > 0 && mayChange) this.ask();
    }
  }

  // ---------------------------------------------------------------- what can be recorded

  /** Asks what the node of the axis can record. */
  async ask() {
    const name = this.form.elements.axis.value;
    try {
      const found = await this.link.request("GET", `${pathOf(name)}/ticks/recorder`);
      if (name !== this.form.elements.axis.value) return;
      this.recorder = found;
    } catch (error) {
      this.say(sentence(error), true);
      return;
    }
    const { recorder, of, count } = this.form.elements;
    recorder.value = this.recorder.words > 0 ? "ticks" : "scope";
    this.section.querySelector("[data-field=recorder]").hidden = this.recorder.words === 0;
    count.max = this.recorder.words;
    const known = Object.entries(this.recorder.signals);
    of.replaceChildren(...known.map(([signal]) => new Option(signal)));
    of.value = "error";
    const own = Number(name.split(".").at(-1));
    const axes = [...Array(this.recorder.axes).keys()];
    axes.sort((a, b) => (b === own) - (a === own) || a - b);
    this.section.querySelector(".signals").innerHTML = axes
      .map((number) => {
        const rows = known.map(([signal, what]) => {
          const value = number === own ? signal : `${number}.${signal}`;
          const checked = number === own && AT_FIRST.includes(signal) ? " checked" : "";
          return `<label title="${what}"><input type="checkbox" name="signal" value="${value}"${checked}> ${value}</label>`;
        });
        const open = number === own ? " open" : "";
        return `<details${open}><summary>Signals of axis ${number}</summary>${rows.join(" ")}</details>`;
      })
      .join("");
    this.choose();
  }

  /** Shows the settings of the recorder that is chosen. */
  choose() {
    const { recorder, trigger, every } = this.form.elements;
    const isTicks = this.isTicks;
    for (const one of this.section.querySelectorAll("[data-of]")) {
      one.hidden = one.dataset.of !== (isTicks ? "ticks" : "scope");
      for (const input of one.querySelectorAll("input")) input.disabled = one.hidden;
    }
    const words = isTicks ? this.recorder.triggers : TRIGGERS;
    const names = Object.keys(words).join();
    if (names !== [...trigger.options].map((one) => one.value).join()) {
      trigger.replaceChildren(...Object.entries(words).map(([name, what]) => new Option(what, name)));
      every.value = isTicks ? `${Number((1e6 * this.recorder.tick_s).toFixed(3))}us` : "1ms";
    }
    this.showLevel();
  }

  get isTicks() {
    return this.form.elements.recorder.value === "ticks" && this.recorder.words > 0;
  }

  /** Shows the level where the trigger has one, at first one of the error. */
  showLevel() {
    const { trigger, of, level } = this.form.elements;
    const label = this.section.querySelector("[data-field=level]");
    label.hidden = this.isTicks ? trigger.value === "now" : trigger.value !== "error";
    const first = this.isTicks && of.value !== "error" ? "" : (LEVELS[trigger.value] ?? "1 um");
    if (!label.hidden && label.dataset.shown !== `${trigger.value} ${of.value}`) level.value = first;
    if (!label.hidden) label.dataset.shown = `${trigger.value} ${of.value}`;
  }

  say(text, isWrong = false) {
    if (this.message.textContent !== text) this.message.textContent = text;
    this.message.classList.toggle("wrong", isWrong);
  }

  /** Shows that a record is being waited for, or not. */
  wait(waits) {
    this.turn += 1; // what was waited for before is not any more
    this.buttons.record.disabled = this.buttons.stream.disabled = waits;
    this.buttons.cancel.hidden = !waits;
    this.buttons.take.hidden = true;
    this.progress.hidden = !waits;
    this.progress.removeAttribute("value");
  }

  // ---------------------------------------------------------------- a record

  async begin(take, streams) {
    this.streams = streams;
    const { axis } = this.form.elements;
    const path = `${pathOf(axis.value)}/${this.isTicks ? "ticks" : "scope"}`;
    try {
      const body = { ...(this.isTicks ? this.tickSettings(streams) : this.settings()), take };
      this.say("");
      const { number } = await this.link.request("POST", path, body);
      this.wait(true);
      this.record = null;
      this.buttons.cancel.textContent = streams ? "End the stream" : "Give up";
      await this.follow(path, axis.value, number, this.isTicks);
    } catch (error) {
      this.wait(false);
      this.say(sentence(error), true);
      this.buttons.take.hidden = error.cause !== "scope_in_use";
    }
  }

  /** How many of so many samples are to be from before the trigger. */
  before(samples) {
    const share = Number(this.form.elements.share.value) / 100;
    return Math.min(Math.round(share * samples), samples - 1);
  }

  settings() {
    const { trigger, level, samples, every } = this.form.elements;
    const count = Number(samples.value);
    const body = { trigger: trigger.value, before: this.before(count), samples: count };
    body.every = every.value.trim();
    if (trigger.value === "error") body.level = level.value.trim();
    return body;
  }

  tickSettings(streams) {
    const { trigger, of, level, count, every, delay, duration } = this.form.elements;
    const chosen = [...this.section.querySelectorAll("[name=signal]:checked")];
    const body = { signals: chosen.map((one) => one.value).join(","), every: every.value.trim() };
    if (streams) return { ...body, duration: duration.value.trim() };
    const samples = Number(count.value);
    Object.assign(body, { trigger: trigger.value, of: of.value, samples });
    if (trigger.value !== "now" && level.value.trim()) body.level = level.value.trim();
    if (Number.parseFloat(delay.value) > 0) body.delay = delay.value.trim();
    else body.before = this.before(samples);
    return body;
  }

  /** Asks how far the record is until it is here. */
  async follow(path, axis, number, isTicks) {
    const { turn } = this;
    Object.assign(this, { path, axis });
    while (this.turn === turn) {
      const found = await this.link.request("GET", path);
      if (this.turn !== turn) return;
      if (found.number !== number) {
        this.wait(false);
        this.say(`${found.owner ?? "another client"} has armed the scope`, true);
        return;
      }
      this.say(found.words, found.state === "ended");
      if (found.state === "ended") {
        this.wait(false);
        return;
      }
      if (found.state === "full") {
        const record = await this.link.request("GET", `${path}/record`);
        this.wait(false);
        this.take(isTicks ? record : columnsOf(record), axis, isTicks);
        return;
      }
      if (found.state === "reading" || this.streams) {
        this.progress.max = found.samples;
        this.progress.value = found.done;
      }
      if (this.streams) await this.takeMore(path, axis);
      await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
    }
  }

  async giveUp() {
    const { path, axis } = this;
    this.wait(false);
    try {
      const { state, words } = await this.link.request("DELETE", path);
      this.say(words);
      if (state === "full") this.take(await this.link.request("GET", `${path}/record`), axis, true);
    } catch (error) {
      this.say(sentence(error), true);
    }
  }

  /** Takes what a stream has more of by now. */
  async takeMore(path, axis) {
    const first = this.record?.time_s.length ?? 0;
    const more = await this.link.request("GET", `${path}/record`, { first });
    if (first === 0) {
      this.take(more, axis, true);
      return;
    }
    this.record.time_s.push(...more.time_s);
    for (const [name, values] of Object.entries(more.columns)) {
      this.record.columns[name].push(...values);
    }
    this.show();
  }

  take(record, axis, isTicks) {
    this.record = record;
    const words = isTicks ? this.recorder.triggers : TRIGGERS;
    const kind = this.streams ? "a stream" : `trigger: ${words[record.trigger]}`;
    if (!this.streams || record.csv) {
      this.say(`${record.time_s.length} samples of axis ${axis}, ${kind}`);
    }
    this.buttons.csv.disabled = this.view.disabled = !record.csv;
    if (this.view.disabled) this.view.value = "time";
    this.setSignals(Object.keys(record.columns));
    this.result.hidden = false;
    this.show();
  }

  /** Makes a chart and a box for each signal of the record, unless they are there. */
  setSignals(keys) {
    if (keys.join() === this.signals.map(({ key }) => key).join()) return;
    this.signals = keys.map(signalOf);
    this.pictures.replaceChildren();
    this.charts = this.signals.map(
      (signal) => new Chart(signal, this.pictures, (at, number) => this.moveCursor(number, at)),
    );
    this.shown.innerHTML = this.signals
      .map(({ name, key }) => `<label><input type="checkbox" name="${key}" checked> ${name}</label>`)
      .join(" ");
    this.boxes = [...this.shown.querySelectorAll("input")];
    for (const box of this.boxes) box.onchange = () => this.draw();
  }

  save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.record.csv], { type: "text/csv" }));
    link.download = `scope-${this.axis}.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  // ---------------------------------------------------------------- its picture

  /** Abscissa of the view: values, unit, name, digits. */
  get abscissa() {
    if (this.view.value === "spectrum") {
      return { xs: this.record.frequency_hz, unit: "Hz", name: "Frequency", digits: 2 };
    }
    return { xs: this.record.time_s.map((one) => 1e3 * one), unit: "ms", name: "Time", digits: 3 };
  }

  valuesOf(signal) {
    const of = this.view.value === "spectrum" ? this.record.spectrum : this.record.columns;
    return of[signal.key].map((one) => one * signal.scale);
  }

  /** Shows the record in another view, with the cursors at what matters most. */
  show() {
    const { xs } = this.abscissa;
    if (this.view.value === "spectrum") {
      const signal = this.signals.find(({ key }) => key === "error_nm") ?? this.signals[0];
      const lines = this.valuesOf(signal);
      const largest = lines.indexOf(Math.max(...lines));
      this.cursors = [largest, xs.length - 1];
      this.note.textContent =
        `Amplitude spectrum: peak amplitudes, ${this.record.window} window, lines ` +
        `${(xs[1] - xs[0]).toFixed(2)} Hz apart, without the mean. ` +
        `Largest line of the ${signal.name.toLowerCase()}: ` +
        `${lines[largest].toFixed(signal.digits)} ${signal.unit} at ${xs[largest].toFixed(2)} Hz.`;
    } else {
      this.cursors = [this.record.before, xs.length - 1];
      const zero = this.streams ? "first sample" : "trigger";
      this.note.textContent = `Time 0 is the ${zero}. Error is target − position.`;
    }
    for (const slider of this.sliders) slider.max = xs.length - 1;
    this.draw();
  }

  moveCursor(number, at) {
    this.cursors[number] = at;
    this.draw();
  }

  draw() {
    if (!this.record) return;
    const { xs, unit, name, digits } = this.abscissa;
    const isSpectrum = this.view.value === "spectrum";
    const rows = [rowOf(name, unit, this.cursors.map((at) => xs[at]), digits)];
    this.signals.forEach((signal, index) => {
      const chart = this.charts[index];
      chart.figure.hidden = !this.boxes[index].checked;
      if (!this.boxes[index].checked) return;
      const values = this.valuesOf(signal);
      const title = isSpectrum ? `${signal.name}, amplitude` : signal.name;
      chart.show({ xs, values, unit, cursors: this.cursors, title });
      rows.push(rowOf(signal.name, signal.unit, this.cursors.map((at) => values[at]), signal.digits));
    });
    this.rows.replaceChildren(...rows);
    this.sliders.forEach((slider, number) => {
      slider.value = this.cursors[number];
      const where = `${signed(xs[this.cursors[number]], digits)} ${unit}`;
      slider.setAttribute("aria-valuetext", where);
    });
  }
}

/** A record of the scope of a node with its signals as columns, as one of ticks has them. */
function columnsOf(record) {
  const { position_nm, error_nm, drive_command } = record;
  return { ...record, columns: { position_nm, error_nm, drive_command } };
}

/** A row of the table of the cursors. */
function rowOf(name, unit, [a, b], digits) {
  const row = document.createElement("tr");
  const head = document.createElement("th");
  head.scope = "row";
  head.textContent = name;
  row.append(head);
  for (const value of [a, b, b - a]) {
    row.insertCell().textContent = `${signed(value, digits)} ${unit}`;
  }
  return row;
}
