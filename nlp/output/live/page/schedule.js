// Schedule along a path: settings at the shown point, the best constant settings beside them, and maps of the objective.
import { cross, digits, dot, measured, parsed, plus, settled } from "./numbers.js";
import { shade } from "./map.js";
import { byId, make, say } from "./panel.js";
import { unpack } from "./text.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./numbers.js").Vector} Vector
 * @typedef {{ name: string, unit: string, factor: number, low: number, high: number, rate: number | null, place: number }} Setting
 *   ends in units of computations, rate in the case's unit; `place` is the index in x, -1 for the turn about the tool
 * @typedef {{ at: number[], rows: number, low: number, high: number, shades: string }} MapData
 * @typedef {{ value: string, word: string, words: string }} Told
 * @typedef {Told & { isFault: boolean, isProgram: boolean }} Headline
 * @typedef {{ settings: Setting[], rows: number[][], reach: [number, number][][], step: (number | null)[][], rates: (number | null)[][],
 *   F: number[], value: number, constant: { row: number[], design: number[], F: number[], value: number } | null, design: { places: number[], values: number[] },
 *   feeds: Vector[], axis: Vector | null, turn: number, follows: string[], weights: number[], measure: string, length: number, hasSlopes: boolean, isWorst: boolean, sign: number,
 *   unit: string, isTimed: boolean, isAnswer: boolean, name: string, schedule: Told, held: Told | null, maps: MapData[],
 *   table: string | null }} ScheduleData rows, reach and step in units of computations; turn is that of a tool without a setting
 */

/** Width and height of a map, pixels, and part of a range that counts as rounding. */
const WIDTH = 900, HEIGHT = 300, SAME = 1e-9;
/** Rates below this part of the largest one are rounding of the search. */
const ROUNDED = 1e-6;
/** Steps by which closed loops follow a change of the pose. */
const FOLLOWED = 12;
/** Forbidden parts of a map. */
const FORBIDDEN = "#9aa0a5";

/** Unit quaternion, real part first, from its vector part. @param {ArrayLike<number>} v */
const wholeOf = (v) => [Math.sqrt(Math.max(0, 1 - v[0] ** 2 - v[1] ** 2 - v[2] ** 2)), v[0], v[1], v[2]];

/** Vector part of a quaternion times a turn about an axis in the turned frame. @param {number[]} q @param {Vector} axis @param {number} angle */
export const turnedAbout = ([w, ...rest], axis, angle) => {
  const v = /** @type {Vector} */ (rest), c = Math.cos(angle / 2), s = Math.sin(angle / 2);
  const real = w * c - s * dot(v, axis), made = plus(plus(/** @type {Vector} */ (v.map((each) => c * each)), axis, w * s), cross(v, axis), s);
  // Rounding must not make the vector longer than 1.
  const size = Math.max(1, Math.hypot(...made)), sign = real < 0 ? -1 : 1;
  return /** @type {Vector} */ (made.map((each) => (sign * each) / size));
};

/** A vector of the turned frame in the world frame. @param {number[]} q @param {Vector} a @returns {Vector} */
const rotated = ([w, ...rest], a) => {
  const v = /** @type {Vector} */ (rest), side = cross(v, a);
  return plus(plus(a, side, 2 * w), cross(v, side), 2);
};

/** Settings along a path, and the controls for them. */
export class Schedule {
  /**
   * @param {State} state
   * @param {import("./track.js").TrackData} track
   * @param {ScheduleData} data
   * @param {() => void} show places the robot again, and shows it
   * @param {(text: string, words: string) => void} copy
   */
  constructor(state, track, data, show, copy) {
    this.state = state;
    this.track = track;
    this.data = data;
    this.show = show;
    this.index = track.first;
    /** Whether the best constant settings are shown. */
    this.isConstant = false;
    /** @type {number[] | null} settings that were moved away at the shown point */
    this.moved = null;
    this.isCase = true;
    document.documentElement.classList.add("on-schedule");
    // Slopes of the module are those of one task without its weight.
    if (!data.hasSlopes) state.data.has_slopes = false;
    this.addTravel();
    this.addControls(copy);
    this.addMaps();
  }

