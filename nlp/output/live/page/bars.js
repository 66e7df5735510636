// Bars of limits with editable values, and of actuator forces and speeds.
import { digits, parsed, settled } from "./numbers.js";
import { limitStatesOf } from "./limits.js";
import { limitName } from "./names.js";
import { byId, make, say } from "./panel.js";

/**
 * @typedef {import("./state.js").State} State
 */

/** Bars of the limits with editable values. */
export class LimitBars {
  /** @param {State} state @param {(act: () => void, key?: any) => void} change */
  constructor(state, change) {
    this.state = state;
    this.change = change;
    /** @type {Map<string, any>} */
    this.rows = new Map();
  }

  refresh() {
    const states = limitStatesOf(this.state.module, this.state.sides);
    for (const each of states) {
      if (!this.rows.has(each.key)) this.add(each);
      const { element, value, fill, mark, entry } = this.rows.get(each.key);
      const shown = each.value * each.factor, isKnown = Number.isFinite(shown), limit = each.limit * each.factor;
      const at = isKnown ? shown : limit, low = Math.min(0, at, limit), high = Math.max(at, limit, low + 1e-300) * (Math.max(at, limit) > 0 ? 1.12 : 1);
      const part = (/** @type {number} */ value) => `${Math.max(0, Math.min(100, (100 * (value - low)) / (high - low))).toFixed(1)}%`;
      element.classList.toggle("violated", each.isViolated);
      say(value, `${isKnown ? digits(settled(shown, limit), 5) : each.isViolated ? "" : "satisfied"}${each.isViolated ? " violated" : ""}`);
      element.title = `limits.${each.key}: ${each.name}`;
      fill.style.width = isKnown ? part(shown) : "0";
      mark.style.left = part(limit);
      if (entry && document.activeElement !== entry) entry.value = digits(limit);
    }
    byId("limits-group").hidden = !states.length;
    return states;
  }

  /** @param {import("./limits.js").LimitState} each */
  add(each) {
    const { state } = this, value = make("span", { class: "value" });
    const fill = make("i", {}), mark = make("b", {}), bar = make("span", { class: "track" }, fill, mark);
    /** @type {any} */
    let entry = null;
    const sign = each.side === "min" ? "\u2265" : "\u2264";
    if (each.settable >= 0) {
      entry = make("input", { type: "text", inputmode: "decimal", class: "entry", "aria-label": `limit, ${limitName(each.key)}, ${each.side === "min" ? "at least" : "at most"}`, autocomplete: "off" });
      entry.addEventListener("change", () => this.change(() => {
        const isSet = state.setLimit(each.settable, parsed(entry.value));
        entry.setAttribute("aria-invalid", String(!isSet));
      }));
    }
    const stated = entry ?? make("span", { class: "entry" }, digits(each.limit * each.factor));
    const name = make("span", { class: "name" }, limitName(each.key));
    const element = make("div", { class: "limit" }, name, value, make("span", { class: "sign" }, sign), stated, make("span", { class: "unit" }, each.unit), bar);
    byId("limits").append(element);
    this.rows.set(each.key, { element, value, fill, mark, entry });
  }
}

/** Smallest limit on a force or speed of an actuator, in units of computations; NaN without one. @param {State} state @param {"actuator_force" | "actuator_speed"} kind @param {string} name */
const limitOf = (state, kind, name) => {
  const own = state.sides.filter(({ key, row }) => key.startsWith(kind) && `${row.name} `.includes(`actuator ${name} `));
  const found = own.map(({ settable, stated }) => Math.abs(settable < 0 ? stated : state.module.arrays.limits[settable]));
  return found.length ? Math.min(...found) : NaN;
};

/**
 * Forces and speeds of the actuators in a table, each with a bar: its part of the limit, or of the largest in its column.
 * @param {State} state
 */
export const showActuators = (state) => {
  const { data, module } = state, { blocks } = data, { view } = module.arrays;
  if (!blocks.largest) return;
  const body = byId("actuators"), count = data.actuators.length;
  /** @type {{ values: number[], kind: "actuator_force" | "actuator_speed" }[]} */
  const columns = data.loads.map((/** @type {string} */ _, /** @type {number} */ load) => ({ kind: "actuator_force", values: Array.from({ length: count }, (_, k) => {
    const [high, low] = ["largest", "smallest"].map((name) => view[blocks[name][0] + load * count + k]);
    return Math.abs(high) >= Math.abs(low) ? high : low;
  }) }));
  if (blocks.speeds[1]) columns.push({ kind: "actuator_speed", values: Array.from({ length: count }, (_, k) => view[blocks.speeds[0] + k]) });
  data.actuators.forEach((/** @type {any} */ each, /** @type {number} */ k) => {
    const row = body.children[k] ?? body.appendChild(make("tr", {}, make("th", { scope: "row" }, each.name), ...columns.map(() => make("td", {}, make("span", {}), make("span", { class: "track" }, make("i", {}))))));
    columns.forEach(({ values, kind }, i) => {
      const largest = Math.max(...values.map(Math.abs)), limit = limitOf(state, kind, each.name), value = settled(values[k], largest);
      const part = Math.abs(value) / (Number.isFinite(limit) ? limit : largest || 1), factor = kind === "actuator_speed" ? each.factor : 1;
      const [text, track] = /** @type {HTMLCollectionOf<HTMLElement>} */ (row.children[i + 1].children), fill = /** @type {HTMLElement} */ (track.firstChild);
      const isOver = part > 1 + 1e-6 && Number.isFinite(limit);
      say(text, `${digits(value * factor, 5)}${isOver ? " violated" : ""}`);
      fill.style.width = `${Math.min(100, 100 * part).toFixed(1)}%`;
      track.title = Number.isFinite(limit) ? `${digits(100 * part, 3)} % of the limit` : `${digits(100 * part, 3)} % of the largest`;
      row.children[i + 1].classList.toggle("violated", isOver);
    });
  });
};
