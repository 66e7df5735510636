// Live view along a tool path: a slider of the page moves the robot, bars show forces and speeds, a mark follows the curves.
import { dot, measured } from "./numbers.js";
import { byId, make } from "./panel.js";
import { Schedule } from "./schedule.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./numbers.js").Vector} Vector
 * @typedef {import("./scene.js").Piece} Piece
 * @typedef {{ words: string, at: number, values: number[], has_time: boolean }} Frame point of the path, with the variables of the pose
 * @typedef {{ title: string, unit: string, limits: number[], low: number, high: number, base: number, is_speed: boolean, is_lower: boolean, curves: { name: string, values: (number | null)[] }[] }} Panel
 * @typedef {{ places: number[], frames: Frame[], panels: Panel[], path: Vector[], nearest: number[], margins: (number | null)[],
 *   limits: { words: string, colour: string }[], most: number, marks: { words: string, position: Vector }[], first: number,
 *   schedule?: import("./schedule.js").ScheduleData }} TrackData
 */

/** Colours of violated limits, and of a path without limits; stops of the colours of margins. */
const VIOLATED_COLOUR = "#a3250f", PLAIN = "#68747f", MARGINS = [[163, 37, 15], [224, 138, 60], [154, 163, 171], [8, 81, 156]];
/** Number of colours of limits in the style sheet of paths. */
const LIMIT_COLOURS = 8;
/** Seconds of the whole path. */
const LAP = 15;

/** Place of a value in the bars of a panel, percent. @param {Panel} panel @param {number} value */
const partOf = ({ low, high }, value) => Math.max(0, Math.min(100, (100 * (value - low)) / (high - low)));

/** Colour of a margin as a part of the largest one with a different colour. @param {number} part */
const marginColour = (part) => {
  const at = 3 * Math.max(0, Math.min(1, part)), low = Math.min(2, Math.floor(at)), share = at - low;
  return `rgb(${MARGINS[low].map((each, k) => Math.round(each + share * (MARGINS[low + 1][k] - each))).join(",")})`;
};

/** Path of a page, its slider, and the curves. */
export class Track {
  /**
   * @param {State} state
   * @param {TrackData} data
   * @param {(act: () => void, key?: any) => void} change runs a change before the next frame
   * @param {(text: string, words: string) => void} copy shows a text for other programs
   */
  constructor(state, data, change, copy) {
    this.state = state;
    this.data = data;
    this.change = change;
    // A page about a path has its own slider and curves; that of a schedule has them in its view.
    const page = (this.page = globalThis.document);
    this.schedule = data.schedule ? new Schedule(state, data, data.schedule, () => change(() => this.move(this.index)), copy) : null;
    this.index = data.first;
    this.isPlaying = false;
    /** Points of the path, which the picture contains. */
    this.way = data.path;
    page.documentElement.classList.add("scripted");
    document.documentElement.classList.add("on-path");
    state.mode = "evaluate";
    const own = (/** @type {string} */ id) => byId(id) ?? page.getElementById(id);
    this.slider = /** @type {HTMLInputElement} */ (own("travel"));
    this.button = /** @type {HTMLButtonElement} */ (own("play"));
    this.travelled = /** @type {HTMLElement | null} */ (own("travelled"));
    this.pace = /** @type {HTMLSelectElement | null} */ (own("pace"));
    this.colour = /** @type {HTMLSelectElement | null} */ (page.getElementById("path-colour"));
    this.slider.addEventListener("input", () => {
      this.pause();
      change(() => this.travel(Number(this.slider.value)), this);
    });
    this.schedule?.onMap((index, row) => change(() => {
      this.pause();
      this.travel(index);
      this.schedule?.set(row);
      this.move(index);
    }));
    this.button.addEventListener("click", () => (this.isPlaying ? this.pause() : this.play()));
    this.colour?.addEventListener("change", () => {
      page.documentElement.classList.toggle("margin-shown", this.colour?.value === "margin");
      change(() => {}, this);
    });
    const reset = make("button", { type: "button", id: "case-dimensions" }, "Dimensions of the case");
    reset.addEventListener("click", () => change(() => this.reset()));
    byId("mode-solve").parentElement?.append(reset);
    const note = byId("controls").querySelector(".needs-module > .note");
    if (note) note.textContent = this.schedule ? "Limits, forces and the last row are computed in this page at this point." : "The pose is that of the path. Limits, F and the table are computed in this page at this pose.";
    this.addBars();
    this.move(this.index);
  }

  /** Bars of forces, speeds and coordinates, which the program computed. */
  addBars() {
    const place = byId("track");
    this.bars = this.data.panels.map((panel) => {
      const rows = panel.curves.map(({ name, values }) => {
        const fill = make("i", {}), value = make("output", { class: "value" });
        const marks = panel.limits.map((limit) => make("b", { style: `left: ${partOf(panel, limit).toFixed(2)}%` }));
        const element = make("div", { class: panel.base === panel.low ? "drive ranged" : "drive" }, make("span", {}, name), make("span", { class: "track" }, fill, ...marks), value);
        return { element, fill, value, values };
      });
      place.append(make("div", { class: "panel" }, make("h2", {}, panel.unit ? `${panel.title}, ${panel.unit}` : panel.title), ...rows.map((each) => each.element)));
      return { panel, rows };
    });
    if (this.schedule) return;
    this.changed = make("p", { class: "note" }, "These bars belong to the dimensions of the case, and are hidden for others.");
    place.append(this.changed);
  }

