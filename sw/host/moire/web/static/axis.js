// SPDX-License-Identifier: Apache-2.0
// One axis: what it does, and its controls.

import { Hold } from "./hold.js";
import { lengthOf, mm, sentence, signed } from "./format.js";
import { pathOf } from "./link.js";

const STEPS = ["10 nm", "100 nm", "1 um", "10 um", "100 um", "1 mm", "10 mm"];
const FIRST_STEP = "10 um";
const SPEEDS = [1, 0.5, 0.25, 0.1, 0.01]; // of full speed
const FARTHEST = "1 m"; // of a jog: the server ends it at the end of the travel
const NM = { nm: 1, um: 1e3, mm: 1e6, m: 1e9 };

function speedOption(share) {
  return new Option(`${Math.round(10000 * share) / 100} %`, String(share));
}

export class AxisView {
  constructor(name, link) {
    Object.assign(this, { name, link, path: pathOf(name), row: null, travel: null });
    const template = document.getElementById("axis-template");
    this.element = template.content.firstElementChild.cloneNode(true);
    this.fields = {};
    for (const one of this.element.querySelectorAll("[data-field]")) {
      this.fields[one.dataset.field] = one;
    }
    const title = this.element.querySelector("h2");
    title.textContent = `Axis ${name}`;
    title.id = `axis-${name}`;
    this.element.setAttribute("aria-labelledby", title.id);
    for (const one of this.element.querySelectorAll("[data-label]")) {
      one.setAttribute("aria-label", `${one.dataset.label}, axis ${name}`);
    }
    this.connectControls();
  }

  // ---------------------------------------------------------------- controls

