// SPDX-License-Identifier: Apache-2.0
// The parameters of an axis by group: value with unit, limits, default, search, what differs from
// the default, from the machine file, or from what the node has saved.

import { sentence } from "./format.js";
import { pathOf } from "./link.js";

export class ParameterTable {
  constructor(section, link) {
    Object.assign(this, { section, link, mayChange: false, rows: [], saved: null });
    section.innerHTML = `
      <div class="bar">
        <h2 id="parameters-title">Parameters</h2>
        <label>Axis <select></select></label>
        <button type="button">Read</button>
        <label>Search <input type="search" autocomplete="off" spellcheck="false"></label>
        <label>Shown <select name="shown">
          <option value="all">all</option>
          <option value="default">what differs from the default</option>
          <option value="described">what differs from machine.toml</option>
          <option value="saved">what differs from saved values</option>
        </select></label>
      </div>
      <p class="message" role="status"></p>
      <div class="table"></div>`;
    this.axis = section.querySelector("select");
    this.search = section.querySelector("[type=search]");
    this.shown = section.querySelector("[name=shown]");
    this.message = section.querySelector(".message");
    this.table = section.querySelector(".table");
    section.querySelector("button").onclick = () => this.read();
    this.axis.onchange = () => this.clear();
    this.search.oninput = () => this.filter();
    this.shown.onchange = () => this.choose();
  }

  open(names, mayChange) {
    this.section.hidden = names.length === 0;
    this.mayChange = mayChange;
    const known = [...this.axis.options].map((one) => one.value);
    if (names.join() !== known.join()) {
      this.axis.replaceChildren(...names.map((name) => new Option(name)));
    }
    this.clear(); // another client may have changed them in the meantime
  }

  clear() {
    this.rows = [];
    this.saved = null; // what the node has saved, by name; null: not asked for
    this.table.replaceChildren();
    this.say("");
  }

  say(text, isWrong = false) {
    this.message.textContent = text;
    this.message.classList.toggle("wrong", isWrong);
  }

  async read() {
    this.clear();
    this.say("reading");
    try {
      const { parameters } = await this.link.request("GET", `${pathOf(this.axis.value)}/parameters`);
      this.build(this.axis.value, parameters);
      await this.choose();
    } catch (error) {
      this.say(sentence(error), true);
    }
  }

  /** Shows what is chosen; what the node has saved is read only where it is wanted. */
  async choose() {
    const { rows } = this;
    if (this.shown.value === "saved" && rows.length && this.saved === null) {
      this.say("reading what the node has saved");
      try {
        const { saved } = await this.link.request("GET", `${pathOf(this.axis.value)}/saved`);
        if (rows !== this.rows) return; // of another axis
        this.saved = saved;
        for (const row of rows) this.show(row, row.known);
      } catch (error) {
        this.shown.value = "all";
        this.filter();
        this.say(sentence(error), true);
        return;
      }
    }
    this.filter();
  }

  build(axis, parameters) {
    const groups = new Map();
    for (const known of parameters) {
      if (!groups.has(known.group)) groups.set(known.group, []);
      groups.get(known.group).push(known);
    }
    for (const [group, members] of groups) {
      const table = document.createElement("table");
      table.innerHTML =
        "<caption></caption><thead><tr><th scope=col>Name</th><th scope=col>Value</th>" +
        "<th scope=col>Default</th><th scope=col>Limits</th><th scope=col>Purpose</th></tr></thead>" +
        "<tbody></tbody>";
      table.caption.textContent = group;
      for (const known of members) table.tBodies[0].append(this.rowOf(axis, known));
      this.table.append(table);
    }
    this.filter();
  }

  rowOf(axis, known) {
    const row = document.createElement("tr");
    const name = document.createElement("th");
    name.scope = "row";
    name.textContent = known.name;
    row.append(name, ...[0, 1, 2, 3].map(() => document.createElement("td")));
    const [value, , limits, text] = row.querySelectorAll("td");
    limits.textContent = known.allowed;
    text.textContent = known.text;
    if (this.mayChange) {
      const form = document.createElement("form");
      const input = document.createElement("input");
      input.setAttribute("aria-label", `${known.name}, axis ${axis}`);
      input.autocomplete = "off";
      input.spellcheck = false;
      form.append(input);
      form.addEventListener("submit", (event) => {
        event.preventDefault();
        this.set(axis, row, input.value);
      });
      value.append(form);
    }
    this.show(row, known);
    this.rows.push(row);
    return row;
  }

  show(row, known) {
    row.known = known;
    row.classList.toggle("changed", known.value !== known.default);
    const saved = this.saved?.[known.name];
    row.cells[2].textContent =
      known.default_written +
      (known.described === null ? "" : `; machine.toml: ${known.described}`) +
      (saved === undefined ? "" : `; saved: ${saved}`);
    const input = row.querySelector("input");
    if (input) input.value = known.written;
    else row.cells[1].textContent = known.written;
  }

  async set(axis, row, value) {
    try {
      const path = `${pathOf(axis)}/parameters/${row.known.name}`;
      this.show(row, { ...row.known, ...(await this.link.request("PUT", path, { value })) });
      this.say(`${row.known.name} is ${row.known.written}`);
    } catch (error) {
      this.say(sentence(error), true);
    }
  }

  filter() {
    const words = this.search.value.toLowerCase().split(/\s+/);
    let shown = 0;
    for (const row of this.rows) {
      const text = `${row.known.name} ${row.known.text}`.toLowerCase();
      const fits = words.every((word) => text.includes(word));
      const differs = {
        all: true,
        default: row.known.value !== row.known.default,
        described: row.known.as_described === false,
        saved: this.saved !== null && row.known.written !== this.saved[row.known.name],
      };
      row.hidden = !fits || !differs[this.shown.value];
      shown += !row.hidden;
    }
    for (const table of this.table.children) {
      table.hidden = [...table.tBodies[0].rows].every((row) => row.hidden);
    }
    if (this.rows.length) this.say(`${shown} of ${this.rows.length} parameters`);
  }
}