  /** Slider over the path below the picture. */
  addTravel() {
    const { frames, first } = this.track, last = frames.length - 1;
    const pace = make("select", { id: "pace" }, make("option", { value: "real" }, "real time"), make("option", { value: "lap" }, "whole path in 15 s"));
    const controls = make("p", { class: "controls travel" },
      make("button", { type: "button", id: "play" }, "Play"),
      make("label", { for: "travel" }, "Position along the path"),
      make("input", { type: "range", id: "travel", min: "0", max: String(last), step: "1", value: String(first) }),
      make("output", { id: "travelled", for: "travel" }),
      ...(this.data.isTimed ? [make("label", {}, "Speed: ", pace)] : []));
    byId("robot").after(controls);
  }

  /** Choice of the schedule or the best constant, a slider for each setting, and the values at the point. @param {(text: string, words: string) => void} copy */
  addControls(copy) {
    const { data } = this;
    this.choices = [["show-schedule", "Schedule"], ["show-constant", "Best constant"]].map(([id, words]) => make("button", { type: "button", id }, words));
    this.choices.forEach((button, k) => {
      button.hidden = !data.constant;
      button.addEventListener("click", () => this.choose(k === 1));
    });
    this.rows = data.settings.map((setting, k) => this.row(setting, k));
    const withUnit = (/** @type {string} */ name, /** @type {string} */ unit) => (unit ? `${name}, ${unit}` : name);
    const heads = [...data.settings.map((each) => withUnit(each.name, each.unit)), `${withUnit(this.pointName(), data.unit)}, here`, withUnit(data.name, data.unit)];
    this.lines = ["schedule", "best constant", "shown, computed here"].map((words) => {
      const cells = heads.map(() => make("td", {}));
      return { cells, element: make("tr", {}, make("th", { scope: "row" }, words), ...cells) };
    });
    this.lines[1].element.hidden = !data.constant;
    const head = make("thead", {}, make("tr", {}, make("th", {}), ...heads.map((each) => make("th", { scope: "col" }, each))));
    const table = make("table", { id: "at-point" }, make("caption", {}, "This point, and the whole path"), head, make("tbody", {}, ...this.lines.map((each) => each.element)));
    const button = make("button", { type: "button", id: "copy-schedule" }, "Copy schedule");
    button.hidden = !data.table;
    button.addEventListener("click", async () => copy(new TextDecoder().decode(await unpack(data.table ?? "")), "Schedule, as --schedule writes it"));
    const words = `The program computed the first ${data.constant ? "two rows" : "row"}. ${data.table ? "Copy schedule has the columns of --schedule" : "The schedule is too large for a copy: solve --schedule FILE writes it"}. No --set option states a point of the path${this.state.data.case_parts.length ? "; Copy case file has the robot at this point, for evaluate" : ""}.`;
    const section = make("section", { id: "schedule" }, make("h2", {}, "Settings at this point"), make("div", { class: "controls" }, ...this.choices, button),
      ...this.rows.flatMap((each) => [each.element, each.note]), make("div", { class: "scroll" }, table), make("p", { class: "note" }, words));
    byId("mode-solve").parentElement?.before(section);
  }

  /** @param {Setting} setting @param {number} k */
  row(setting, k) {
    const { factor } = setting, low = setting.low * factor, high = setting.high * factor, id = `setting-${k}`;
    const range = make("input", { type: "range", id, min: String(low), max: String(high), step: "any", "aria-label": setting.name });
    const entry = make("input", { type: "text", inputmode: "decimal", "aria-label": `${setting.name}, exact value`, class: "entry", autocomplete: "off" });
    const move = (/** @type {number} */ value) => {
      const row = [...this.values()];
      row[k] = value / factor;
      this.moved = row;
      this.show();
    };
    range.addEventListener("input", () => move(Number(range.value)));
    entry.addEventListener("change", () => {
      const value = parsed(entry.value), isIn = value >= low - SAME * Math.abs(low) && value <= high + SAME * Math.abs(high);
      entry.setAttribute("aria-invalid", String(!isIn));
      if (isIn) move(Math.max(low, Math.min(high, value)));
    });
    const element = make("div", { class: "slider" }, make("label", { for: id }, setting.name), range, entry, make("span", { class: "unit" }, setting.unit));
    return { element, range, entry, note: make("p", { class: "note reach" }) };
  }

  /** Name of the objective of one point. */
  pointName() {
    return this.data.measure ? this.data.name.replace(/^(mean|worst) /, "") : "F";
  }

