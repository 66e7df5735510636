// Map of a value over two sliders about the present point, with the borders of the limits; a click moves the robot there.
import { digits, measured } from "./numbers.js";
import { byId, make } from "./panel.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./state.js").Slider} Slider
 * @typedef {{ count: number, values: Float64Array, violated: Uint8Array, low: number, high: number }} Sampled
 */

/** Time for a map, and the most and fewest points on a side. */
const MILLISECONDS = 140, MOST = 61, FEWEST = 13;
/** Stops of the colours, from the smallest to the largest value. */
const SHADES = [[33, 47, 94], [43, 98, 140], [60, 147, 148], [140, 190, 120], [250, 226, 110]];

/** Colour of a part between 0 and 1. @param {number} part */
const shade = (part) => {
  const at = Math.max(0, Math.min(1, part)) * 4, low = Math.min(3, Math.floor(at)), share = at - low;
  return SHADES[low].map((each, k) => Math.round(each + share * (SHADES[low + 1][k] - each)));
};

/**
 * Values on a grid over two sliders; the state is as before afterwards.
 * @param {State} state
 * @param {Slider} first
 * @param {Slider} second
 * @param {"F" | "singular"} what
 * @param {number} [points] number of points on a side; without it, as many as the time allows
 * @returns {Sampled}
 */