  /** Whether the dimensions are those of the case. */
  isCase() {
    const { p } = this.state.module.arrays, stated = this.stated();
    return this.state.sliders.every((each) => each.vector !== "p" || each.group !== "dimension" || p[each.index] === stated[each.index]);
  }

  /** Fixed values of the case; with a schedule, those of the shown design. @returns {number[]} */
  stated() {
    return this.schedule?.stated() ?? this.state.data.p;
  }

  /** Moves along the path, with the settings of the schedule. @param {number} index */
  travel(index) {
    this.schedule?.set(null);
    this.move(index);
  }

  /** Takes a point, settings and the choice of schedule or constant from a fragment. @param {string} fragment */
  take(fragment) {
    const index = this.schedule?.take(fragment) ?? null;
    if (index === null) return;
    this.state.mode = "evaluate";
    this.move(index);
  }

  /** Places the robot at a point of the path. @param {number} index */
  move(index) {
    const { state } = this, { x } = state.module.arrays, { values } = this.data.frames[index];
    this.index = index;
    if (this.schedule) {
      this.schedule.place(index);
    } else {
      this.data.places.forEach((place, k) => (x[place] = values[k]));
      state.kind = "point";
      state.status = 0;
      if (!this.isCase()) state.close(null);
    }
    state.look();
  }

  /** Sets the dimensions of the case. */
  reset() {
    this.state.module.arrays.p.set(this.stated());
    this.move(this.index);
  }

  play() {
    const { frames } = this.data, last = frames.length - 1, from = this.index === last ? 0 : this.index, begin = performance.now();
    // In real time, at the speed of the path; otherwise the whole path in the time of a lap.
    const isReal = this.pace?.value === "real";
    document.getElementById("answer")?.setAttribute("aria-live", "off");
    this.isPlaying = true;
    this.button.textContent = "Pause";
    const step = () => {
      if (!this.isPlaying) return;
      const seconds = (performance.now() - begin) / 1000;
      let to = Math.min(last, from + Math.floor((last * seconds) / LAP));
      if (isReal) for (to = this.index; to < last && frames[to + 1].at - frames[from].at <= seconds; ) to += 1;
      if (to !== this.index) {
        const next = to;
        this.change(() => this.travel(next), this);
      }
      if (to === last) this.pause();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.isPlaying = false;
    this.button.textContent = "Play";
    document.getElementById("answer")?.setAttribute("aria-live", "polite");
  }

  /** Shows the point: words, marks of the curves, bars. */
  refresh() {
    const { words, at, has_time } = this.data.frames[this.index], isCase = this.isCase();
    this.slider.value = String(this.index);
    this.slider.setAttribute("aria-valuetext", words);
    if (this.travelled) this.travelled.textContent = words;
    this.schedule?.refresh(isCase);
    for (const each of /** @type {NodeListOf<SVGElement>} */ (this.page.querySelectorAll(".cursor"))) {
      const { low, high, left, width } = each.dataset;
      const part = (at - Number(low)) / (Number(high) - Number(low));
      each.setAttribute("transform", `translate(${(Number(left) + part * Number(width)).toFixed(2)} 0)`);
      each.classList.add("placed");
    }
    if (this.changed) this.changed.hidden = isCase;
    for (const { panel, rows } of this.bars ?? []) {
      const [low, high] = [Math.min(...panel.limits), Math.max(...panel.limits)];
      for (const { element, fill, value, values } of rows) {
        const now = values[this.index];
        element.parentElement.hidden = !isCase;
        value.textContent = now === null ? (panel.is_speed && !has_time ? "no time" : "unknown") : measured(now, "", 5);
        const base = partOf(panel, panel.base), part = now === null ? base : partOf(panel, now);
        fill.style.left = `${Math.min(base, part).toFixed(2)}%`;
        fill.style.width = `${Math.abs(part - base).toFixed(2)}%`;
        const isOver = now !== null && panel.limits.length > 0 && ((now > high && !panel.is_lower) || ((panel.limits.length > 1 || panel.is_lower) && now < low));
        element.classList.toggle("over", isOver);
      }
    }
  }

  /** Pieces of the path in the picture. @param {import("./scene.js").Axes} axes @param {Record<string, string>} colours @returns {Piece[]} */
  pieces(axes, colours) {
    const { path, nearest, margins, limits, most, marks } = this.data, byMargin = this.colour?.value === "margin";
    // The legend of the page has the colours of its scheme.
    const style = getComputedStyle(this.page.documentElement), named = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
    const violated = named("edge") || VIOLATED_COLOUR;
    /** @type {Piece[]} */
    const found = [];
    path.slice(1).forEach((to, k) => {
      const margin = margins[k], from = path[k];
      const byLimit = margin !== null && margin < 0 ? violated : nearest[k] < 0 ? PLAIN : named(`l${nearest[k] % LIMIT_COLOURS}`) || limits[nearest[k]].colour;
      const colour = byMargin && margin !== null ? marginColour(margin / most) : byLimit;
      found.push({ kind: "line", points: [from, to], colour, width: 3, depth: (dot(from, axes.towards) + dot(to, axes.towards)) / 2 });
    });
    const dots = /** @type {[Vector, string][]} */ ([...marks.map((each) => [each.position, violated]), [/** @type {Vector} */ (this.data.frames[this.index].values.slice(0, 3)), colours.ink]]);
    for (const [at, colour] of dots) found.push({ kind: "dot", points: [at], colour, width: 5, depth: dot(at, axes.towards) + 0.05 * this.state.data.scene.size });
    return found;
  }
}
