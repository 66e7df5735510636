// Controls and values beside the picture: sliders, limits, headline, actuators.
import { digits, measured, settled } from "./numbers.js";
import { rotationsOf } from "./text.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./state.js").Slider} Slider
 */

/** @param {string} id */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/**
 * Element with text and attributes.
 * @param {string} name
 * @param {Record<string, string>} attributes
 * @param {(Node | string)[]} content
 * @returns {any}
 */
export const make = (name, attributes, ...content) => {
  const found = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) found.setAttribute(key, value);
  found.append(...content);
  return found;
};

/** Picture of a padlock. @param {boolean} isClosed */
const padlock = (isClosed) => {
  const space = "http://www.w3.org/2000/svg", picture = document.createElementNS(space, "svg"), path = document.createElementNS(space, "path");
  picture.setAttribute("viewBox", "0 0 16 16");
  picture.setAttribute("aria-hidden", "true");
  path.setAttribute("d", `M3 7.5h10v7H3z${isClosed ? "M5 7.5v-3a3 3 0 0 1 6 0v3" : "M5 7.5v-3a3 3 0 0 1 5.8-1"}`);
  picture.append(path);
  return picture;
};

/** Text that is set only where it differs, so that a page is laid out once. @param {Element} element @param {string} text */
const say = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};

/** Rows with a slider for each value. */
export class Sliders {
  /**
   * @param {State} state
   * @param {(act: () => void, key?: any) => void} change runs a change of the state, then shows it
   */
  constructor(state, change) {
    this.state = state;
    this.rows = state.sliders.map((slider) => this.row(slider, change));
    for (const group of ["dimension", "pose"]) {
      const own = this.rows.filter(({ slider }) => slider.group === group);
      byId(`${group}s`).append(...own.map((each) => each.element));
      byId(`${group}-group`).hidden = !own.length;
    }
  }

  /** @param {Slider} slider @param {(act: () => void, key?: any) => void} change */
  row(slider, change) {
    const { state } = this, [low, high] = state.ends(slider), id = `slider-${state.sliders.indexOf(slider)}`;
    const range = make("input", { type: "range", id, min: String(low), max: String(high), step: "any", "aria-label": slider.name });
    const entry = make("input", { type: "text", inputmode: "decimal", "aria-label": `${slider.name}, exact value`, class: "entry", autocomplete: "off" });
    const lock = make("button", { type: "button", class: "lock" });
    const bar = make("i", {}), slope = make("span", { class: "slope" }, bar);
    const isFixed = slider.vector === "p";
    if (isFixed) lock.disabled = true;
    range.addEventListener("input", () => change(() => state.move(slider, Number(range.value)), slider));
    entry.addEventListener("change", () => {
      const value = Number(entry.value.replace(",", ".").replace("\u2212", "-"));
      const isIn = Number.isFinite(value) && entry.value.trim() !== "" && (isFixed || (value >= low - 1e-12 * Math.abs(low) && value <= high + 1e-12 * Math.abs(high)));
      entry.setAttribute("aria-invalid", String(!isIn));
      entry.title = isIn ? "" : `a number from ${digits(low)} to ${digits(high)}`;
      if (isIn) change(() => state.move(slider, isFixed ? value : Math.max(low, Math.min(high, value))));
    });
    lock.addEventListener("click", () => change(() => state.hold(slider, !state.isHeld(slider))));
    const label = make("label", { for: id }, slider.name), unit = make("span", { class: "unit" }, slider.unit);
    const element = make("div", { class: "slider" }, label, range, entry, unit, lock, slope);
    return { slider, element, range, entry, lock, bar, slope };
  }

