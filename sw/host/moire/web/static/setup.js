// SPDX-License-Identifier: Apache-2.0
// The first set-up of an axis, step by step: what to do, and what the machine shows of it by itself.

import { mm, sentence } from "./format.js";
import { pathOf } from "./link.js";

const MOVED_NM = 10_000; // by hand, for the counting direction to be seen
const SAMPLES = 32;
const LIMITS = {
  following_limit: "largest following error",
  output_limit: "largest drive command, of full scale",
  velocity: "top speed",
  travel_low: "lowest target",
  travel_high: "highest target",
};

export class SetupPanel {
  constructor(section, link) {
    Object.assign(this, { section, link, row: null, seen: new Set(), from: null });
    section.innerHTML = `
      <details>
        <summary><h2 id="setup-title">First set-up, step by step</h2></summary>
        <div class="row"><label>Axis <select name="axis"></select></label></div>
        <ol>
          <li data-step="switches"><b>Switches.</b> With the power of the motor off, press each switch by hand.
            <span role="status"></span></li>
          <li data-step="direction"><b>Counting direction.</b> Press the button, then move the axis by hand in the
            direction that you want to call positive.
            <button type="button" data-do="direction">I am going to move it</button> <span role="status"></span></li>
          <li data-step="signal"><b>Strength of the signal.</b> Move the axis by hand by some signal periods, then measure.
            <button type="button" data-do="signal">Measure</button> <span role="status"></span></li>
          <li data-step="limits"><b>Limits.</b> Set them low before anything moves.
            <div class="row limits"></div> <span role="status"></span></li>
          <li data-step="motor"><b>Direction of the motor, and gains.</b> Switch the power of the motor on, with the axis in
            the middle of its travel and a hand on the emergency stop, and run
            <code>moire tune --method steps --bandwidth 40Hz --write</code>: it says if a positive command moves the axis down.
            <span role="status"></span></li>
          <li data-step="home"><b>Zero.</b> Method 37 takes the present position; the others search a switch or an index.
            <label>Method <select name="method"><option>37</option><option>17</option><option>18</option><option>1</option>
            <option>2</option><option>33</option><option>34</option><option>s0</option><option>s3</option></select></label>
            <button type="button" data-do="home">Home</button> <span role="status"></span></li>
          <li data-step="save"><b>Save.</b> <code>moire params save stage.toml</code> writes all parameters into a file.
            An axis with sine and cosine is calibrated before, in the panel Calibration and scale.</li>
        </ol>
      </details>`;
    this.axis = section.querySelector("[name=axis]");
    this.axis.onchange = () => this.begin();
    const act = (name, work) => {
      section.querySelector(`[data-do=${name}]`).onclick = () =>
        work().catch((error) => this.say(name, sentence(error), "wrong"));
    };
    act("direction", async () => {
      this.from = this.row.position_nm;
      this.say("direction", "move it now", "");
    });
    act("signal", () => this.measure());
    act("home", async () => {
      this.say("home", "under way", "");
      const method = section.querySelector("[name=method]").value;
      const end = await this.link.request("POST", `${pathOf(this.axis.value)}/home`, { method });
      this.say("home", `homed at ${mm(end.position_nm)} mm`, "done");
    });
    section.querySelector("details").addEventListener("toggle", (event) => {
      if (event.target.open) this.readLimits().catch((error) => this.say("limits", sentence(error), "wrong"));
    });
  }

  open(names, mayChange) {
    this.section.hidden = names.length === 0 || !mayChange;
    if (names.join() !== [...this.axis.options].map((one) => one.value).join()) {
      this.axis.replaceChildren(...names.map((name) => new Option(name)));
      this.begin();
    }
  }

  begin() {
    Object.assign(this, { row: null, seen: new Set(), from: null });
    for (const one of this.section.querySelectorAll("li [role=status]")) one.textContent = "";
    for (const one of this.section.querySelectorAll("li")) delete one.dataset.state;
    if (this.section.querySelector("details").open) this.readLimits();
  }

  /** Says how a step is; `state` is done, wrong or empty. */
  say(step, text, state) {
    const item = this.section.querySelector(`[data-step=${step}]`);
    item.dataset.state = state;
    const status = item.querySelector("[role=status]");
    if (status.textContent !== text) status.textContent = text;
  }

  /** A sample of the stream. */
  show(row) {
    if (row.error || `${row.address}.${row.axis}` !== this.axis.value) return;
    this.row = row;
    if (!this.section.querySelector("details").open) return;
    const names = { limit_low: "low limit", limit_high: "high limit", estop: "emergency stop" };
    for (const name of Object.keys(names)) if (row[name]) this.seen.add(name);
    const left = Object.keys(names).filter((name) => !this.seen.has(name));
    const pressed = Object.keys(names).filter((name) => row[name]);
    const now = pressed.length ? `pressed now: ${pressed.map((name) => names[name]).join(", ")}; ` : "";
    this.say(
      "switches",
      left.length ? `${now}not seen yet: ${left.map((name) => names[name]).join(", ")}` : `${now}all were seen`,
      left.length ? "" : "done",
    );
    if (this.from !== null) {
      const moved = row.position_nm - this.from;
      if (Math.abs(moved) >= MOVED_NM) {
        this.from = null;
        if (moved > 0) this.say("direction", "the position has risen: this is right", "done");
        else this.say("direction", "the position has fallen: exchange A and B, or sine and cosine", "wrong");
      }
    }
  }

  async measure() {
    this.say("signal", "under way", "");
    const path = `${pathOf(this.axis.value)}/signal`;
    const found = await this.link.request("GET", path, { samples: SAMPLES, fresh: false });
    const state = { good: "done", unknown: "" }[found.verdict] ?? "wrong";
    this.say("signal", `${found.words}${found.to_do ? `: ${found.to_do}` : ""}`, state);
  }

  async readLimits() {
    const path = `${pathOf(this.axis.value)}/parameters`;
    const fields = [];
    for (const [name, words] of Object.entries(LIMITS)) {
      const known = await this.link.request("GET", `${path}/${name}`);
      const label = document.createElement("label");
      const input = Object.assign(document.createElement("input"), { name, size: 10, value: known.written });
      input.autocomplete = "off";
      input.onchange = () => this.setLimit(path, name, input);
      label.append(`${words} `, input);
      label.title = known.allowed;
      fields.push(label);
    }
    this.section.querySelector(".limits").replaceChildren(...fields);
  }

  async setLimit(path, name, input) {
    try {
      const known = await this.link.request("PUT", `${path}/${name}`, { value: input.value });
      input.value = known.written;
      this.say("limits", `${name} is ${known.written}`, "done");
    } catch (error) {
      this.say("limits", sentence(error), "wrong");
    }
  }
}
