// SPDX-License-Identifier: Apache-2.0
// The scope: settings of a record, its progress, its signals over time and as spectra, cursors, CSV.

import { Chart } from "./chart.js";
import { lengthOf, sentence, signed } from "./format.js";
import { pathOf } from "./link.js";

const LOOK_MS = 200; // between two questions how far a record is
const TRIGGERS = {
  now: "at once",
  motion: "the axis moves or homes",
  settling: "settling begins",
  error: "the error reaches a level",
  fault: "a fault latches",
};
const SIGNALS = [
  { name: "Position", key: "position_nm", unit: "mm", scale: 1e-6, digits: 6, series: 1 },
  { name: "Error", key: "error_nm", unit: "µm", scale: 1e-3, digits: 4, series: 2 },
  { name: "Drive command", key: "drive_command", unit: "%", scale: 100, digits: 2, series: 3 },
];
const POSITION_SHARES = [0, 10, 25, 50, 90]; // of the samples, before the trigger
const COUNTS = [128, 64, 32, 16];

const choices = (list) => list.map(([value, text]) => `<option value="${value}">${text}</option>`);

export class ScopePanel {
  constructor(section, link) {
    Object.assign(this, { section, link, record: null, cursors: [0, 0], turn: 0 });
    section.innerHTML = `
      <div class="bar"><h2 id="scope-title">Scope</h2></div>
      <form class="row">
        <label>Axis <select name="axis"></select></label>
        <label>Trigger <select name="trigger">${choices(Object.entries(TRIGGERS)).join("")}</select></label>
        <label data-field="level">Level in µm <input name="level" size="6" value="1" autocomplete="off"></label>
        <label>Trigger at <select name="share">${choices(
          POSITION_SHARES.map((one) => [one, `${one} % of the record`]),
        ).join("")}</select></label>
        <label>Samples <select name="samples">${choices(COUNTS.map((one) => [one, one])).join("")}</select></label>
        <label>One every <input name="every" size="6" value="1ms" autocomplete="off" spellcheck="false"></label>
        <button type="submit" data-do="record">Record</button>
        <button type="button" data-do="cancel" hidden>Give up</button>
        <button type="button" data-do="take" hidden>Take the scope over</button>
      </form>
      <progress aria-label="Samples read" hidden></progress>
      <p class="message" role="status"></p>
      <div data-field="result" hidden>
        <div class="row" role="group" aria-label="What is shown">
          ${SIGNALS.map(
            ({ name, key }) => `<label><input type="checkbox" name="${key}" checked> ${name}</label>`,
          ).join("")}
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
      ["record", "cancel", "take", "csv"].map((name) => [name, find(`[data-do=${name}]`)]),
    );
    this.charts = SIGNALS.map(
      (signal) => new Chart(signal, find(".charts"), (at, number) => this.moveCursor(number, at)),
    );
    this.boxes = SIGNALS.map(({ key }) => find(`[name=${key}]`));
    this.connectControls();
  }

  connectControls() {
    const { trigger } = this.form.elements;
    const level = this.section.querySelector("[data-field=level]");
    trigger.onchange = () => (level.hidden = trigger.value !== "error");
    trigger.onchange();
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.begin(false);
    });
    this.buttons.take.onclick = () => this.begin(true);
    this.buttons.cancel.onclick = () => this.giveUp();
    this.buttons.csv.onclick = () => this.save();
    this.view.onchange = () => this.show();
    for (const box of this.boxes) box.onchange = () => this.draw();
    this.sliders.forEach((slider, number) => {
      slider.oninput = () => this.moveCursor(number, Number(slider.value));
    });
    new ResizeObserver(() => this.draw()).observe(this.result);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  open(names, mayChange) {
    this.section.hidden = names.length === 0 || !mayChange;
    const { axis } = this.form.elements;
    if (names.join() !== [...axis.options].map((one) => one.value).join()) {
      axis.replaceChildren(...names.map((name) => new Option(name)));
    }
  }

  say(text, isWrong = false) {
    if (this.message.textContent !== text) this.message.textContent = text;
    this.message.classList.toggle("wrong", isWrong);
  }

  /** Shows that a record is being waited for, or not. */
  wait(waits) {
    this.turn += 1; // what was waited for before is not any more
    this.buttons.record.disabled = waits;
    this.buttons.cancel.hidden = !waits;
    this.buttons.take.hidden = true;
    this.progress.hidden = !waits;
    this.progress.removeAttribute("value");
  }

  // ---------------------------------------------------------------- a record

  async begin(take) {
    const { axis, trigger, level, share, samples, every } = this.form.elements;
    const before = Math.min(
      Math.round((Number(share.value) / 100) * Number(samples.value)),
      Number(samples.value) - 1,
    );
    const path = `${pathOf(axis.value)}/scope`;
    try {
      const body = { trigger: trigger.value, before, samples: Number(samples.value), take };
      body.every = every.value.trim();
      if (trigger.value === "error") body.level = lengthOf(level.value, "um");
      this.say("");
      const { number } = await this.link.request("POST", path, body);
      this.wait(true);
      await this.follow(path, axis.value, number);
    } catch (error) {
      this.wait(false);
      this.say(sentence(error), true);
      this.buttons.take.hidden = error.cause !== "scope_in_use";
    }
  }

  /** Asks how far the record is until it is here. */
  async follow(path, axis, number) {
    const { turn } = this;
    this.path = path;
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
        this.take(record, axis);
        return;
      }
      if (found.state === "reading") {
        this.progress.max = found.samples;
        this.progress.value = found.done;
      }
      await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
    }
  }

  async giveUp() {
    this.wait(false);
    try {
      this.say((await this.link.request("DELETE", this.path)).words);
    } catch (error) {
      this.say(sentence(error), true);
    }
  }

  take(record, axis) {
    Object.assign(this, { record, axis });
    this.say(`${record.time_s.length} samples of axis ${axis}, trigger: ${TRIGGERS[record.trigger]}`);
    this.result.hidden = false;
    this.show();
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
    const of = this.view.value === "spectrum" ? this.record.spectrum : this.record;
    return of[signal.key].map((one) => one * signal.scale);
  }

  /** Shows the record in another view, with the cursors at what matters most. */
  show() {
    const { xs } = this.abscissa;
    if (this.view.value === "spectrum") {
      const errors = this.record.spectrum.error_nm;
      const largest = errors.indexOf(Math.max(...errors));
      this.cursors = [largest, xs.length - 1];
      this.note.textContent =
        `Amplitude spectrum: peak amplitudes, ${this.record.window} window, lines ` +
        `${(xs[1] - xs[0]).toFixed(2)} Hz apart, without the mean. Largest line of the error: ` +
        `${(errors[largest] * 1e-3).toFixed(4)} µm at ${xs[largest].toFixed(2)} Hz.`;
    } else {
      this.cursors = [this.record.before, xs.length - 1];
      this.note.textContent = "Time 0 is the trigger. Error is target − position.";
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
    SIGNALS.forEach((signal, index) => {
      const chart = this.charts[index];
      chart.canvas.parentElement.hidden = !this.boxes[index].checked;
      if (!this.boxes[index].checked) return;
      const values = this.valuesOf(signal);
      const title = isSpectrum ? `${signal.name}, amplitude` : signal.name;
      chart.draw({ xs, values, unit, cursors: this.cursors, title });
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