  refresh() {
    const { state } = this;
    const gains = this.rows.map(({ slider }) => {
      const [low, high] = state.ends(slider);
      return state.slope(slider) * (high - low);
    });
    const most = Math.max(...gains.map((each) => Math.abs(each) || 0), 1e-300);
    this.rows.forEach(({ slider, element, range, entry, lock, bar, slope }, k) => {
      const [low, high] = state.ends(slider), value = settled(state.read(slider), high - low), isHeld = state.isHeld(slider);
      const shown = digits(value);
      if (document.activeElement !== entry && entry.value !== shown) entry.value = shown;
      if (document.activeElement !== range || Math.abs(Number(range.value) - value) > 1e-9 * (high - low)) range.value = String(value);
      range.setAttribute("aria-valuetext", measured(value, slider.unit));
      element.classList.toggle("held", isHeld);
      element.hidden = slider.pose >= 0 && slider.pose !== state.data.stated_poses[state.pose];
      const words = slider.vector === "p" ? "fixed in the case" : isHeld ? "held: not solved for" : "solved for";
      if (lock.title !== words) {
        lock.title = words;
        lock.setAttribute("aria-label", `${slider.name}: ${words}`);
        lock.setAttribute("aria-pressed", String(isHeld));
        lock.replaceChildren(padlock(isHeld));
      }
      const part = Number.isFinite(gains[k]) ? Math.min(1, Math.abs(gains[k]) / most) : 0;
      bar.style.width = `${(50 * part).toFixed(1)}%`;
      bar.className = gains[k] < 0 ? "minus" : "";
      const derivative = state.slope(slider);
      slope.title = Number.isFinite(derivative) ? `dF/d${slider.name} = ${digits(derivative, 4)} per ${slider.unit || "1"}` : "";
    });
  }
}

/** Fields for axis, point and pitch of each task. */
export class TaskFields {
  /** @param {State} state @param {(act: () => void, key?: any) => void} change */
  constructor(state, change) {
    this.state = state;
    /** @type {{ entry: any, read: () => number }[]} */
    this.fields = [];
    const length = state.data.units.length;
    const units = /** @type {Record<string, string>} */ ({ axis: "", point: length, pitch: `${length}/rad` });
    state.data.stated_tasks.forEach((/** @type {any} */ stated, /** @type {number} */ task) => {
      if (stated.axis && state.tasks.length > 1) byId("tasks").append(make("p", { class: "task-name" }, state.data.tasks[task].name));
      for (const key of /** @type {const} */ (["axis", "point", "pitch"])) {
        if (stated[key] === undefined) continue;
        const count = key === "pitch" ? 1 : 3, name = `${state.data.tasks[task].name}: ${key}`;
        const entries = Array.from({ length: count }, (_, place) => this.field(task, key, place, count > 1 ? `${name}, ${"xyz"[place]}` : name, change));
        byId("tasks").append(make("div", { class: "task-row" }, make("span", { class: "name" }, key), ...entries, make("span", { class: "unit" }, units[key])));
      }
    });
    byId("tasks-group").hidden = !this.fields.length;
  }

  /** @param {number} task @param {"axis" | "point" | "pitch"} key @param {number} place @param {string} name @param {(act: () => void) => void} change */
  field(task, key, place, name, change) {
    const entry = make("input", { type: "text", inputmode: "text", class: "entry", "aria-label": name, autocomplete: "off" });
    entry.addEventListener("change", () => change(() => {
      const text = entry.value.trim().replace(",", "."), value = text === "inf" ? Infinity : text === "" ? NaN : Number(text);
      entry.setAttribute("aria-invalid", String(!this.state.setTask(task, key, place, value)));
    }));
    this.fields.push({ entry, read: () => (key === "pitch" ? this.state.tasks[task].pitch : this.state.tasks[task][key][place]) });
    return entry;
  }

