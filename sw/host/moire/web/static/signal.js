// SPDX-License-Identifier: Apache-2.0
// Sine against cosine of an axis while it moves, the ellipse through the samples, and what to do.

import { Over } from "./bars.js";
import { sentence, signed } from "./format.js";
import { pathOf } from "./link.js";
import { dots, line, ownAbscissae, Plot } from "./plot.js";

const SAMPLES = 32; // of one request
const PAUSE_MS = 150; // between two requests

export class SignalPanel {
  constructor(section, link) {
    Object.assign(this, { section, link, turn: 0, reach: 1 });
    section.innerHTML = `
      <div class="bar">
        <h2 id="signal-title">Sine and cosine</h2>
        <label>Axis <select></select></label>
        <button type="button" aria-pressed="false">Measure</button>
      </div>
      <p class="note">Move the axis by some signal periods while this measures.</p>
      <p class="message" role="status"></p>
      <div class="lissajous" hidden>
        <div data-field="ellipse"></div>
        <dl></dl>
        <div data-field="travel"></div>
      </div>`;
    this.axis = section.querySelector("select");
    this.button = section.querySelector("button");
    this.message = section.querySelector(".message");
    this.result = section.querySelector(".lissajous");
    this.list = section.querySelector("dl");
    this.ellipse = new Plot(
      section.querySelector("[data-field=ellipse]"),
      "Sine over cosine in ADC counts",
      (look) => this.lissajous(look),
    );
    this.ellipse.element.classList.add("square");
    this.travel = new Over(
      section.querySelector("[data-field=travel]"),
      "Amplitude in ADC counts over the position in mm, with its limits",
    );
    this.button.onclick = () => (this.turn ? this.end() : this.measure());
    this.axis.onchange = () => this.end();
  }

  open(names) {
    this.section.hidden = names.length === 0;
    if (names.join() !== [...this.axis.options].map((one) => one.value).join()) {
      this.axis.replaceChildren(...names.map((name) => new Option(name)));
    }
  }

  say(text, isWrong) {
    if (this.message.textContent !== text) this.message.textContent = text;
    this.message.classList.toggle("wrong", isWrong);
  }

  end() {
    this.turn = 0;
    this.button.setAttribute("aria-pressed", "false");
  }

  async measure() {
    const turn = (this.turn = performance.now());
    this.button.setAttribute("aria-pressed", "true");
    const path = `${pathOf(this.axis.value)}/signal`;
    let fresh = true;
    while (this.turn === turn) {
      let found;
      try {
        found = await this.link.request("GET", path, { samples: SAMPLES, fresh });
      } catch (error) {
        if (this.turn === turn) this.end();
        this.say(sentence(error), true);
        return;
      }
      fresh = false;
      if (this.turn === turn) this.show(found);
      await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    }
  }

  show(found) {
    const isBad = !["good", "unknown"].includes(found.verdict);
    this.say(`${found.words}.${found.to_do ? ` What to do: ${found.to_do}.` : ""}`, isBad);
    this.result.hidden = false;
    const counts = (value) => `${signed(value, 2).replace("+", "")} ADC counts`;
    const { ellipse } = found;
    const rows = [["Samples", String(found.cos.length)]];
    if (ellipse) {
      rows.push(
        ["Amplitude of the sine", counts(ellipse.sin_amplitude)],
        ["Amplitude of the cosine", counts(ellipse.cos_amplitude)],
        ["Offset of the sine", counts(ellipse.sin_offset)],
        ["Offset of the cosine", counts(ellipse.cos_offset)],
        ["Quadrature error", `${signed(ellipse.quadrature_error_deg, 2)}°`],
        ["Deviation, rms", counts(ellipse.deviation)],
      );
    }
    this.list.replaceChildren(
      ...rows.map(([name, value]) => {
        const row = document.createElement("div");
        row.append(document.createElement("dt"), document.createElement("dd"));
        row.firstChild.textContent = name;
        row.lastChild.textContent = value;
        return row;
      }),
    );
    const { cos, sin, curve } = found;
    this.reach = 1.1 * Math.max(1, ...[...cos, ...sin, ...curve.cos, ...curve.sin].map(Math.abs));
    this.ellipse.draw(
      [null, [curve.cos, curve.sin], [cos, sin]],
      `Sine over cosine in ADC counts: ${cos.length} samples` +
        `${ellipse ? " and their ellipse" : ""}. ${found.words}`,
    );
    const { amplitude, position_nm: positions, limits } = found;
    if (!amplitude.length) return;
    this.travel.show(
      positions.map((one) => one / 1e6),
      amplitude,
      `Amplitude along the travel: ${amplitude.length} samples, ${Math.min(...amplitude)} to ` +
        `${Math.max(...amplitude)} ADC counts` +
        (limits.length ? `; the limits are ${limits.join(" and ")}` : ""),
      limits,
    );
  }

  /** Options of uPlot for the samples and their ellipse, which is a closed line. */
  lissajous({ uPlot, color }) {
    const range = () => [-this.reach, this.reach];
    return {
      ...ownAbscissae([{ ...line(1, color), dash: [] }, dots(0, color, uPlot)]),
      scales: { x: { range }, y: { range } },
    };
  }
}
