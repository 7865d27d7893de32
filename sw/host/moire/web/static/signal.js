// SPDX-License-Identifier: Apache-2.0
// Sine against cosine of an axis while it moves, the ellipse through the samples, and what to do.

import { drawOver, figure } from "./bars.js";
import { sentence, signed } from "./format.js";
import { pathOf } from "./link.js";
import { frame, ticks } from "./plot.js";

const SAMPLES = 32; // of one request
const PAUSE_MS = 150; // between two requests

export class SignalPanel {
  constructor(section, link) {
    Object.assign(this, { section, link, turn: 0, found: null });
    section.innerHTML = `
      <div class="bar">
        <h2 id="signal-title">Sine and cosine</h2>
        <label>Axis <select></select></label>
        <button type="button" aria-pressed="false">Measure</button>
      </div>
      <p class="note">Move the axis by some signal periods while this measures.</p>
      <p class="message" role="status"></p>
      <div class="lissajous" hidden>
        <figure><figcaption>Sine over cosine in ADC counts</figcaption>
          <canvas class="square" role="img"></canvas></figure>
        <dl></dl>
        <div data-field="travel"></div>
      </div>`;
    this.axis = section.querySelector("select");
    this.button = section.querySelector("button");
    this.message = section.querySelector(".message");
    this.result = section.querySelector(".lissajous");
    this.canvas = section.querySelector("canvas");
    this.list = section.querySelector("dl");
    this.travel = figure(
      section.querySelector("[data-field=travel]"),
      "Amplitude in ADC counts over the position in mm, with its limits",
    );
    this.button.onclick = () => (this.turn ? this.end() : this.measure());
    this.axis.onchange = () => this.end();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
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
    this.found = found;
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
    this.canvas.setAttribute(
      "aria-label",
      `Sine over cosine in ADC counts: ${found.cos.length} samples` +
        `${ellipse ? " and their ellipse" : ""}. ${found.words}`,
    );
    this.draw();
  }

  draw() {
    if (!this.found) return;
    const { cos, sin, curve } = this.found;
    const all = [...cos, ...sin, ...curve.cos, ...curve.sin].map(Math.abs);
    const reach = 1.1 * Math.max(1, ...all);
    const marks = ticks(-reach, reach, 4).map((text) => [Number(text), text.replace("-", "−")]);
    const range = { from: -reach, to: reach, low: -reach, high: reach };
    this.canvas.dataset.range = JSON.stringify(range);
    const drawn = frame(this.canvas, { ...range, marks });
    if (drawn === null) return;
    const { context, style, x, y } = drawn;
    context.strokeStyle = style.getPropertyValue("--series-2");
    context.beginPath();
    curve.cos.forEach((value, at) => context.lineTo(x(value), y(curve.sin[at])));
    context.stroke();
    context.fillStyle = style.getPropertyValue("--series-1");
    cos.forEach((value, at) => context.fillRect(x(value) - 1, y(sin[at]) - 1, 2, 2));
    const { amplitude, position_nm: positions, limits } = this.found;
    if (!amplitude.length) return;
    drawOver(this.travel, positions.map((one) => one / 1e6), amplitude, { limits });
    this.travel.setAttribute(
      "aria-label",
      `Amplitude along the travel: ${amplitude.length} samples, ${Math.min(...amplitude)} to ` +
        `${Math.max(...amplitude)} ADC counts` +
        (limits.length ? `; the limits are ${limits.join(" and ")}` : ""),
    );
  }
}
