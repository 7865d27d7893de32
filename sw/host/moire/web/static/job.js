// SPDX-License-Identifier: Apache-2.0
// The job of a station (S4): how far it is, and the actions that it accepts now.

import { sentence } from "./format.js";

const NAMES = {
  start: "Start",
  pause: "Pause",
  resume: "Resume",
  stop: "Stop the job",
  again: "Cut again",
  next: "Next station",
};

export class JobPanel {
  constructor(section, link) {
    Object.assign(this, { section, link, nodes: [], mayChange: false });
    section.innerHTML = `
      <div class="bar"><h2 id="job-title">Job</h2></div>
      <p role="status" data-field="words"></p>
      <progress aria-label="Stations that are cut" hidden></progress>
      <div class="row" role="group" aria-label="Actions of the job"></div>
      <p class="message" role="status"></p>`;
    this.words = section.querySelector("[data-field=words]");
    this.bar = section.querySelector("progress");
    this.buttons = section.querySelector(".row");
    this.message = section.querySelector(".message");
  }

  /** Looks for a node with a job. */
  async open(nodes, mayChange) {
    Object.assign(this, { nodes: [], mayChange });
    const found = [];
    for (const node of nodes) {
      const job = await this.link.request("GET", `/api/nodes/${node}/job`);
      if (job.built) found.push(node);
    }
    this.nodes = found;
    this.section.hidden = found.length === 0;
    if (found.length) await this.read();
  }

  async read() {
    if (!this.nodes.length) return;
    this.show(await this.link.request("GET", `/api/nodes/${this.nodes[0]}/job`));
  }

  show(job) {
    const why = job.state === "idle" || job.cause_words === "done" ? "" : `: ${job.cause_words}`;
    const text = `${job.words}${why}`;
    if (this.words.textContent !== text) this.words.textContent = text;
    this.bar.hidden = !job.stations;
    Object.assign(this.bar, { max: job.stations || 1, value: job.state === "finished" ? job.stations : job.station });
    const answers = this.mayChange ? job.answers : [];
    if (answers.join() === this.answers) return;
    this.answers = answers.join();
    this.buttons.replaceChildren(
      ...answers.map((action) => {
        const button = document.createElement("button");
        button.type = "button";
        button.textContent = NAMES[action] ?? action;
        button.onclick = () => this.act(action);
        return button;
      }),
    );
  }

  async act(action) {
    this.message.textContent = "";
    this.message.classList.remove("wrong");
    try {
      this.show(await this.link.request("POST", `/api/nodes/${this.nodes[0]}/job`, { action }));
    } catch (error) {
      this.message.textContent = sentence(error);
      this.message.classList.add("wrong");
    }
  }
}
