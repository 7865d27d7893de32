// SPDX-License-Identifier: Apache-2.0
// One signal of a record over time or frequency, with two cursors.

import { DASHES, frame, ticks, widened } from "./plot.js";

/** The place of the value in an ascending list that is nearest to this one. */
export function nearest(values, value) {
  let best = 0;
  values.forEach((one, at) => {
    if (Math.abs(one - value) < Math.abs(values[best] - value)) best = at;
  });
  return best;
}

export class Chart {
  /** `signal` has name, unit, series (1 to 4). `pick(at, number)` is called when a cursor, 0 or 1,
   *  is to go to the sample `at`. */
  constructor(signal, parent, pick) {
    this.signal = signal;
    this.shown = this.drawn = null;
    const figure = document.createElement("figure");
    this.caption = document.createElement("figcaption");
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.dataset.signal = signal.name;
    figure.append(this.caption, this.canvas);
    parent.append(figure);
    this.canvas.addEventListener("pointerdown", (event) => {
      const picked = this.at(event.offsetX);
      if (picked === null) return;
      const [a, b] = this.shown.cursors.map((one) => Math.abs(one - picked));
      pick(picked, b < a ? 1 : 0);
    });
  }

  /** The sample that is drawn nearest to a pixel; null while nothing is. */
  at(pixel) {
    if (this.drawn === null) return null;
    return nearest(this.shown.xs.map(this.drawn.x), pixel);
  }

  /** Draws values over xs; `unit` is that of xs, `cursors` two places in them. */
  draw({ xs, values, unit, cursors, title }) {
    this.shown = { xs, values, unit, cursors };
    this.caption.textContent = `${title} in ${this.signal.unit} over ${unit}`;
    const [from, to] = [xs[0], xs.at(-1)];
    const [low, high] = widened(Math.min(...values), Math.max(...values));
    const marks = ticks(from, to, 4).map((text) => [Number(text), text.replace("-", "−")]);
    this.canvas.dataset.range = JSON.stringify({ from, to, low, high });
    this.canvas.setAttribute(
      "aria-label",
      `${this.caption.textContent}: ${values.length} values from ` +
        `${Math.min(...values).toFixed(3)} to ${Math.max(...values).toFixed(3)}`,
    );
    this.drawn = frame(this.canvas, { from, to, low, high, marks });
    if (this.drawn === null) return;
    const { context, style, x, y, top, bottom } = this.drawn;
    context.strokeStyle = style.color;
    cursors.forEach((at, number) => {
      context.setLineDash(DASHES[number + 1]);
      context.beginPath();
      context.moveTo(x(xs[at]), top);
      context.lineTo(x(xs[at]), bottom);
      context.stroke();
      const isRight = 2 * at > xs.length; // the letter is inside, and not on that of the other one
      context.textAlign = isRight ? "right" : "left";
      context.textBaseline = "top";
      context.fillText("AB"[number], x(xs[at]) + (isRight ? -3 : 3), top + 12 * number);
    });
    context.setLineDash([]);
    context.strokeStyle = style.getPropertyValue(`--series-${this.signal.series}`);
    context.lineCap = context.lineJoin = "round"; // the ends are whole, and peaks have no spikes
    context.beginPath();
    xs.forEach((value, at) => context.lineTo(x(value), y(values[at])));
    context.stroke();
    context.lineCap = "butt";
    context.lineJoin = "miter";
  }
}
