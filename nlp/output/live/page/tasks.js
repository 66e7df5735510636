// Sliders and fields for axis, point, pitch and weight of each task.
import { digits, measured, parsed } from "./numbers.js";
import { byId, make } from "./panel.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {{ name: string, unit: string, low: number, high: number, read: () => number, write: (value: number) => boolean }} TaskValue
 */

/** Azimuth and elevation of an axis, degrees. @param {number[]} axis */
const anglesOf = ([x, y, z]) => [(Math.atan2(y, x) * 180) / Math.PI, (Math.atan2(z, Math.hypot(x, y)) * 180) / Math.PI];

/** Unit axis from azimuth and elevation, degrees. @param {number} azimuth @param {number} elevation */
const axisOf = (azimuth, elevation) => {
  const [a, e] = [azimuth, elevation].map((each) => (each * Math.PI) / 180);
  return [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
};

/** Sliders of the tasks. */
export class TaskSliders {
  /** @param {State} state @param {(act: () => void, key?: any) => void} change */
  constructor(state, change) {
    this.state = state;
    this.change = change;
    /** @type {{ value: TaskValue, range: any, entry: any }[]} */
    this.rows = [];
    state.data.stated_tasks.forEach((/** @type {any} */ stated, /** @type {number} */ task) => {
      const values = this.values(task, stated);
      if (values.length && state.tasks.length > 1) byId("tasks").append(make("p", { class: "task-name" }, state.data.tasks[task].name));
      for (const each of values) this.add(each, state.tasks.length > 1 ? `${state.data.tasks[task].name}: ` : "");
    });
    byId("tasks-group").hidden = !this.rows.length;
  }

  /** Values of a task with a slider. @param {number} task @param {any} stated @returns {TaskValue[]} */
  values(task, stated) {
    const { state } = this, length = state.data.units.length, { size } = state.data.scene, own = () => state.tasks[task];
    /** @type {TaskValue[]} */
    const found = [];
    if (stated.axis !== undefined) {
      ["azimuth", "elevation"].forEach((word, place) => found.push({
        name: `axis, ${word}`, unit: "deg", low: place ? -90 : -180, high: place ? 90 : 180,
        read: () => anglesOf(own().axis)[place],
        write: (value) => {
          const angles = anglesOf(own().axis);
          angles[place] = value;
          return state.setTask(task, "axis", -1, axisOf(angles[0], angles[1]));
        },
      }));
      "xyz".split("").forEach((letter, place) => found.push({
        name: `axis ${letter}`, unit: "", low: -1, high: 1,
        read: () => own().axis[place] / (Math.hypot(...own().axis) || 1),
        write: (value) => {
          const long = Math.hypot(...own().axis) || 1;
          return state.setTask(task, "axis", -1, own().axis.map((each, k) => (k === place ? value : each / long)));
        },
      }));
    }
    if (stated.point !== undefined) "xyz".split("").forEach((letter, place) => {
      const middle = own().point[place];
      found.push({ name: `point ${letter}`, unit: length, low: middle - size, high: middle + size, read: () => own().point[place], write: (value) => state.setTask(task, "point", place, value) });
    });
    if (stated.pitch !== undefined) {
      const most = Math.max(0.25 * size, Number.isFinite(own().pitch) ? 2 * Math.abs(own().pitch) : 0);
      found.push({ name: "pitch", unit: `${length}/rad`, low: -most, high: most, read: () => own().pitch, write: (value) => state.setTask(task, "pitch", 0, value) });
    }
    if (state.weights.length) {
      const high = Math.max(2, 2 * state.weights[task]);
      found.push({ name: "weight", unit: "", low: 0.01 * high, high, read: () => state.weights[task], write: (value) => state.setWeight(task, value) });
    }
    return found;
  }

  /** @param {TaskValue} value @param {string} prefix name of the task, with a colon */
  add(value, prefix) {
    const id = `task-${this.rows.length}`, name = `${prefix}${value.name}`;
    const range = make("input", { type: "range", id, min: String(value.low), max: String(value.high), step: "any", "aria-label": name });
    const entry = make("input", { type: "text", inputmode: "text", class: "entry", "aria-label": `${name}, exact value`, autocomplete: "off" });
    range.addEventListener("input", () => this.change(() => value.write(Number(range.value)), value));
    entry.addEventListener("change", () => this.change(() => entry.setAttribute("aria-invalid", String(!value.write(parsed(entry.value))))));
    byId("tasks").append(make("div", { class: "slider" }, make("label", { for: id }, value.name), range, entry, make("span", { class: "unit" }, value.unit)));
    this.rows.push({ value, range, entry });
  }

  refresh() {
    for (const { value, range, entry } of this.rows) {
      const now = value.read(), text = digits(now);
      if (document.activeElement !== entry && entry.value !== text) entry.value = text;
      // A translation has no finite pitch, so its slider begins in the middle.
      range.value = String(Number.isFinite(now) ? now : 0);
      range.setAttribute("aria-valuetext", measured(now, value.unit));
    }
  }
}
