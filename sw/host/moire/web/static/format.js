// SPDX-License-Identifier: Apache-2.0
// Numbers as texts with units, and texts of people as lengths for the server.

const THIN = "\u2009";

/** A length in mm with its nanometres, in groups of three digits. */
export function mm(nm) {
  const [whole, part] = (Math.abs(nm) / 1e6).toFixed(6).split(".");
  const sign = nm < 0 && Number(`${whole}.${part}`) ? "−" : "";
  return `${sign}${whole}.${part.slice(0, 3)}${THIN}${part.slice(3)}`;
}

/** A signed number with so many digits after the point. */
export function signed(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  return `${Number(text) === 0 ? "" : value < 0 ? "−" : "+"}${text}`;
}

/** The number of a person as the server reads it; throws an Error that says what is wrong. */
export function lengthOf(text, unit) {
  const plain = text.trim().replace("−", "-");
  if (!/^[-+]?(\d+\.?\d*|\.\d+)$/.test(plain)) {
    throw new Error(`"${text.trim()}" is no number: write one such as 1.5 or -0.25`);
  }
  return `${plain} ${unit}`;
}

/** A refusal of the server in one sentence. */
export function sentence(error) {
  const remedy = error.to_do ? `: ${error.to_do}` : "";
  return `${error.message}${remedy}`;
}
