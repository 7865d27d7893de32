// SPDX-License-Identifier: Apache-2.0
// One signal of a record over time or frequency, with two cursors.

import { line, Plot } from "./plot.js";

export class Chart extends Plot {
  /** `signal` has name, unit, series (0 to 3). `pick(at, number)` is called when a cursor, 0 or 1,
   *  is to go to the sample `at`. */
  constructor(signal, parent, pick) {
    super(parent, signal.name, ({ color }) => ({
      series: [{}, { ...line(signal.series, color), dash: [], cap: "round" }],
      hooks: { draw: [(plot) => this.drawCursors(plot)] },
    }));
    Object.assign(this, { signal, cursors: [0, 0] });
    Object.assign(this.element.dataset, { signal: signal.name, series: signal.series + 1 });
    this.element.addEventListener("pointerdown", (event) => {
      if (!this.drawn) return;
      const picked = this.drawn.posToIdx(event.clientX - this.drawn.over.getBoundingClientRect().left);
      const [a, b] = this.cursors.map((one) => Math.abs(one - picked));
      pick(picked, b < a ? 1 : 0);
    });
  }

  /** Draws values over xs; `unit` is that of xs, `cursors` two places in them. */
  show({ xs, values, unit, cursors, title }) {
    this.cursors = cursors;
    this.caption.textContent = `${title} in ${this.signal.unit} over ${unit}`;
    const [low, high] = [Math.min(...values), Math.max(...values)].map((one) => one.toFixed(3));
    this.draw(
      [xs, values],
      `${this.caption.textContent}: ${values.length} values from ${low} to ${high}`,
    );
  }

  drawCursors({ ctx, bbox, data: [xs], valToPos }) {
    const letter = parseFloat(getComputedStyle(this.element).fontSize) * devicePixelRatio;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = getComputedStyle(this.element).color;
    ctx.lineWidth = devicePixelRatio;
    ctx.textBaseline = "top";
    this.cursors.forEach((at, number) => {
      const x = Math.round(valToPos(xs[at], "x", true)) + 0.5;
      ctx.setLineDash(number ? [2, 2] : [6, 3]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      const isRight = 2 * at > xs.length; // the letter is inside, and not on that of the other one
      ctx.textAlign = isRight ? "right" : "left";
      ctx.fillText("AB"[number], x + (isRight ? -3 : 3), bbox.top + letter * number);
    });
    ctx.restore();
  }
}
