// Controls and values beside the picture: sliders, headline and values of the point.
import { digits, measured, parsed, settled } from "./numbers.js";
import { turnWords } from "./names.js";
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
export const say = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};

/** Name that may break after an underscore. @param {string} name @returns {(Node | string)[]} */
const breakable = (name) => name.split(/(?<=_)/).flatMap((part, k) => (k ? [document.createElement("wbr"), part] : [part]));

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
      const value = parsed(entry.value);
      const isIn = Number.isFinite(value) && (isFixed || (value >= low - 1e-12 * Math.abs(low) && value <= high + 1e-12 * Math.abs(high)));
      entry.setAttribute("aria-invalid", String(!isIn));
      entry.title = isIn ? "" : `a number from ${digits(low)} to ${digits(high)}`;
      if (isIn) change(() => state.move(slider, isFixed ? value : Math.max(low, Math.min(high, value))));
    });
    lock.addEventListener("click", () => change(() => state.hold(slider, !state.isHeld(slider))));
    const label = make("label", { for: id }, ...breakable(slider.name)), unit = make("span", { class: "unit" }, slider.unit);
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

/** F of each of several tasks as a part of its separate optimum, in the words of `page.py`. @param {State} state */
const showTasks = (state) => {
  const list = byId("task-values"), values = state.taskValues();
  list.hidden = !values.length;
  values.forEach(({ F, best }, k) => {
    const { name, sense, F_unit } = state.data.tasks[k], row = list.children[k] ?? list.appendChild(make("li", {}));
    const part = best ? `${digits((100 * F) / best, 4)}\u00a0% of ` : "";
    say(row, `${name}: F = ${measured(F, F_unit)}${best === null ? "" : `, ${part}the separate ${sense}imum ${digits(best)}`}`);
  });
};

/**
 * Headline, and the values of the point.
 * @param {State} state
 * @param {import("./limits.js").LimitState[]} limits
 * @param {import("./schedule.js").Headline | null} own headline of a schedule; null for that of the state
 */
export const showValues = (state, limits, own) => {
  const { data, module } = state, { singular_values } = module.arrays;
  const { word, words, isFault } = own ?? state.headline();
  const violated = limits.filter((each) => each.isViolated).length;
  const value = state.shownF();
  const extreme = state.kind === "program" && data.tasks.length === 1 ? (data.sense === "max" ? "largest " : "smallest ") : "";
  say(byId("F"), own?.value ?? `${extreme}${data.F_name} = ${measured(value, data.F_unit)}`);
  say(byId("word"), word);
  say(byId("words"), words + (violated ? `; ${violated} limit${violated > 1 ? "s" : ""} violated` : ""));
  showTasks(state);
  byId("answer").classList.toggle("none", isFault || violated > 0);
  byId("answer").classList.toggle("proved", own ? own.isProgram : state.kind === "program");
  byId("stated-task").hidden = !own && state.hasOtherTask();
  const rank = module.rank();
  say(byId("rank"), `${rank}${rank < 6 ? " (singular)" : ""}`);
  say(byId("singular"), digits(settled(singular_values[5], singular_values[0]), 5));
  const turns = rotationsOf(state).map((/** @type {any} */ each) => turnWords(each, data.units.angle));
  say(byId("turn"), turns.join("; "));
  byId("turn-row").hidden = !turns.length;
  say(byId("time"), `${(1000 * state.seconds).toFixed(1)} ms`);
  byId("time-row").hidden = !state.seconds;
  byId("to-answer").hidden = !data.answer;
};
