// SPDX-License-Identifier: Apache-2.0
// What the server has met on the bus since its start, and who is connected to it.

const ROWS = [
  ["exchanges", "Exchanges"],
  ["repeats", "Repeats"],
  ["no_answer", "No answer"],
  ["garbled", "Garbled"],
  ["no_request", "Packets that were no request"],
];

export class BusPanel {
  constructor(section, link) {
    Object.assign(this, { section, link, last: null });
    section.innerHTML = `
      <div class="bar"><h2 id="bus-title">Bus</h2></div>
      <dl></dl>
      <p class="note">Since the start of the server. No answer also counts absent nodes that were
        looked for.</p>
      <ul aria-label="Clients"></ul>`;
    this.clients = section.querySelector("ul");
    const list = section.querySelector("dl");
    this.fields = Object.fromEntries(
      ROWS.map(([key, name]) => {
        const row = document.createElement("div");
        row.append(document.createElement("dt"), document.createElement("dd"));
        row.firstChild.textContent = name;
        list.append(row);
        return [key, row.lastChild];
      }),
    );
  }

  async read() {
    const found = await this.link.request("GET", "/api/bus");
    const now = performance.now();
    for (const [key] of ROWS) this.fields[key].textContent = String(found[key]);
    if (this.last !== null && found.exchanges >= this.last.exchanges) {
      const rate = (1e3 * (found.exchanges - this.last.exchanges)) / (now - this.last.now);
      this.fields.exchanges.textContent += `, ${Math.round(rate)} per s`;
    }
    this.last = { now, exchanges: found.exchanges };
    this.section.hidden = false;
    if (found.clients.join() === this.names) return;
    this.names = found.clients.join();
    this.clients.replaceChildren(
      ...found.clients.map((name) => {
        const item = document.createElement("li");
        item.textContent = name;
        return item;
      }),
    );
  }
}