  /** Shows the schedule, or the best constant with its design. @param {boolean} isConstant */
  choose(isConstant) {
    this.isConstant = isConstant;
    this.moved = null;
    const { design, constant } = this.data, { p } = this.state.module.arrays;
    design.places.forEach((place, k) => (p[place] = (isConstant && constant ? constant.design : design.values)[k]));
    this.show();
  }

  /** Fixed values of the case, with the design of the schedule or of the best constant. */
  stated() {
    const { design, constant } = this.data, found = [...this.state.data.p];
    design.places.forEach((place, k) => (found[place] = (this.isConstant && constant ? constant.design : design.values)[k]));
    return found;
  }

  /** Settings of the program at a point. @param {number} index */
  own(index) {
    return this.isConstant && this.data.constant ? this.data.constant.row : this.data.rows[index];
  }

  /** Settings that are shown. */
  values() {
    return this.moved ?? this.own(this.index);
  }

  /** Sets moved settings; null for those of the program. @param {number[] | null} row */
  set(row) {
    this.moved = row;
  }

  /** Places the robot at a point of the path, with its settings and the motions of the tasks. @param {number} index */
  place(index) {
    const { state, data, track } = this, { arrays } = state.module, row = (this.index = index, this.values());
    const { values } = track.frames[index], base = wholeOf(values.slice(3, 6)), turn = data.settings.findIndex((each) => each.place < 0);
    const q = data.axis ? turnedAbout(base, data.axis, turn < 0 ? data.turn : row[turn]) : /** @type {Vector} */ (base.slice(1));
    /** @type {[number, number][]} */
    const target = [...track.places.map((place, k) => /** @type {[number, number]} */ ([place, k < 3 ? values[k] : q[k - 3]])), ...data.settings.flatMap(({ place }, k) => (place < 0 ? [] : [/** @type {[number, number]} */ ([place, row[k]])]))];
    state.kind = "point";
    state.status = 0;
    if (state.inner.size) {
      // Loops follow in small steps, so that they stay in their assembly mode.
      const from = target.map(([place]) => arrays.x[place]);
      for (let step = 1; step <= FOLLOWED; step += 1) {
        target.forEach(([place, value], k) => (arrays.x[place] = from[k] + (step / FOLLOWED) * (value - from[k])));
        state.close(null);
      }
    }
    target.forEach(([place, value]) => (arrays.x[place] = value));
    if (state.inner.size) state.close(null);
    this.moveTasks(index, /** @type {Vector} */ (values.slice(0, 3)), wholeOf(q));
  }

  /** @param {number} index @param {Vector} position @param {number[]} q */
  moveTasks(index, position, q) {
    const { state, data } = this, axis = data.axis ? rotated(q, data.axis) : null;
    data.follows.forEach((follows, k) => {
      const along = follows === "feed" ? data.feeds[index] : axis;
      if (!follows || !along) return;
      const isTurn = follows === "tool", task = { axis: [...along], point: isTurn ? [...position] : [0, 0, 0], pitch: isTurn ? 0 : Infinity };
      const twist = state.module.twist(task.axis, task.point, task.pitch);
      if (!twist) return;
      state.tasks[k] = task;
      state.module.arrays.p.set(twist, state.data.tasks[k].twist);
    });
  }

  /** Objective at the shown point, computed by the module; NaN where it is not known. */
  value() {
    const { state, data } = this, { view } = state.module.arrays, { blocks } = state.data;
    if (state.fault & 3 || state.kind === "none") return NaN;
    const block = (/** @type {string} */ name) => (blocks[name] ? [...view.slice(blocks[name][0], blocks[name][0] + blocks[name][1])] : [NaN]);
    if (!data.measure) {
      const terms = block("F").map((each, k) => each * data.weights[k]);
      return data.isWorst ? (data.sign > 0 ? Math.min(...terms) : Math.max(...terms)) : terms.reduce((sum, each) => sum + each, 0);
    }
    if (data.measure === "smallest_singular_value") return state.module.smallestSingularValue(data.length);
    if (data.measure === "leg_length") {
      const at = state.data.quantities.findIndex((/** @type {any} */ each) => each.name === "leg_length");
      if (at < 0) return NaN;
      const first = state.data.quantities.slice(0, at).reduce((/** @type {number} */ sum, /** @type {any} */ each) => sum + each.owners.length, 0);
      return Math.max(...block("quantities").slice(first, first + state.data.quantities[at].owners.length));
    }
    const speeds = block("speeds"), count = state.data.actuators.length;
    if (data.measure === "actuator_speed") return Math.max(...speeds.map((each, k) => Math.abs(each) * state.data.actuators[k].factor));
    const [high, low] = [block("largest"), block("smallest")];
    return Math.max(...high.map((each, k) => (data.measure === "actuator_power" ? speeds[k % count] : 1) * Math.max(each, -low[k])));
  }

