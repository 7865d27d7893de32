// SPDX-License-Identifier: Apache-2.0
// Calibration of an axis with its progress, the harmonics that were and are corrected, and the
// segment table of its scale.

import { Bars, Over } from "./bars.js";
import { lengthOf, sentence } from "./format.js";
import { pathOf } from "./link.js";

const LOOK_MS = 300; // between two questions how far a calibration is

export class CalibrationPanel {
  constructor(section, link) {
    Object.assign(this, { section, link, turn: 0, found: null, table: null });
    section.innerHTML = `
      <div class="bar"><h2 id="calibration-title">Calibration and scale</h2></div>
      <form class="row">
        <label>Axis <select name="axis"></select></label>
        <label data-field="distance">Distance in mm <input name="distance" size="5" value="1" autocomplete="off"></label>
        <button type="submit">Calibrate</button>
        <button type="button" data-do="read">Show the correction</button>
      </form>
      <p class="note" data-field="hint">Home the axis first. It moves to and fro; every stop ends the calibration.</p>
      <p class="message" role="status"></p>
      <div class="charts" hidden></div>`;
    this.form = section.querySelector("form");
    this.message = section.querySelector(".message");
    this.charts = section.querySelector(".charts");
    this.bars = new Bars(this.charts, "Amplitude of the harmonics that are corrected, in nm over their order: before (left) and now (right)");
    this.segments = new Over(this.charts, "Error of the scale in the segment table, in nm over the position in mm", { isLine: true });
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.calibrate();
    });
    section.querySelector("[data-do=read]").onclick = () => this.read(true);
    this.form.elements.axis.onchange = () => {
      this.turn = 0;
      this.charts.hidden = true;
      this.say("");
    };
  }

  get path() {
    return pathOf(this.form.elements.axis.value);
  }

  open(names, mayChange) {
    this.section.hidden = names.length === 0;
    const { axis } = this.form.elements;
    if (names.join() !== [...axis.options].map((one) => one.value).join()) {
      axis.replaceChildren(...names.map((name) => new Option(name)));
    }
    this.form.querySelector("[type=submit]").hidden = !mayChange;
    for (const name of ["distance", "hint"]) {
      this.section.querySelector(`[data-field=${name}]`).hidden = !mayChange;
    }
  }

  say(text, isWrong = false) {
    if (this.message.textContent !== text) this.message.textContent = text;
    this.message.classList.toggle("wrong", isWrong);
  }

  async calibrate() {
    try {
      const distance = lengthOf(this.form.elements.distance.value, "mm");
      await this.link.request("POST", `${this.path}/calibration`, { distance });
    } catch (error) {
      this.say(sentence(error), true);
      return;
    }
    const turn = (this.turn = performance.now());
    while (this.turn === turn && (await this.read(false)) === "running") {
      await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
    }
    if (this.turn === turn) this.read(true);
  }

  /** Shows how far the calibration is, and the segment table where it is asked for; returns its state. */
  async read(withTable) {
    try {
      this.found = await this.link.request("GET", `${this.path}/calibration`);
      if (withTable) this.table = await this.link.request("GET", `${this.path}/segments`);
    } catch (error) {
      this.say(sentence(error), true);
      return "ended";
    }
    const { state, words, strokes, accepted, refused } = this.found;
    const made = state === "none" ? "" : ` Strokes ${strokes}, measurements used ${accepted}, refused ${refused}.`;
    const table = withTable ? ` Segment table: ${this.table.words}.` : "";
    this.say(`${words}.${made}${table}`, state === "ended");
    this.charts.hidden = false;
    this.draw();
    return state;
  }

  draw() {
    if (this.found === null || this.charts.hidden) return;
    const { orders, before_nm: before, now_nm: now } = this.found;
    const say = (values) => values.map((one) => one.toFixed(3)).join(", ") || "unknown";
    this.bars.show(
      orders,
      [before.length ? before : now.map(() => 0), now],
      `Harmonics that are corrected, in nm by order from 1: before ${say(before)}; now ${say(now)}`,
    );
    const hasTable = Boolean(this.table?.border_nm.length);
    this.segments.figure.hidden = !hasTable;
    if (!hasTable) return;
    const { border_nm: borders, error_nm: errors } = this.table;
    const [low, high] = [Math.min(...errors), Math.max(...errors)].map((one) => one.toFixed(1));
    this.segments.show(
      borders.map((one) => one / 1e6),
      errors,
      `Error of the scale at ${errors.length} borders: from ${low} to ${high} nm`,
    );
  }
}
