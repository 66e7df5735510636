// Map of a value over two sliders about the present point, with the borders of the limits and of the workspace. It begins
// coarse, and becomes finer while nothing else happens. A click, or the cursor and Enter, moves the robot there.
import { digits, measured, settled } from "./numbers.js";
import { byId, make } from "./panel.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./state.js").Slider} Slider
 * @typedef {{ name: string, unit: string, factor: number, read: (state: State) => number }} Quantity
 */

/** Points on a side from the first map to the finest; each has all points of the one before. */
const COUNTS = [13, 25, 49, 97];
/** Most milliseconds of the first map, and of one part of the next ones. */
const FIRST = 120, PART = 12;
/** Violation of a limit, relative to it, that counts as rounding. */
const VIOLATED = -1e-6;
/** Steps of the cursor across the map: by an arrow key, and with Shift. */
const STEP = 1 / 24, SMALL_STEP = 1 / 96;
/** Side of the picture, pixels. */
const SIDE = 582;
/** Stops of the colours, from the smallest to the largest value. */
const SHADES = [[33, 47, 94], [43, 98, 140], [60, 147, 148], [140, 190, 120], [250, 226, 110]];

/** Colour of a part between 0 and 1. @param {number} part */
export const shade = (part) => {
  const at = Math.max(0, Math.min(1, part)) * 4, low = Math.min(3, Math.floor(at)), share = at - low;
  return SHADES[low].map((each, k) => Math.round(each + share * (SHADES[low + 1][k] - each)));
};

/** Largest magnitude in a part of the values of a view. @param {State} state @param {string[]} names @param {number} first @param {number} count */
const largest = (state, names, first, count) => {
  const { view } = state.module.arrays;
  let found = 0;
  for (const name of names) {
    const at = state.data.blocks[name][0] + first;
    for (let k = at; k < at + count; k += 1) found = Math.max(found, Math.abs(view[k]));
  }
  return found;
};

/** Values that a map can show. @param {State} state @returns {Quantity[]} */
const quantitiesOf = (state) => {
  const { data } = state, { blocks } = data, count = data.actuators.length;
  /** @type {Quantity[]} */
  const found = [
    { name: "F", unit: data.F_unit, factor: 1, read: () => state.shownF() },
    { name: "smallest singular value", unit: "", factor: 1, read: () => state.module.arrays.singular_values[5] },
  ];
  if (state.sides.length) found.push({ name: "nearest limit: relative margin", unit: "", factor: 1, read: () => state.leastMargin() });
  if (blocks.largest) data.loads.forEach((/** @type {string} */ name, /** @type {number} */ load) =>
    found.push({ name: `largest actuator force, ${name}`, unit: data.actuators[0].force, factor: 1, read: () => largest(state, ["largest", "smallest"], load * count, count) }));
  if (blocks.largest && blocks.speeds[1]) found.push({ name: "largest actuator speed", unit: data.actuators[0].speed, factor: data.actuators[0].factor, read: () => largest(state, ["speeds"], 0, count) });
  return found;
};

