// SPDX-License-Identifier: Apache-2.0
// A figure with a diagram, which uPlot draws in the colours and letters of the page.

const DASHES = [[], [6, 3], [2, 2], [8, 3, 2, 3]];
const ABSENT =
  "There are no plots, since this server has no uPlot: run “make page” in its checkout of Moire, " +
  "start the server again, and load this page again.";

/** uPlot, which is fetched beside everything else; null where the server does not have it. */
const library = Promise.all([import("./uplot/uPlot.esm.js"), style("/page/uplot/uPlot.min.css")])
  .then(([module]) => module.default)
  .catch(() => null);

function style(href) {
  return new Promise((onload, onerror) => {
    const rel = "stylesheet";
    document.head.append(Object.assign(document.createElement("link"), { rel, href, onload, onerror }));
  });
}

/** A range with a margin around it; never empty. */
export function widened(low, high) {
  if (low === null) return [-1, 1];
  const margin = 0.06 * (high - low) || Math.max(Math.abs(high) * 1e-6, 1e-3);
  return [low - margin, high + margin];
}

/** A number at an axis whose numbers are one `step` apart. */
export function label(value, step) {
  const power = Math.floor(Math.log10(step) + 1e-9);
  const isWhole = Math.abs(step / 10 ** power - Math.round(step / 10 ** power)) < 1e-6; // not 2.5
  const text = Math.abs(value).toFixed(Math.max(0, -power + (isWhole ? 0 : 1)));
  return `${value < 0 && Number(text) !== 0 ? "−" : ""}${text}`;
}

/** The look of the series of a number from 0 on: options of uPlot. `color` gives its colour. */
export function line(number, color) {
  return {
    stroke: color(number),
    width: 1.5,
    pxAlign: 0, // exactly where the samples are
    dash: DASHES[number % DASHES.length].map((one) => one * devicePixelRatio),
    points: { show: false },
  };
}

/** The same with a dot at each sample. */
export function dots(number, color, uPlot) {
  return {
    fill: color(number),
    width: 0,
    paths: uPlot.paths.points(),
    points: { show: false, size: 3, width: 0 },
  };
}

/** Options of uPlot for series that have abscissae of their own: the data is [null, [xs, ys], …]. */
export function ownAbscissae(series) {
  const facets = () => [{ scale: "x", auto: true }, { scale: "y", auto: true }];
  return { mode: 2, series: [null, ...series.map((one) => ({ ...one, facets: facets() }))] };
}

export class Plot {
  /** `options({ uPlot, color })` gives those options of uPlot that are its own, at least `series`;
   *  `x` and `y` in them are options of the axes. It is asked again when size or colours change. */
  constructor(parent, title, options) {
    Object.assign(this, { parent, options, drawn: null, data: null, uPlot: null });
    this.figure = document.createElement("figure");
    this.caption = document.createElement("figcaption");
    this.element = document.createElement("div");
    this.element.className = "plot";
    this.element.setAttribute("role", "img");
    this.element.owner = this;
    this.figure.append(this.caption, this.element);
    parent.append(this.figure);
    this.caption.textContent = title;
    library.then((found) => this.begin(found));
  }

  begin(uPlot) {
    this.uPlot = uPlot;
    if (uPlot !== null) new ResizeObserver(() => this.build()).observe(this.element);
    else {
      this.figure.remove();
      if (!this.parent.querySelector(".absent")) {
        this.parent.insertAdjacentHTML("beforeend", `<p class="note absent">${ABSENT}</p>`);
      }
    }
  }

  /** Draws this data of uPlot; `words` say what it shows. */
  draw(data, words) {
    const isAlike = this.drawn !== null && this.data.length === data.length;
    this.data = data;
    if (words !== undefined) this.describe(words);
    if (isAlike) this.drawn.setData(data);
    else this.build();
  }

  describe(words) {
    this.element.setAttribute("aria-label", words);
  }

  /** Makes the diagram from scratch, in the size and the colours that the page has now. */
  build() {
    this.drawn?.destroy();
    this.drawn = null;
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!this.uPlot || !this.data || !width || !height) return;
    const look = getComputedStyle(this.element);
    const color = (number) => look.getPropertyValue(`--series-${(number % 4) + 1}`);
    const { x, y, scales, hooks, ...own } = this.options({ uPlot: this.uPlot, color });
    const letter = Math.round(parseFloat(look.fontSize));
    const axis = {
      stroke: look.color,
      font: `${letter}px ${look.fontFamily}`,
      grid: { stroke: look.getPropertyValue("--grid"), width: 1 },
      ticks: { show: false },
      values: (plot, values, number, space, step) => values.map((value) => label(value, step)),
    };
    const options = {
      width,
      height,
      padding: [8, 1.5 * letter, 0, 0],
      legend: { show: false },
      cursor: { show: false },
      axes: [
        { ...axis, size: 2 * letter, gap: 4, space: 6 * letter, ...x },
        { ...axis, size: 5.5 * letter, gap: 6, space: 2.5 * letter, ...y },
      ],
      ...own,
      scales: { x: { time: false }, y: { range: (plot, low, high) => widened(low, high) } },
      hooks: { draw: [(plot) => this.note(plot), ...(hooks?.draw ?? [])] },
    };
    for (const name in scales) Object.assign(options.scales[name], scales[name]);
    this.drawn = new this.uPlot(options, this.data, this.element);
  }

  /** Keeps what is drawn where a program can read it. */
  note({ scales: { x, y } }) {
    const range = { from: x.min, to: x.max, low: y.min, high: y.max };
    this.element.dataset.range = JSON.stringify(range);
  }
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const element of document.querySelectorAll(".plot")) element.owner.build();
});