  /** Whether everything is as the program found it. */
  isProgram() {
    const { state } = this, { limits } = state.module.arrays;
    return !this.movedNames().length && this.isCase && state.limits.every((each, k) => limits[k] === each.value);
  }

  /** Names of the settings that were moved away from those of the program. */
  movedNames() {
    const own = this.own(this.index), { moved } = this;
    return this.data.settings.filter(({ low, high }, k) => moved && Math.abs(moved[k] - own[k]) > SAME * (high - low)).map((each) => each.name);
  }

  /** Range of a setting that its rate reaches from both neighbours, in units of computations; null without a rate. @param {number} k @returns {[number, number] | null} */
  reach(k) {
    const { data, index } = this, { low, high, rate } = data.settings[k];
    if (rate === null) return null;
    if (!this.isConstant || !data.constant) return data.reach[index][k];
    const own = data.constant.row[k], step = data.step[index][k] ?? Infinity;
    return [Math.max(low, own - step), Math.min(high, own + step)];
  }

  /** Words about the rate of a setting, and the range that it allows at this point. @param {number} k */
  rateWords(k) {
    const { data, index } = this, { name, unit, factor, low, high, rate } = data.settings[k], reach = this.reach(k);
    const per = unit ? `${unit}/s` : "1/s", own = this.isConstant ? 0 : data.rates[index][k], isLast = index === data.rows.length - 1;
    const now = own === null ? "" : `${isLast ? "rate to this point" : "rate to the next point"} ${measured(settled(own, rate ?? (high - low) * factor, ROUNDED), per, 5)}, `;
    const most = rate === null ? "no largest rate" : `at most ${measured(rate, per, 5)}`;
    if (!reach) return { words: `${now}${most}`, isOut: false };
    const value = this.values()[k], slack = SAME * (high - low), isOut = value < reach[0] - slack || value > reach[1] + slack;
    const range = `${digits(reach[0] * factor, 5)} to ${measured(reach[1] * factor, unit, 5)}`;
    if (!this.movedNames().includes(name)) return { words: `${now}${most}; reachable from the neighbouring points: ${range}`, isOut: false };
    return { words: `${name} is ${isOut ? "outside" : "within"} ${range}, the range that its rate reaches from the neighbouring points (${most})`, isOut };
  }