/** Map below the picture. */
export class ValueMap {
  /** @param {State} state @param {(act: () => void, key?: any) => void} change */
  constructor(state, change) {
    this.state = state;
    this.change = change;
    this.group = /** @type {HTMLDetailsElement} */ (byId("map-group"));
    this.canvas = /** @type {HTMLCanvasElement} */ (byId("map"));
    this.quantities = quantitiesOf(state);
    this.what = /** @type {HTMLSelectElement} */ (byId("map-what"));
    this.what.replaceChildren(...this.quantities.map(({ name }, k) => make("option", { value: String(k) }, name)));
    const travels = (state.data.travel?.coordinates ?? []).map((/** @type {number[]} */ each) => each[0]);
    const free = state.sliders.map((slider, k) => (slider.vector === "x" ? k : -1)).filter((k) => k >= 0);
    const first = [...travels, ...free, 0, 1].filter((each, k, all) => all.indexOf(each) === k);
    this.choices = ["map-x", "map-y"].map((id, k) => {
      const choice = /** @type {HTMLSelectElement} */ (byId(id));
      choice.append(...state.sliders.map((slider, i) => make("option", { value: String(i) }, slider.name)));
      choice.value = String(first[k] ?? k);
      choice.addEventListener("change", () => this.begin());
      return choice;
    });
    this.what.addEventListener("change", () => this.begin());
    this.group.hidden = state.sliders.length < 2;
    this.group.addEventListener("toggle", () => this.begin());
    /** Cursor as parts of both sides; null before a key moves it. @type {number[] | null} */
    this.cursor = null;
    this.said = make("p", { class: "note", id: "map-cursor", role: "status", "aria-live": "polite" });
    byId("map-words").after(this.said);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", "Map of a value over two sliders. Arrow keys move a cursor, with Shift by small steps; Enter moves the robot there.");
    this.canvas.addEventListener("click", (event) => {
      const box = this.canvas.getBoundingClientRect();
      this.go([(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height]);
    });
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.canvas.addEventListener("blur", () => {
      this.cursor = null;
      this.paint();
    });
    this.count = 0;
    this.run = 0;
    /** @type {Float64Array} */
    this.values = new Float64Array();
    this.violated = new Uint8Array();
    this.began = 0;
    this.took = 0;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.waiting = undefined;
  }

  sliders() {
    return this.choices.map((choice) => this.state.sliders[Number(choice.value)]);
  }

  /** Ends of a side, in the case's unit: those of the slider, and of the workspace. @param {Slider} slider */
  ends(slider) {
    const [low, high] = this.state.ends(slider), range = this.range(slider);
    return range ? [Math.min(low, range[0]), Math.max(high, range[1])] : [low, high];
  }

  /** Range of a coordinate in the workspace, in the case's unit; null without one. @param {Slider} slider */
  range(slider) {
    const own = (this.state.data.travel?.coordinates ?? []).find((/** @type {number[]} */ each) => this.state.sliders[each[0]] === slider);
    return own ? [own[1] * slider.factor, own[2] * slider.factor] : null;
  }

  /** Part of a side at the present value. @param {Slider} slider */
  part(slider) {
    const [low, high] = this.ends(slider);
    return (this.state.read(slider) - low) / (high - low);
  }

  /** Moves the robot to a place. @param {number[]} parts */
  go(parts) {
    this.change(() => this.sliders().forEach((slider, k) => {
      const [low, high] = this.ends(slider);
      this.state.move(slider, low + parts[k] * (high - low));
    }));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const step = event.shiftKey ? SMALL_STEP : STEP;
    const moves = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] });
    const at = this.cursor ?? this.sliders().map((slider) => Math.max(0, Math.min(1, this.part(slider))));
    if (event.key in moves) this.cursor = at.map((each, k) => Math.max(0, Math.min(1, each + moves[event.key][k])));
    else if ((event.key === "Enter" || event.key === " ") && this.cursor) this.go(this.cursor);
    else if (event.key === "Escape") this.cursor = null;
    else return;
    event.preventDefault();
    this.tell();
    this.paint();
  }

  /** Says what is at the cursor. */
  tell() {
    if (!this.cursor) {
      this.said.textContent = "";
      return;
    }
    const own = this.cursor, quantity = this.quantities[Number(this.what.value)];
    const [column, row] = own.map((each) => Math.round(each * (this.count - 1))), k = row * this.count + column;
    const place = this.sliders().map((slider, i) => {
      const [low, high] = this.ends(slider);
      return `${slider.name} ${measured(settled(low + own[i] * (high - low), high - low), slider.unit, 4)}`;
    });
    const value = Number.isFinite(this.values[k]) ? `${quantity.name} ${measured(this.values[k], quantity.unit, 5)}${this.violated[k] ? ", a limit is violated" : ""}` : "no robot";
    this.said.textContent = `Cursor at ${place.join(", ")}: ${value}. Enter moves the robot there.`;
  }

  /** Begins a map anew when nothing has moved for a moment. */
  refresh() {
    clearTimeout(this.waiting);
    this.run += 1;
    if (this.group.open) this.waiting = setTimeout(() => this.begin(), 120);
  }

  /** Begins a map: a coarse one at once, finer ones while nothing else happens. */
  begin() {
    clearTimeout(this.waiting);
    this.run += 1;
    if (!this.group.open) return;
    this.began = performance.now();
    this.count = 0;
    this.refine(0, this.run, FIRST);
  }

  /** Computes the points of a finer map, in parts. @param {number} level @param {number} run @param {number} time */
  refine(level, run, time) {
    const count = COUNTS[level], before = { count: this.count, values: this.values, violated: this.violated };
    const values = new Float64Array(count * count).fill(NaN), violated = new Uint8Array(count * count);
    /** @type {number[]} */
    const missing = [];
    for (let k = 0; k < count * count; k += 1) {
      const row = Math.floor(k / count), column = k % count;
      if (before.count && row % 2 === 0 && column % 2 === 0) {
        const old = (row / 2) * before.count + column / 2;
        values[k] = before.values[old];
        violated[k] = before.violated[old];
      } else {
        missing.push(k);
      }
    }
    let next = 0;
    const work = () => {
      if (run !== this.run) return;
      next = this.sample(missing, next, count, values, violated, level ? PART : time);
      if (next < missing.length) {
        this.waiting = setTimeout(work, level ? 15 : 0);
        return;
      }
      Object.assign(this, { count, values, violated });
      if (!level) this.took = performance.now() - this.began;
      this.paint();
      this.tell();
      if (level + 1 < COUNTS.length) this.waiting = setTimeout(() => this.refine(level + 1, run, PART), 30);
    };
    work();
  }

  /**
   * Values at points of a grid for some milliseconds; the state is as before afterwards. Returns the next point.
   * @param {number[]} points @param {number} from @param {number} count
   * @param {Float64Array} values @param {Uint8Array} violated @param {number} time
   */
  sample(points, from, count, values, violated, time) {
    const { state } = this, { arrays } = state.module, [first, second] = this.sliders(), quantity = this.quantities[Number(this.what.value)];
    const kept = { x: arrays.x.slice(), p: arrays.p.slice() }, { kind, status } = state, ends = [first, second].map((each) => this.ends(each));
    const begin = performance.now();
    let at = from;
    for (; at < points.length && performance.now() - begin < time; at += 1) {
      const k = points[at], parts = [(k % count) / (count - 1), Math.floor(k / count) / (count - 1)];
      arrays.x.set(kept.x);
      arrays.p.set(kept.p);
      [first, second].forEach((slider, i) => (arrays[slider.vector][slider.index] = state.inside(slider, ends[i][0] + parts[i] * (ends[i][1] - ends[i][0]))));
      state.close(null);
      state.fault = state.module.evaluate(state.pose, false).fault;
      const isThere = state.kind !== "none" && !(state.fault & 3);
      values[k] = isThere ? quantity.read(state) * quantity.factor : NaN;
      violated[k] = isThere && state.leastMargin() >= VIOLATED ? 0 : 1;
    }
    arrays.x.set(kept.x);
    arrays.p.set(kept.p);
    Object.assign(state, { kind, status });
    state.look();
    return at;
  }

  paint() {
    const { count, values, violated, canvas } = this;
    if (!count) return;
    const [first, second] = this.sliders(), quantity = this.quantities[Number(this.what.value)];
    let low = Infinity, high = -Infinity;
    for (const value of values) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")), side = SIDE / count;
    canvas.width = SIDE;
    canvas.height = SIDE;
    const at = (/** @type {number} */ row, /** @type {number} */ column) => violated[row * count + column];
    const every = Math.max(1, Math.round(count / 49));
    for (let row = 0; row < count; row += 1) {
      for (let column = 0; column < count; column += 1) {
        const value = values[row * count + column], x = column * side, y = (count - 1 - row) * side;
        const colour = Number.isFinite(value) ? shade((value - low) / (high - low || 1)) : [128, 128, 128];
        context.fillStyle = `rgb(${colour.join(",")})`;
        context.fillRect(x, y, side + 0.5, side + 0.5);
      }
    }
    for (let row = 0; row < count; row += 1) {
      for (let column = 0; column < count; column += 1) {
        const x = column * side, y = (count - 1 - row) * side;
        if (at(row, column) && row % every === 0 && column % every === 0) {
          context.fillStyle = "rgba(255,255,255,0.6)";
          for (let k = 2; k < side * every; k += 10) context.fillRect(x + k, y + k, 2, 2);
        }
        context.fillStyle = "#ffffff";
        if (column && at(row, column) !== at(row, column - 1)) context.fillRect(x - 1, y, 2.5, side);
        if (row && at(row, column) !== at(row - 1, column)) context.fillRect(x, y + side - 1, side, 2.5);
      }
    }
    // The centre of a point's square is its value.
    const across = (/** @type {number} */ part) => side / 2 + part * (SIDE - side), upwards = (/** @type {number} */ part) => SIDE - side / 2 - part * (SIDE - side);
    const stroke = (/** @type {() => void} */ draw) => [["#000000", 3.5], ["#ffffff", 1.5]].forEach(([colour, width]) => {
      context.strokeStyle = String(colour);
      context.lineWidth = Number(width);
      context.beginPath();
      draw();
      context.stroke();
    });
    const ranges = [first, second].map((slider) => this.range(slider));
    if (ranges[0] && ranges[1]) {
      const [x, y] = [first, second].map((slider, k) => {
        const [from, to] = this.ends(slider);
        return /** @type {number[]} */ (ranges[k]).map((each) => (each - from) / (to - from));
      });
      context.setLineDash([8, 5]);
      stroke(() => context.rect(across(x[0]), upwards(y[1]), across(x[1]) - across(x[0]), upwards(y[0]) - upwards(y[1])));
      context.setLineDash([]);
    }
    stroke(() => context.arc(across(this.part(first)), upwards(this.part(second)), 7, 0, 2 * Math.PI));
    if (this.cursor) {
      const [x, y] = [across(this.cursor[0]), upwards(this.cursor[1])];
      stroke(() => [[-14, 0], [14, 0], [0, -14], [0, 14]].forEach(([dx, dy]) => {
        context.moveTo(x + dx / 3, y + dy / 3);
        context.lineTo(x + dx, y + dy);
      }));
    }
    const ends = (/** @type {Slider} */ slider) => this.ends(slider).map((each) => digits(each, 4)).join(" to ");
    const box = ranges[0] && ranges[1] ? "; dashed: the workspace" : "";
    const shades = low <= high ? `dark ${measured(low, quantity.unit, 5)}, light ${measured(high, quantity.unit, 5)}` : "no point has a robot";
    byId("map-words").textContent =
      `${first.name} ${ends(first)} across, ${second.name} ${ends(second)} upwards; ${shades}; ` +
      `white lines: borders of limits; dotted: a limit is violated; grey: no robot${box}. First map in ${Math.round(this.took)} ms, now ${count} by ${count} points, other values as they are.`;
  }
}