  refresh() {
    for (const { entry, read } of this.fields) {
      const text = digits(read());
      if (document.activeElement !== entry && entry.value !== text) entry.value = text;
    }
  }
}

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
    const states = this.state.limitStates();
    for (const each of states) {
      if (!this.rows.has(each.key)) this.add(each);
      const { element, value, fill, mark, entry } = this.rows.get(each.key);
      const shown = each.value * each.factor, isKnown = Number.isFinite(shown), limit = each.limit * each.factor;
      const at = isKnown ? shown : limit, low = Math.min(0, at, limit), high = Math.max(at, limit, low + 1e-300) * (Math.max(at, limit) > 0 ? 1.12 : 1);
      const part = (/** @type {number} */ value) => `${Math.max(0, Math.min(100, (100 * (value - low)) / (high - low))).toFixed(1)}%`;
      element.classList.toggle("violated", each.isViolated);
      say(value, `${isKnown ? digits(settled(shown, limit), 5) : each.isViolated ? "" : "satisfied"}${each.isViolated ? " violated" : ""}`);
      element.title = each.name;
      fill.style.width = isKnown ? part(shown) : "0";
      mark.style.left = part(limit);
      if (entry && document.activeElement !== entry) entry.value = digits(limit);
    }
    byId("limits-group").hidden = !states.length;
    return states;
  }

  /** @param {import("./state.js").LimitState} each */
  add(each) {
    const { state } = this, value = make("output", { class: "value" });
    const fill = make("i", {}), mark = make("b", {}), bar = make("span", { class: "track" }, fill, mark);
    /** @type {any} */
    let entry = null;
    const sign = each.side === "min" ? "\u2265" : "\u2264";
    if (each.settable >= 0) {
      entry = make("input", { type: "text", inputmode: "decimal", class: "entry", "aria-label": `limit ${each.key}`, autocomplete: "off" });
      entry.addEventListener("change", () => this.change(() => {
        const isSet = state.setLimit(each.settable, Number(entry.value.replace(",", ".")));
        entry.setAttribute("aria-invalid", String(!isSet));
      }));
    }
    const stated = entry ?? make("span", { class: "entry" }, digits(each.limit * each.factor));
    const name = make("span", { class: "name" }, each.key.replace(/\.(min|max)$/, ""));
    const element = make("div", { class: "limit" }, name, value, make("span", { class: "sign" }, sign), stated, make("span", { class: "unit" }, each.unit), bar);
    byId("limits").append(element);
    this.rows.set(each.key, { element, value, fill, mark, entry });
  }
}

/** Headline, and the values of the point. @param {State} state @param {import("./state.js").LimitState[]} limits */
export const showValues = (state, limits) => {
  const { data, module } = state, { F, singular_values } = module.arrays;
  const { word, words, isFault } = state.headline();
  const violated = limits.filter((each) => each.isViolated).length;
  const value = state.fault & 3 ? NaN : F[0];
  const extreme = state.kind === "program" && data.tasks.length === 1 ? (data.sense === "max" ? "largest " : "smallest ") : "";
  say(byId("F"), `${extreme}${data.F_name} = ${measured(value, data.F_unit)}`);
  say(byId("word"), word);
  say(byId("words"), words + (violated ? `; ${violated} limit${violated > 1 ? "s" : ""} violated` : ""));
  byId("answer").classList.toggle("none", isFault || violated > 0);
  byId("answer").classList.toggle("proved", state.kind === "program");
  byId("stated-task").hidden = state.hasOtherTask();
  const rank = module.rank();
  say(byId("rank"), `${rank}${rank < 6 ? " (singular)" : ""}`);
  say(byId("singular"), digits(singular_values[5], 5));
  byId("singular-row").hidden = data.has_members;
  const turns = rotationsOf(state).map((/** @type {any} */ each) => `${each.axis.map((/** @type {number} */ part) => digits(settled(part, 1), 5)).join("  ")}, ${measured(settled(each.angle, 180), data.units.angle)}`);
  say(byId("turn"), turns.join("; "));
  byId("turn-row").hidden = !turns.length;
  say(byId("time"), `${(1000 * state.seconds).toFixed(1)} ms`);
  byId("time-row").hidden = !state.seconds;
  byId("to-answer").hidden = !data.answer;
  showActuators(state);
};

/** @param {State} state */
const showActuators = (state) => {
  const { data, module } = state, { blocks } = data, { view } = module.arrays;
  const body = byId("actuators");
  if (!blocks.largest) return;
  const count = data.actuators.length, speeds = blocks.speeds[1] > 0;
  data.actuators.forEach((/** @type {any} */ each, /** @type {number} */ k) => {
    /** @type {string[]} */
    const cells = [each.name];
    data.loads.forEach((/** @type {string} */ _, /** @type {number} */ load) => {
      const [high, low] = ["largest", "smallest"].map((name) => view[blocks[name][0] + load * count + k]);
      cells.push(digits(Math.abs(high) >= Math.abs(low) ? high : low, 5));
    });
    if (speeds) cells.push(digits(view[blocks.speeds[0] + k] * each.factor, 5));
    const row = body.children[k] ?? body.appendChild(make("tr", {}, ...cells.map((_, i) => make(i ? "td" : "th", {}))));
    cells.forEach((text, i) => say(row.children[i], text));
  });
};