  connectControls() {
    const button = (name) => this.element.querySelector(`[data-do=${name}]`);
    const step = this.element.querySelector("[name=step]");
    step.setAttribute("aria-label", "Length of a step");
    step.append(
      ...STEPS.map((text) => {
        const isFirst = text === FIRST_STEP;
        return new Option(text.replace("u", "µ"), text, isFirst, isFirst);
      }),
    );
    this.speed = this.element.querySelector("[name=speed]");
    this.speed.append(...SPEEDS.map(speedOption));
    this.speed.addEventListener("change", () => this.setSpeed(this.speed.value));
    const form = this.element.querySelector("form");
    form.elements.unit.setAttribute("aria-label", "Unit of the length");
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.moveAsWritten(form, "to");
    });
    button("by").onclick = () => form.reportValidity() && this.moveAsWritten(form, "by");
    button("up").onclick = () => this.move({ by: step.value });
    button("down").onclick = () => this.move({ by: `-${step.value}` });
    button("home").onclick = () => this.motion("home", {}, "homed");
    button("enable").onclick = () => this.command("enable");
    button("disable").onclick = () => this.command("disable");
    button("clear").onclick = () => this.command("clear");
    button("stop").onclick = () => this.stop();
    this.take = button("take");
    this.buttons = Object.fromEntries(
      ["enable", "disable", "home", "clear"].map((name) => [name, button(name)]),
    );
    for (const one of this.element.querySelectorAll("[data-hold]")) {
      const by = `${one.dataset.hold}${FARTHEST}`;
      new Hold(one, {
        begin: () => {
          this.say("");
          return this.link.request("POST", `${this.path}/jog`, { by });
        },
        again: () => this.link.request("POST", `${this.path}/hold`),
        end: () => this.link.stop(this.name),
        failed: (error) =>
          error.cause === "no_jog" ? this.say("the jog has ended") : this.fail(error, null),
      });
      one.addEventListener("click", (event) => {
        if (event.detail === 0) this.say("hold the button, or move by steps");
      });
    }
  }

  /** The name of the axis in the description of the machine, if it has one. */
  call(name) {
    this.element.querySelector("h2").textContent = name ? `${name} (axis ${this.name})` : `Axis ${this.name}`;
  }

  mayChange(may) {
    this.fields.controls.hidden = !may;
  }

  moveAsWritten(form, how) {
    let length;
    try {
      length = lengthOf(form.elements.target.value, form.elements.unit.value);
    } catch (error) {
      this.say(error.message, true);
      return;
    }
    this.move({ [how]: length });
  }

  move(body) {
    this.motion("move", body, "reached");
  }

  async motion(what, body, done) {
    this.say("under way");
    try {
      const end = await this.link.request("POST", `${this.path}/${what}`, body);
      this.say(`${done}: ${mm(end.position_nm)} mm, error ${signed(end.error_nm, 1)} nm`);
    } catch (error) {
      this.fail(error, () => this.motion(what, { ...body, take: true }, done));
    }
  }

  async command(what) {
    this.say("");
    try {
      this.show(await this.link.request("POST", `${this.path}/${what}`));
    } catch (error) {
      this.fail(error, null);
    }
  }

  async stop() {
    try {
      this.show(await this.link.stop(this.name));
    } catch (error) {
      this.fail(error, null);
    }
  }

  async setSpeed(value) {
    try {
      await this.link.request("PUT", `${this.path}/parameters/feed_override`, { value });
    } catch (error) {
      this.fail(error, null);
    }
    this.readSpeed();
  }

  /** Shows the speed that holds, whoever has set it. */
  async readSpeed() {
    const known = await this.link.request("GET", `${this.path}/parameters/feed_override`);
    if (document.activeElement === this.speed) return;
    const option = [...this.speed.options].find((one) => one.value === String(known.value));
    if (!option) this.speed.append(speedOption(known.value));
    this.speed.value = String(known.value);
  }

  /** Reads what changes seldom. */
  async readLimits() {
    const [low, high] = await Promise.all(
      ["travel_low", "travel_high"].map((name) =>
        this.link.request("GET", `${this.path}/parameters/${name}`),
      ),
    );
    this.travel = [low, high].map((one) => one.value * NM[one.unit]);
    this.fields.limits.textContent = `${mm(this.travel[0])} to ${mm(this.travel[1])} mm`;
    await this.readSpeed();
  }

  say(text, isWrong = false) {
    this.fields.message.textContent = text;
    this.fields.message.classList.toggle("wrong", isWrong);
    this.take.hidden = true;
  }

  /** Shows a refusal; `again` takes the axis over and asks again. */
  fail(error, again) {
    this.say(error.cause === "stopped" ? "stopped" : sentence(error), error.cause !== "stopped");
    if (error.cause !== "other_client" || again === null) return;
    this.take.hidden = false;
    this.take.onclick = () => {
      this.take.hidden = true;
      again();
    };
  }

  // ---------------------------------------------------------------- state

  /** Writes a text where it has changed, so that a screen reader says it once. */
  put(field, text) {
    const element = this.fields[field];
    if (element.textContent !== text) element.textContent = text;
  }

  show(row) {
    this.row = row;
    if (row.error) {
      this.element.dataset.state = "absent";
      this.put("state", "no answer");
      this.showFault(row.error.text, row.error.to_do);
      return;
    }
    this.element.dataset.state = row.state;
    this.put("state", row.words);
    this.put("homed", row.homed ? "homed" : "not homed: home it before it can move");
    this.put("position", mm(row.position_nm));
    this.put("target", `${mm(row.target_nm)} mm`);
    this.put("error", `${signed((row.target_nm - row.position_nm) / 1e3, 3)} µm`);
    this.put("velocity", `${signed(row.velocity_mm_s, 3)} mm/s`);
    this.put("command", `${signed(100 * row.drive_command, 1)} %${row.saturated ? ", at its limit" : ""}`);
    const closed = [
      row.limit_low && "low limit",
      row.limit_high && "high limit",
      row.estop && "emergency stop",
    ].filter(Boolean);
    this.put("switches", closed.join(", ") || "none active");
    this.put("owner", row.moved_by ?? "nobody");
    if (row.faults.length) {
      this.showFault(`Fault: ${row.fault_words}`, row.to_do);
    } else {
      this.showFault("", "");
    }
    this.showTravel(row);
    const faulted = row.faults.length > 0;
    this.buttons.enable.disabled = row.enabled || faulted;
    this.buttons.disable.disabled = !row.enabled;
    this.buttons.home.disabled = faulted;
    this.buttons.clear.disabled = !faulted;
  }

  showFault(what, toDo) {
    const { fault } = this.fields;
    const text = what && `${what}. What to do: ${toDo}.`;
    if (fault.textContent === text) return;
    fault.hidden = !text;
    fault.textContent = text;
  }

  showTravel(row) {
    if (!this.travel) return;
    const [low, high] = this.travel;
    const share = Math.min(1, Math.max(0, (row.position_nm - low) / (high - low || 1)));
    this.fields.travel.firstElementChild.style.left = `${(100 * share).toFixed(1)}%`;
    this.fields.travel.setAttribute("aria-label", `at ${Math.round(100 * share)} % of the travel`);
  }
}
