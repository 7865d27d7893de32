// SPDX-License-Identifier: Apache-2.0
// A live plot: one quantity of all axes over the last seconds.

import { line, ownAbscissae, Plot } from "./plot.js";

export class LivePlot extends Plot {
  /** `number` is that of the quantity in the columns of a History. */
  constructor(quantity, number, parent) {
    super(parent, `${quantity.name} in ${quantity.unit}`, ({ color }) => ({
      ...ownAbscissae(this.data.slice(1).map((_, axis) => line(axis, color))),
      scales: { x: { range: () => [this.end - this.span, this.end] } },
      x: { splits: (...known) => this.marks(known[4]), values: (plot, times) => this.ages(times) },
    }));
    Object.assign(this, { quantity, number, end: 0, span: 1 });
  }

  /** The times of the marks: whole steps before the end. */
  marks(step) {
    const count = Math.floor(this.span / step);
    return [...Array(count + 1).keys()].map((one) => this.end - (count - one) * step);
  }

  ages(times) {
    return times.map((time) => {
      const age = Number((this.end - time).toFixed(3));
      return age === 0 ? "now" : `−${age} s`;
    });
  }

  /** Draws the last `span` seconds before `end` of the columns of all axes. */
  show(columns, end, span) {
    Object.assign(this, { end, span });
    this.draw([null, ...columns.map((one) => [one[0], one[this.number]])]);
  }

  /** Says in words what the plot shows of the axes with these names. */
  say(names, columns, span) {
    const said = names.map((name, axis) => {
      const values = columns[axis][this.number].filter((value) => value !== null);
      if (!values.length) return `axis ${name} has no samples`;
      const [low, high] = [Math.min(...values), Math.max(...values)].map((one) => one.toFixed(3));
      return `axis ${name} from ${low} to ${high}`;
    });
    const { name, unit } = this.quantity;
    this.describe(`${name} in ${unit} over the last ${span} s: ${said.join("; ")}`);
  }
}
