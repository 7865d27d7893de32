// SPDX-License-Identifier: Apache-2.0
// Diagrams of panels: bars side by side for each place, and points or a line over a position.

import { dots, line, ownAbscissae, Plot, widened } from "./plot.js";

/** Two series of bars, side by side. */
export class Bars extends Plot {
  constructor(parent, title) {
    super(parent, title, ({ uPlot, color }) => ({
      ...ownAbscissae(
        [-1, 1].map((align, number) => ({
          fill: color(number),
          width: 0,
          paths: uPlot.paths.bars({ size: [0.35], align }),
          points: { show: false },
        })),
      ),
      scales: {
        x: { range: (plot, low, high) => [low - 0.5, high + 0.5] },
        y: { range: (plot, low, high) => [0, 1.06 * Math.max(high, 1e-6)] },
      },
      x: { splits: () => this.data[1][0] },
    }));
  }

  /** Draws the values, from 0 on, of both series at the places. */
  show(places, series, words) {
    this.draw([null, ...series.map((values) => [places, values])], words);
  }
}

/** Values over a position as dots, or as a line, with horizontal lines for limits. */
export class Over extends Plot {
  constructor(parent, title, { isLine = false } = {}) {
    super(parent, title, ({ uPlot, color }) => ({
      ...ownAbscissae([
        isLine ? line(0, color) : dots(0, color, uPlot),
        ...this.data.slice(2).map(() => line(1, color)),
      ]),
      scales: { x: { range: (plot, low, high) => widened(low, high) } },
    }));
  }

  show(xs, ys, words, limits = []) {
    const ends = widened(Math.min(...xs), Math.max(...xs));
    this.draw([null, [xs, ys], ...limits.map((limit) => [ends, [limit, limit]])], words);
  }
}