  /** Headline: the program's schedule or constant, or a point that the page computed. @returns {Headline} */
  headline() {
    const { state, data } = this, told = this.isConstant && data.held ? data.held : data.schedule;
    if (state.fault & 1 || state.kind === "none") return { value: this.pointName(), word: "no robot", words: "The robot has no configuration at these values.", isFault: true, isProgram: false };
    // Texts of the program get the minus signs of the page.
    const proper = (/** @type {string} */ text) => text.replace(/(^|[\s(,=])-(?=[\d.])/g, "$1\u2212");
    if (this.isProgram()) return { value: proper(told.value), word: told.word, words: proper(told.words), isFault: !data.isAnswer, isProgram: data.isAnswer };
    const names = this.movedNames();
    if (!this.isCase) names.push("dimensions");
    if (state.limits.some((each, k) => state.module.arrays.limits[k] !== each.value)) names.push("limits");
    const isOut = data.settings.some((_, k) => this.rateWords(k).isOut);
    const words = `computed in this page at this point, with other ${names.join(", ")} than the ${this.isConstant ? "best constant" : "schedule"}${isOut ? "; the rate does not reach it from the neighbouring points" : ""}`;
    return { value: `${this.pointName()} = ${measured(this.value(), data.unit)}`, word: "point", words, isFault: false, isProgram: false };
  }

  /** Shows the settings, the values and the marks of the maps. @param {boolean} isCase whether the dimensions are those of the case */
  refresh(isCase) {
    this.isCase = isCase;
    const { data, index } = this, now = this.values();
    this.choices?.forEach((button, k) => button.setAttribute("aria-pressed", String((k === 1) === this.isConstant && !this.movedNames().length)));
    this.rows?.forEach(({ range, entry, note }, k) => {
      const { unit, factor } = data.settings[k], value = now[k] * factor, text = digits(value), { words, isOut } = this.rateWords(k);
      if (Math.abs(Number(range.value) - value) > SAME * Math.abs(value)) range.value = String(value);
      range.setAttribute("aria-valuetext", measured(value, unit));
      if (document.activeElement !== entry && entry.value !== text) entry.value = text;
      say(note, words);
      note.classList.toggle("warning", isOut);
    });
    const shown = (/** @type {number[]} */ row, /** @type {number} */ value, /** @type {string} */ whole) => [...row.map((each, k) => digits(each * data.settings[k].factor, 6)), digits(value, 7), whole];
    const { constant } = data, texts = [shown(data.rows[index], data.F[index], digits(data.value)), constant ? shown(constant.row, constant.F[index], digits(constant.value)) : [], shown(now, this.value(), "")];
    this.lines?.forEach(({ cells }, k) => texts[k].forEach((text, i) => say(cells[i], text)));
    this.maps?.forEach((_, k) => this.paint(k));
  }

  /** Maps of the objective over path and setting. */
  addMaps() {
    const { data } = this;
    if (!data.settings.length) return;
    this.maps = data.maps.map((map, k) => {
      const { name } = data.settings[k], canvas = make("canvas", { width: String(WIDTH), height: String(HEIGHT), class: "schedule-map", role: "img", "aria-label": `Map of ${this.pointName()} over the path and ${name}; the sliders of the path and of ${name} move its mark` });
      canvas.addEventListener("click", (/** @type {MouseEvent} */ event) => {
        const box = canvas.getBoundingClientRect();
        this.go(k, (event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height);
      });
      return { canvas, shades: Uint8Array.from(atob(map.shades), (sign) => sign.charCodeAt(0)), picture: /** @type {HTMLCanvasElement | null} */ (null) };
    });
    const { frames } = this.track, along = data.isTimed ? `time ${digits(frames[0].at, 4)} to ${digits(frames[frames.length - 1].at, 5)} s` : "points of the path";
    const parts = this.maps.flatMap(({ canvas }, k) => {
      const { name, unit, low, high, factor } = data.settings[k], map = data.maps[k];
      const words = `${this.pointName()} at a point, ${digits(map.low, 4)} (dark) to ${measured(map.high, data.unit, 4)} (light). To the right: ${along}; upwards: ${name} ${digits(low * factor, 4)} to ${measured(high * factor, unit, 4)}. Grey: a limit is violated. Solid: schedule${data.constant ? "; dashed: best constant" : ""}; circle: shown. The program computed the map for the design of the schedule. A click moves there.`;
      return [canvas, make("p", { class: "note" }, words)];
    });
    byId("values").prepend(make("section", { id: "schedule-maps" }, make("h2", {}, `Map over the path and ${data.settings.map((each) => each.name).join(", ")}`), ...parts));
  }

  /** Function to call with a point and settings after a click on a map. @param {(index: number, row: number[]) => void} act */
  onMap(act) {
    this.act = act;
  }

  /** Moves to a place of a map. @param {number} k @param {number} across @param {number} up */
  go(k, across, up) {
    const { frames } = this.track, { low, high } = this.data.settings[k], at = frames[0].at + across * (frames[frames.length - 1].at - frames[0].at);
    let index = 0;
    frames.forEach((each, i) => {
      if (Math.abs(each.at - at) < Math.abs(frames[index].at - at)) index = i;
    });
    const row = [...this.own(index)];
    row[k] = low + Math.max(0, Math.min(1, up)) * (high - low);
    this.act?.(index, row);
  }

  /** Draws a map with the schedule, the constant and the shown point. @param {number} k */
  paint(k) {
    const { data, track, index } = this, map = data.maps[k], own = this.maps?.[k];
    if (!own) return;
    own.picture ??= this.ground(map, own.shades);
    const context = /** @type {CanvasRenderingContext2D} */ (own.canvas.getContext("2d")), { low, high } = data.settings[k];
    const begin = track.frames[0].at, length = track.frames[track.frames.length - 1].at - begin || 1;
    const x = (/** @type {number} */ at) => (WIDTH * (at - begin)) / length, y = (/** @type {number} */ value) => HEIGHT - (HEIGHT * (value - low)) / (high - low || 1);
    context.drawImage(own.picture, 0, 0);
    const stroke = (/** @type {[string, number][]} */ styles, /** @type {() => void} */ draw) => styles.forEach(([colour, width]) => {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.beginPath();
      draw();
      context.stroke();
    });
    const { constant } = data;
    if (constant) {
      context.setLineDash([12, 8]);
      stroke([["#000000", 4], ["#ffffff", 2]], () => (context.moveTo(0, y(constant.row[k])), context.lineTo(WIDTH, y(constant.row[k]))));
      context.setLineDash([]);
    }
    stroke([["#ffffff", 5], ["#b3001b", 3]], () => data.rows.forEach((row, i) => context[i ? "lineTo" : "moveTo"](x(track.frames[i].at), y(row[k]))));
    const at = x(track.frames[index].at), value = y(this.values()[k]);
    stroke([["#ffffff", 3], ["#000000", 1]], () => (context.moveTo(at, 0), context.lineTo(at, HEIGHT)));
    stroke([["#000000", 5], ["#ffffff", 2.5]], () => context.arc(at, value, 8, 0, 2 * Math.PI));
  }

  /** Map without its lines. @param {MapData} map @param {Uint8Array} shades @returns {HTMLCanvasElement} */
  ground(map, shades) {
    const found = make("canvas", { width: String(WIDTH), height: String(HEIGHT) }), context = found.getContext("2d");
    const { at, rows } = map, begin = at[0], length = at[at.length - 1] - begin || 1, high = HEIGHT / Math.max(1, rows - 1);
    const middle = (/** @type {number} */ i) => (WIDTH * ((at[Math.max(0, i - 1)] + at[Math.min(at.length - 1, i)]) / 2 - begin)) / length;
    at.forEach((_, i) => {
      const from = i ? middle(i) : 0, to = i + 1 < at.length ? middle(i + 1) : WIDTH;
      for (let row = 0; row < rows; row += 1) {
        const value = shades[i * rows + row];
        context.fillStyle = value ? `rgb(${shade((value - 1) / 254).join(",")})` : FORBIDDEN;
        context.fillRect(from, HEIGHT - (row + 0.5) * high, to - from + 0.6, high + 0.6);
      }
    });
    return found;
  }

  /** Fragment of an address with the point, moved settings and changed dimensions. */
  fragment() {
    const { state, data } = this, parts = new URLSearchParams({ point: String(this.index + 1) }), stated = this.stated();
    if (this.isConstant) parts.set("shown", "constant");
    const now = this.values(), moved = this.movedNames();
    data.settings.forEach(({ name, factor }, k) => {
      if (moved.includes(name)) parts.set(name, String(now[k] * factor));
    });
    for (const each of state.sliders) if (each.group === "dimension" && each.vector === "p" && state.module.arrays.p[each.index] !== stated[each.index]) parts.set(each.name, String(state.read(each)));
    state.limits.forEach((limit, k) => {
      const value = state.module.arrays.limits[k];
      if (value !== limit.value) parts.set(`limits.${limit.key}`, String(value * limit.factor));
    });
    return `#${parts}`;
  }

  /** Takes the point and settings of a fragment; null where it has none. @param {string} fragment @returns {number | null} */
  take(fragment) {
    const parts = new URLSearchParams(fragment.replace(/^#/, "")), index = Number(parts.get("point")) - 1, { data, state } = this;
    if (!Number.isInteger(index) || index < 0 || index >= data.rows.length) return null;
    const changed = state.sliders.filter((each) => each.group === "dimension" && parts.has(each.name)).map((each) => each.index);
    const kept = state.module.arrays.p.slice();
    this.isConstant = parts.get("shown") === "constant" && data.constant !== null;
    this.stated().forEach((value, k) => (state.module.arrays.p[k] = changed.includes(k) ? kept[k] : value));
    this.index = index;
    const row = [...this.own(index)];
    let isMoved = false;
    data.settings.forEach(({ name, factor, low, high }, k) => {
      const text = parts.get(name), value = Number(text) / factor;
      if (text === null || text.trim() === "" || !Number.isFinite(value)) return;
      row[k] = Math.max(low, Math.min(high, value));
      isMoved = true;
    });
    this.moved = isMoved ? row : null;
    return index;
  }
}
