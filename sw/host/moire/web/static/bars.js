// SPDX-License-Identifier: Apache-2.0
// Diagrams of panels: bars side by side for each place, and points or a line over a position.

import { frame, ticks, widened } from "./plot.js";

/** A figure with its canvas; `title` says what is shown, with its units. */
export function figure(parent, title) {
  const made = document.createElement("figure");
  const caption = document.createElement("figcaption");
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  caption.textContent = title;
  made.append(caption, canvas);
  parent.append(made);
  return canvas;
}

/** Draws series of bars: `places` below them, `series` lists of values from 0 on. */
export function drawBars(canvas, places, series) {
  const high = 1.06 * Math.max(1e-6, ...series.flat());
  const marks = places.map((place, at) => [at + 0.5, String(place)]);
  canvas.dataset.range = JSON.stringify({ from: 0, to: places.length, low: 0, high });
  const drawn = frame(canvas, { from: 0, to: places.length, low: 0, high, marks });
  if (drawn === null) return;
  const { context, style, x, y, bottom } = drawn;
  const width = (x(1) - x(0)) / (series.length + 1);
  series.forEach((values, number) => {
    context.fillStyle = style.getPropertyValue(`--series-${number + 1}`);
    values.forEach((value, at) => {
      const left = x(at) + width * (number + 0.5);
      context.fillRect(left, y(value), width - 1, bottom - y(value));
    });
  });
}

/** Draws ys over xs as points, or as a line; `limits` are horizontal lines. */
export function drawOver(canvas, xs, ys, { limits = [], isLine = false } = {}) {
  const [from, to] = widened(Math.min(...xs), Math.max(...xs));
  const [low, high] = widened(Math.min(...ys, ...limits), Math.max(...ys, ...limits));
  const marks = ticks(from, to, 4).map((text) => [Number(text), text.replace("-", "−")]);
  canvas.dataset.range = JSON.stringify({ from, to, low, high });
  const drawn = frame(canvas, { from, to, low, high, marks });
  if (drawn === null) return;
  const { context, style, x, y } = drawn;
  context.setLineDash([6, 3]);
  context.strokeStyle = style.getPropertyValue("--series-2");
  for (const limit of limits) {
    context.beginPath();
    context.moveTo(x(from), y(limit));
    context.lineTo(x(to), y(limit));
    context.stroke();
  }
  context.setLineDash([]);
  context.fillStyle = context.strokeStyle = style.getPropertyValue("--series-1");
  context.beginPath();
  xs.forEach((value, at) => {
    if (isLine) context.lineTo(x(value), y(ys[at]));
    else context.fillRect(x(value) - 1, y(ys[at]) - 1, 2, 2);
  });
  context.stroke();
}

/** Calls `draw` again when a canvas changes its size, or the colours change. */
export function redrawn(canvas, draw) {
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}
