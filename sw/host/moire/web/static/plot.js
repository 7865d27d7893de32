// SPDX-License-Identifier: Apache-2.0
// Plots over time on a canvas: one quantity of all axes each.

const LONGEST_S = 125; // of the machine's time, that is kept
const GAP_S = 0.5; // without samples: the line is interrupted
export const MARGIN = { left: 64, right: 8, top: 8, bottom: 22 };
export const DASHES = [[], [6, 3], [2, 2], [8, 3, 2, 3]];

export const QUANTITIES = [
  { name: "Error", unit: "µm", of: (row) => (row.target_nm - row.position_nm) / 1e3 },
  { name: "Position", unit: "mm", of: (row) => row.position_nm / 1e6 },
  { name: "Velocity", unit: "mm/s", of: (row) => row.velocity_mm_s },
  { name: "Drive command", unit: "%", of: (row) => 100 * row.drive_command },
];

/** The samples of an axis, the oldest first. */
export class History {
  constructor() {
    this.rows = []; // [time, value of each quantity]
  }

  add(row) {
    const last = this.rows.at(-1)?.[0] ?? -Infinity;
    if (row.time_s < last) this.rows = []; // another machine
    if (row.time_s === last) return;
    this.rows.push([row.time_s, ...QUANTITIES.map((quantity) => quantity.of(row))]);
    if (this.rows[0][0] < row.time_s - LONGEST_S) {
      this.rows.splice(0, this.rows.findIndex(([time]) => time >= row.time_s - LONGEST_S));
    }
  }

  /** The samples from a time on. */
  since(time) {
    let low = 0;
    let high = this.rows.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.rows[middle][0] < time) low = middle + 1;
      else high = middle;
    }
    return this.rows.slice(low);
  }
}

/** Round numbers in a range, about so many. */
export function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + step * 1e-9; n++) {
    found.push((n * step).toFixed(digits).replace(/^-(0\.?0*)$/, "$1"));
  }
  return found;
}

/** A range with a margin around it; never empty. */
export function widened(low, high) {
  if (low > high) return [-1, 1];
  const margin = 0.06 * (high - low) || Math.max(Math.abs(high) * 1e-6, 1e-3);
  return [low - margin, high + margin];
}

/** The range of the values with a margin. */
function rangeOf(lists, index) {
  let low = Infinity;
  let high = -Infinity;
  for (const rows of lists) {
    for (const row of rows) {
      if (row[index] < low) low = row[index];
      if (row[index] > high) high = row[index];
    }
  }
  return widened(low, high);
}

/** Clears a canvas and draws the axes of a diagram; `marks` are [value, text] below it. Returns the
 *  context, its style, and the functions from values to pixels; null while it is not shown. */
export function frame(canvas, { from, to, low, high, marks }) {
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (!width || !height) return null;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const style = getComputedStyle(canvas);
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  const right = width - MARGIN.right;
  const bottom = height - MARGIN.bottom;
  const x = (value) => right - ((to - value) / (to - from)) * (right - MARGIN.left);
  const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - MARGIN.top);
  context.font = style.font;
  context.lineWidth = 1;
  context.strokeStyle = style.getPropertyValue("--grid");
  context.fillStyle = style.color;
  context.beginPath();
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const text of ticks(low, high, 4)) {
    const at = Math.round(y(Number(text))) + 0.5;
    context.moveTo(MARGIN.left, at);
    context.lineTo(right, at);
    context.fillText(text.replace("-", "−"), MARGIN.left - 6, at);
  }
  context.textBaseline = "bottom";
  for (const [value, text] of marks) {
    const at = Math.round(x(value)) + 0.5;
    context.moveTo(at, MARGIN.top);
    context.lineTo(at, bottom);
    const half = context.measureText(text).width / 2;
    context.textAlign = at + half > width ? "right" : "center";
    context.fillText(text, at, height);
  }
  context.stroke();
  context.lineWidth = 1.5;
  return { context, style, x, y, top: MARGIN.top, bottom };
}

export class Plot {
  constructor(quantity, index, parent) {
    this.quantity = quantity;
    this.index = index + 1; // in the rows of a history
    const figure = document.createElement("figure");
    this.caption = document.createElement("figcaption");
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    figure.append(this.caption, this.canvas);
    parent.append(figure);
    this.caption.textContent = `${quantity.name} in ${quantity.unit}`;
  }

  /** Draws the last `span` seconds of the histories, by name. */
  draw(histories, end, span) {
    const lists = [...histories.values()].map((history) => history.since(end - span));
    const [low, high] = rangeOf(lists, this.index);
    const marks = ticks(-span, 0, 4).map((text) => [
      end + Number(text),
      Number(text) === 0 ? "now" : `${text.replace("-", "−")} s`,
    ]);
    const drawn = frame(this.canvas, { from: end - span, to: end, low, high, marks });
    if (drawn === null) return;
    const { context, style, x, y } = drawn;
    lists.forEach((rows, number) => {
      context.strokeStyle = style.getPropertyValue(`--series-${(number % 4) + 1}`);
      context.setLineDash(DASHES[number % DASHES.length]);
      context.beginPath();
      let last = -Infinity;
      for (const row of rows) {
        if (row[0] - last > GAP_S) context.moveTo(x(row[0]), y(row[this.index]));
        else context.lineTo(x(row[0]), y(row[this.index]));
        last = row[0];
      }
      context.stroke();
      context.setLineDash([]);
    });
  }

  /** Says in words what the plot shows. */
  describe(histories, end, span) {
    const said = [...histories].map(([name, history]) => {
      const values = history.since(end - span).map((row) => row[this.index]);
      if (!values.length) return `axis ${name} has no samples`;
      const [low, high] = [Math.min(...values), Math.max(...values)].map((one) => one.toFixed(3));
      return `axis ${name} from ${low} to ${high}`;
    });
    const { name, unit } = this.quantity;
    const text = `${name} in ${unit} over the last ${span} s: ${said.join("; ")}`;
    this.canvas.setAttribute("aria-label", text);
  }
}
