// SPDX-License-Identifier: Apache-2.0
// What the live plots show: the latest samples of each axis, and the quantities in them.

const LONGEST_S = 125; // of the machine's time, that is kept
const GAP_S = 0.5; // without samples: the line is interrupted

export const QUANTITIES = [
  { name: "Error", unit: "µm", of: (row) => (row.target_nm - row.position_nm) / 1e3 },
  { name: "Position", unit: "mm", of: (row) => row.position_nm / 1e6 },
  { name: "Velocity", unit: "mm/s", of: (row) => row.velocity_mm_s },
  { name: "Drive command", unit: "%", of: (row) => 100 * row.drive_command },
];

/** The samples of an axis, the oldest first. */
export class History {
  constructor() {
    this.empty();
  }

  empty() {
    this.columns = [[], ...QUANTITIES.map(() => [])]; // the times, then each quantity
  }

  /** The time of the last sample; undefined without samples. */
  get end() {
    return this.columns[0].at(-1);
  }

  add(row) {
    if (row.time_s < this.end) this.empty(); // another machine
    if (row.time_s === this.end) return;
    if (row.time_s - this.end > GAP_S) this.append(row.time_s, QUANTITIES.map(() => null));
    this.append(row.time_s, QUANTITIES.map((quantity) => quantity.of(row)));
    if (row.time_s - this.columns[0][0] > 1.1 * LONGEST_S) {
      this.columns = this.since(row.time_s - LONGEST_S);
    }
  }

  append(time, values) {
    [time, ...values].forEach((value, at) => this.columns[at].push(value));
  }

  /** The times from this one on, and the values of each quantity at them; null is a gap. */
  since(time) {
    const [times] = this.columns;
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < time) low = middle + 1;
      else high = middle;
    }
    return this.columns.map((values) => values.slice(low));
  }
}
