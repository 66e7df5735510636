// Numbers as text, with the digits of the terminal and proper minus signs, text as numbers, and small vector algebra.

/**
 * Number with a count of significant digits, as Python's format ``g`` writes it.
 * @param {number} value
 * @param {number} [count]
 * @returns {string}
 */
export const digits = (value, count = 7) => plain(value, count).replace(/-/g, "\u2212");

/** Number that a person wrote, with a comma or a point, and any minus sign; NaN for other text. @param {string} text */
export const parsed = (text) => {
  const own = text.trim().replace(",", ".").replace(/\u2212/g, "-");
  return own === "inf" ? Infinity : own === "" ? NaN : Number(own);
};

/** @param {number} value @param {number} count */
const plain = (value, count) => {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "?" : value > 0 ? "inf" : "-inf";
  if (value === 0) return "0";
  const [mantissa, power] = value.toExponential(count - 1).split("e");
  const exponent = Number(power);
  const stripped = (/** @type {string} */ text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (exponent < -4 || exponent >= count) {
    const size = String(Math.abs(exponent)).padStart(2, "0");
    return `${stripped(mantissa)}e${exponent < 0 ? "-" : "+"}${size}`;
  }
  return stripped(value.toFixed(Math.max(0, count - 1 - exponent)));
};

/**
 * Number without rounding error: 0 below a part of a size.
 * @param {number} value
 * @param {number} size
 * @param {number} [part]
 */
export const settled = (value, size, part = 1e-9) => (Math.abs(value) <= part * Math.abs(size) ? 0 : value);

/**
 * Number with its unit.
 * @param {number} value
 * @param {string} unit
 * @param {number} [count]
 */
export const measured = (value, unit, count = 7) => `${digits(value, count)} ${unit}`.trimEnd();

/** @typedef {[number, number, number]} Vector */

/** @type {(a: Vector, b: Vector, factor?: number) => Vector} */
export const plus = (a, b, factor = 1) => [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
/** @type {(a: Vector, b: Vector) => number} */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @type {(a: Vector, b: Vector) => Vector} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @type {(a: Vector) => number} */
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
/** @type {(a: Vector) => Vector} */
export const unitOf = (a) => {
  const size = norm(a) || 1;
  return [a[0] / size, a[1] / size, a[2] / size];
};
