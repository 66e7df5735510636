// Limits of a state: the sides that the case states, their values and margins, and the value next to each limit.

/**
 * @typedef {import("./state.js").Row} Row
 * @typedef {import("./state.js").Limit} Limit
 * @typedef {import("./module.js").CaseModule} CaseModule
 * @typedef {{ row: Row, side: "min" | "max", stated: number, key: string, settable: number }} Side
 * @typedef {{ key: string, name: string, side: "min" | "max", limit: number, value: number, unit: string, factor: number,
 *   isViolated: boolean, settable: number }} LimitState
 */

/** Violation of a limit, relative to it, that counts as rounding. */
const ROUNDING = 1e-6;

/** Values of limits with a stated side, in the order of the rows. @param {Row[]} rows @param {Limit[]} limits @returns {Side[]} */
export const sidesOf = (rows, limits) =>
  rows.flatMap((row) =>
    /** @type {const} */ (["min", "max"]).flatMap((side) => {
      const stated = side === "min" ? row.low : row.high;
      if (stated === null) return [];
      const key = row.keys[side === "min" ? 0 : 1] || `${row.name}.${side}`;
      return [{ row, side, stated, key, settable: limits.findIndex((each) => each.key === key) }];
    }),
  );

/** Limit and value of a side in units of computations, and relative margin, negative for a violation. @param {CaseModule} module @param {Side} side */
export const measuredSide = (module, { row, side, stated, settable }) => {
  const { readings, limits, g, g_lower, g_upper } = module.arrays, sign = side === "min" ? 1 : -1;
  const limit = settable < 0 ? stated : limits[settable], k = row.constraint;
  if (row.reading >= 0) {
    const value = readings[row.reading], size = Math.max(Math.abs(limit), Math.abs(value)) || 1;
    return { limit, value, margin: (sign * (value - limit)) / size };
  }
  if (k < 0) return { limit, value: NaN, margin: 0 };
  const bound = (side === "min" ? g_lower : g_upper)[k], size = Math.max(Math.abs(bound), Math.abs(g[k])) || 1;
  return { limit, value: NaN, margin: (sign * (g[k] - bound)) / size };
};

/** Smallest relative margin of all sides, negative for a violated one; Infinity without limits. @param {CaseModule} module @param {Side[]} sides */
export const leastMarginOf = (module, sides) => {
  let least = Infinity;
  for (const each of sides) {
    const { margin } = measuredSide(module, each);
    if (!(margin >= least)) least = Number.isNaN(margin) ? -Infinity : margin;
  }
  return least;
};

/** Limits with the value that is nearest to each, violated or not. @param {CaseModule} module @param {Side[]} sides @returns {LimitState[]} */
export const limitStatesOf = (module, sides) => {
  /** @type {Map<string, LimitState>} */
  const found = new Map(), margins = new Map();
  for (const each of sides) {
    const { key, row, side, settable } = each, { limit, value, margin } = measuredSide(module, each);
    if (found.has(key) && margin >= margins.get(key)) continue;
    margins.set(key, margin);
    found.set(key, { key, name: row.name, side, limit, value, unit: row.unit, factor: row.factor, isViolated: margin < -ROUNDING, settable });
  }
  return [...found.values()];
};