export const sampled = (state, first, second, what, points) => {
  const { arrays } = state.module, kept = { x: arrays.x.slice(), p: arrays.p.slice(), kind: state.kind, status: state.status, fault: state.fault };
  const at = (/** @type {Slider} */ slider, /** @type {number} */ part) => {
    const [low, high] = state.ends(slider);
    arrays[slider.vector][slider.index] = state.inside(slider, low + part * (high - low));
  };
  const read = (/** @type {number} */ across, /** @type {number} */ up) => {
    arrays.x.set(kept.x);
    arrays.p.set(kept.p);
    at(first, across);
    at(second, up);
    state.close(null);
    state.fault = state.module.evaluate(state.pose, false).fault;
    if (state.kind === "none" || state.fault & 3) return { value: NaN, isViolated: true };
    const value = what === "F" ? arrays.F[0] : arrays.singular_values[5];
    return { value, isViolated: state.limitStates().some((each) => each.isViolated) };
  };
  let count = points ?? FEWEST;
  if (points === undefined) {
    // The engine compiles during the first evaluations, so only the later ones say how long a point takes.
    for (let k = 0; k < 40; k += 1) read(k / 39, 1 - k / 39);
    const begin = performance.now();
    for (let k = 0; k < 40; k += 1) read(k / 39, k / 39);
    const each = Math.max(1e-3, (performance.now() - begin) / 40);
    count = Math.max(FEWEST, Math.min(MOST, Math.floor(Math.sqrt(MILLISECONDS / each))));
  }
  const values = new Float64Array(count * count), violated = new Uint8Array(count * count);
  let low = Infinity, high = -Infinity;
  for (let row = 0; row < count; row += 1) {
    for (let column = 0; column < count; column += 1) {
      const { value, isViolated } = read(column / (count - 1), row / (count - 1)), k = row * count + column;
      values[k] = value;
      violated[k] = isViolated ? 1 : 0;
      if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  arrays.x.set(kept.x);
  arrays.p.set(kept.p);
  Object.assign(state, { kind: kept.kind, status: kept.status });
  state.look();
  return { count, values, violated, low, high };
};

/** Map below the picture. */
export class ValueMap {
  /** @param {State} state @param {(act: () => void, key?: any) => void} change */
  constructor(state, change) {
    this.state = state;
    this.group = /** @type {HTMLDetailsElement} */ (byId("map-group"));
    this.canvas = /** @type {HTMLCanvasElement} */ (byId("map"));
    const free = state.sliders.map((each, k) => ({ each, k })).sort((a, b) => Number(a.each.vector === "p") - Number(b.each.vector === "p"));
    this.choices = ["map-x", "map-y"].map((id, place) => {
      const choice = /** @type {HTMLSelectElement} */ (byId(id));
      choice.append(...state.sliders.map((slider, k) => make("option", { value: String(k) }, slider.name)));
      choice.value = String(free[Math.min(place, free.length - 1)]?.k ?? 0);
      choice.addEventListener("change", () => this.draw());
      return choice;
    });
    byId("map-what").addEventListener("change", () => this.draw());
    this.group.hidden = state.sliders.length < 2;
    this.group.addEventListener("toggle", () => this.draw());
    this.canvas.addEventListener("click", (event) => {
      const box = this.canvas.getBoundingClientRect(), parts = [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height];
      change(() => this.sliders().forEach((slider, k) => {
        const [low, high] = state.ends(slider);
        state.move(slider, low + parts[k] * (high - low));
      }));
    });
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.waiting = undefined;
  }

  sliders() {
    return this.choices.map((choice) => this.state.sliders[Number(choice.value)]);
  }

  /** Draws the map when nothing has moved for a moment. */
  refresh() {
    clearTimeout(this.waiting);
    if (this.group.open) this.waiting = setTimeout(() => this.draw(), 120);
  }

  draw() {
    if (!this.group.open) return;
    const { state, canvas } = this, [first, second] = this.sliders();
    const begin = performance.now(), what = /** @type {"F" | "singular"} */ (/** @type {HTMLSelectElement} */ (byId("map-what")).value);
    let found = sampled(state, first, second, what);
    const took = performance.now() - begin, finer = Math.min(MOST, Math.floor(found.count * Math.sqrt(MILLISECONDS / took)));
    if (took < MILLISECONDS / 3 && finer > found.count) found = sampled(state, first, second, what, finer);
    const { count, values, violated, low, high } = found;
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const side = Math.max(8, Math.round(560 / count));
    canvas.width = count * side;
    canvas.height = count * side;
    const at = (/** @type {number} */ row, /** @type {number} */ column) => violated[row * count + column];
    for (let row = 0; row < count; row += 1) {
      for (let column = 0; column < count; column += 1) {
        const value = values[row * count + column], x = column * side, y = (count - 1 - row) * side;
        const colour = Number.isFinite(value) ? shade((value - low) / (high - low || 1)) : [128, 128, 128];
        context.fillStyle = `rgb(${colour.join(",")})`;
        context.fillRect(x, y, side, side);
        if (at(row, column)) {
          context.fillStyle = "rgba(255,255,255,0.45)";
          for (let k = 0; k < side; k += 4) context.fillRect(x + k, y + k, 2, 2);
        }
        context.fillStyle = "#ffffff";
        if (column && at(row, column) !== at(row, column - 1)) context.fillRect(x - 1, y, 2, side);
        if (row && at(row, column) !== at(row - 1, column)) context.fillRect(x, y + side - 1, side, 2);
      }
    }
    const place = [first, second].map((slider) => {
      const [from, to] = state.ends(slider);
      return (state.read(slider) - from) / (to - from);
    });
    const x = side / 2 + place[0] * (count - 1) * side, y = canvas.height - side / 2 - place[1] * (count - 1) * side;
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.lineWidth = 3;
    context.strokeStyle = "#ffffff";
    context.stroke();
    context.lineWidth = 1.5;
    context.strokeStyle = "#000000";
    context.stroke();
    const ends = (/** @type {Slider} */ slider) => state.ends(slider).map((each) => digits(each, 4)).join(" to ");
    const unit = what === "F" ? state.data.F_unit : "";
    byId("map-words").textContent =
      `${first.name} ${ends(first)} across, ${second.name} ${ends(second)} upwards; dark ${measured(low, unit, 5)}, light ${measured(high, unit, 5)}; ` +
      `dotted: a limit is violated; grey: no robot. ${count} by ${count} points in ${Math.round(performance.now() - begin)} ms, other values as they are.`;
  }
}
