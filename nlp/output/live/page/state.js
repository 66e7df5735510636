// State of a live page: values, held sliders and limits; solve and evaluation; the state as text.
import { STATUSES } from "./module.js";
import { leastMarginOf, sidesOf } from "./limits.js";

/**
 * @typedef {{ name: string, set: string, group: string, unit: string, factor: number, vector: "x" | "p", index: number,
 *   low: number, high: number, start: number, turn: boolean, pose: number }} Slider
 * @typedef {{ key: string, unit: string, factor: number, value: number, above: number | null, most: number | null }} Limit
 * @typedef {{ name: string, keys: string[], reading: number, low: number | null, high: number | null, unit: string,
 *   factor: number, constraint: number }} Row
 * @typedef {"program" | "optimum" | "point" | "none"} Kind
 */

/** F below this part of its terms is rounding error, as in `nlp/evidence/state.py`. */
const ZERO_F = 1e-12;
/** Seeds of a solve that follows a slider where the search from the last point fails. */
const FEW_SEEDS = 4;
/** Random starts of the search for other local optima. */
const STARTS = 24;

/** Values of a case in its module, and what is known about them. */
export class State {
  /**
   * @param {import("./module.js").CaseModule} module
   * @param {any} data
   */
  constructor(module, data) {
    this.module = module;
    this.data = data;
    /** @type {Slider[]} */
    this.sliders = data.sliders;
    /** @type {Limit[]} */
    this.limits = data.limits;
    /** @type {Set<number>} held variables by index in x */
    this.held = new Set();
    /** @type {"solve" | "evaluate"} */
    this.mode = "solve";
    this.pose = 0;
    /** @type {Kind} */
    this.kind = "point";
    this.status = 0;
    this.fault = 0;
    this.seconds = 0;
    /** @type {{ F: number, size: number }[]} F of each task, and the size of its terms */
    this.taskSums = [];
    this.inner = new Set(data.inner);
    this.low = module.arrays.case_lower.slice();
    this.high = module.arrays.case_upper.slice();
    this.rowLow = module.arrays.g_lower.slice();
    this.rowHigh = module.arrays.g_upper.slice();
    /** @type {{ axis: number[], point: number[], pitch: number }[]} tasks as they are now */
    this.tasks = [];
    /** @type {number[]} weights of several tasks as they are now */
    this.weights = [];
    /** Words about the point from the search that led to it. */
    this.remark = "";
    this.sides = sidesOf(data.rows, this.limits);
    /** @type {number[][]} other local optima */
    this.others = [];
    this.jump("answer");
  }

  /** @param {Slider} slider */
  read(slider) {
    const value = this.module.arrays[slider.vector][slider.index];
    return (slider.turn ? 2 * Math.asin(Math.max(-1, Math.min(1, value))) : value) * slider.factor;
  }

  /**
   * Value of the module from the shown one.
   * @param {Slider} slider
   * @param {number} shown
   */
  inside(slider, shown) {
    const value = shown / slider.factor;
    return slider.turn ? Math.sin(value / 2) : value;
  }

  /** @param {Slider} slider */
  ends(slider) {
    const shown = (/** @type {number} */ value) => (slider.turn ? 2 * Math.asin(value) : value) * slider.factor;
    return [shown(slider.low), shown(slider.high)];
  }

  /** @param {Slider} slider */
  isHeld(slider) {
    return slider.vector === "p" || this.held.has(slider.index);
  }

  /**
   * Moves a slider: its value is held, and the others follow or stay.
   * @param {Slider} slider
   * @param {number} shown
   */
  move(slider, shown) {
    this.module.arrays[slider.vector][slider.index] = this.inside(slider, shown);
    if (slider.vector === "x") this.held.add(slider.index);
    this.others = [];
    this.update(slider);
  }

  /**
   * @param {Slider} slider
   * @param {boolean} isHeld
   */
  hold(slider, isHeld) {
    if (slider.vector === "p") return;
    if (isHeld) this.held.add(slider.index);
    else this.held.delete(slider.index);
    if (!isHeld && this.mode === "solve") this.update(null);
  }

  /**
   * Sets a limit in the case's unit; false where the value is not allowed.
   * @param {number} index
   * @param {number} shown
   */
  setLimit(index, shown) {
    const value = shown / this.limits[index].factor;
    this.restoreRows();
    if (!Number.isFinite(value) || this.module.setLimit(index, value)) return false;
    this.rowLow = this.module.arrays.g_lower.slice();
    this.rowHigh = this.module.arrays.g_upper.slice();
    this.others = [];
    this.update(null);
    return true;
  }

  /** Tasks of the case by axis, point and pitch. */
  statedTasks() {
    return this.data.stated_tasks.map((/** @type {any} */ { axis, point, pitch }) => ({
      axis: [...(axis ?? [])],
      point: [...(point ?? [])],
      pitch: pitch === "inf" ? Infinity : Number(pitch),
    }));
  }

  /**
   * Sets a value of a task; false where it has no motion.
   * @param {number} index
   * @param {"axis" | "point" | "pitch"} key
   * @param {number} place component of an axis or point; -1 for all
   * @param {number | number[]} value
   */
  setTask(index, key, place, value) {
    const task = this.tasks[index], made = { ...task, axis: [...task.axis], point: [...task.point] };
    if (Array.isArray(value)) made[key === "point" ? "point" : "axis"] = value;
    else if (key === "pitch") made.pitch = value;
    else made[key][place] = value;
    const point = made.point.length ? made.point : [0, 0, 0];
    if ([value].flat().some((each) => Number.isNaN(each) || (key !== "pitch" && !Number.isFinite(each)))) return false;
    const twist = this.module.twist(made.axis, point, made.pitch);
    if (!twist || !twist.every(Number.isFinite)) return false;
    this.tasks[index] = made;
    this.others = [];
    this.module.arrays.p.set(twist, this.data.tasks[index].twist);
    this.update(null);
    return true;
  }

  /** Weights of the case, relative to each other; empty for one task. @returns {number[]} */
  statedWeights() {
    const { tasks, p } = this.data;
    return tasks.some((/** @type {{ weight: number }} */ each) => each.weight < 0) ? [] : tasks.map((/** @type {{ weight: number }} */ each) => Math.abs(p[each.weight]));
  }

  /**
   * Sets the weight of a task; all weights are scaled to sum to the number of tasks, as the program does.
   * @param {number} index
   * @param {number} value
   */
  setWeight(index, value) {
    if (!(value > 0) || !Number.isFinite(value) || !this.weights.length) return false;
    const { p, case_lower, case_upper } = this.module.arrays, { tasks, level } = this.data, stated = this.statedWeights();
    this.weights[index] = value;
    const total = this.weights.reduce((sum, each) => sum + each, 0);
    const ratios = this.weights.map((each, k) => {
      const own = (each * this.weights.length) / total, place = tasks[k].weight;
      p[place] = Math.sign(this.data.p[place]) * own;
      return Math.max(own / stated[k], stated[k] / own);
    });
    // The level of a worst case grows at most as much as a weight or its inverse does.
    if (level >= 0) [case_lower[level], case_upper[level]] = [this.low[level], this.high[level]].map((each) => each * Math.max(1, ...ratios));
    this.others = [];
    this.update(null);
    return true;
  }

  restoreRows() {
    this.module.arrays.g_lower.set(this.rowLow);
    this.module.arrays.g_upper.set(this.rowHigh);
  }

  /** @param {"solve" | "evaluate"} mode */
  setMode(mode) {
    this.mode = mode;
    this.update(null);
  }

  /** Values of the sliders between their ends in x. */
  bounds() {
    const { lower, upper, x } = this.module.arrays;
    const { case_lower, case_upper } = this.module.arrays;
    for (let i = 0; i < x.length; i += 1) {
      const isHeld = this.held.has(i);
      lower[i] = isHeld ? x[i] : case_lower[i];
      upper[i] = isHeld ? x[i] : case_upper[i];
    }
  }

  /**
   * Solves or evaluates after a change, as the mode says.
   * @param {Slider | null} moved
   */
  update(moved) {
    const begin = performance.now();
    this.remark = "";
    if (this.mode === "solve") this.solveFromHere();
    else this.close(moved);
    this.look();
    this.seconds = (performance.now() - begin) / 1000;
  }

  solveFromHere() {
    const { module } = this;
    this.restoreRows();
    this.bounds();
    let answer = module.solve(true, 0);
    if (!this.isAnswer(answer.status)) answer = module.solve(true, FEW_SEEDS);
    if (answer.status !== 3) module.arrays.x.set(module.arrays.solution);
    this.status = answer.status;
    this.kind = !this.isAnswer(answer.status) ? "none" : this.freeNames().length ? "optimum" : "point";
    if (this.kind === "optimum" && this.isProgram()) {
      module.arrays.x.set(this.data.answer.x);
      this.kind = "program";
    }
  }

  /** Names of the variables that are solved for. */
  freeNames() {
    return this.sliders.filter((each) => each.vector === "x" && !this.held.has(each.index)).map((each) => each.name);
  }

  /** Whether everything is as in the program's answer, which is an optimum. */
  isProgram() {
    const { answer } = this.data;
    return Boolean(answer?.isOptimum) && !this.held.size && this.isStatedCase() && this.isNear(answer.x, this.module.arrays.x);
  }

  /** @param {number} status */
  isAnswer(status) {
    return STATUSES[status] === "OK" || STATUSES[status] === "RANGE_END";
  }

  /**
   * Evaluates the point; joint coordinates from closed loops follow, and where they cannot, so does the pose.
   * @param {Slider | null} moved
   */
  close(moved) {
    this.kind = "point";
    this.status = 0;
    if (!this.inner.size) return;
    const own = moved && moved.vector === "x" ? moved.index : -1;
    const isClosed = this.module.closeLoops(-1, false) || (this.data.is_following && (this.module.closeLoops(own, true) || (own >= 0 && this.module.closeLoops(-1, true))));
    if (isClosed) return;
    this.kind = "none";
    this.status = 2;
  }

  /** Sliders of the position of the shown pose that a hand can move: free ones, or else fixed ones. */
  positions() {
    const stated = this.data.stated_poses[this.pose], prefix = this.data.prefixes[stated];
    const found = ["x", "y", "z"].map((letter) => this.sliders.find((each) => each.set === `${prefix}p_${letter}`));
    const isFree = found.some((each) => each?.vector === "x");
    return found.map((each) => (each && (!isFree || each.vector === "x") ? each : null));
  }

  /** Indices of the quaternion of the shown pose; null for a fixed axis. @returns {number[] | null} */
  quaternion() {
    const prefix = this.data.prefixes[this.data.stated_poses[this.pose]];
    return this.data.rotations.find((/** @type {{ prefix: string }} */ each) => each.prefix === prefix)?.q ?? null;
  }

  /**
   * Moves the platform to a position, as far as its sliders allow.
   * @param {number[]} target
   */
  place(target) {
    this.positions().forEach((slider, k) => {
      if (!slider) return;
      const isFree = slider.vector === "x", value = isFree ? Math.max(slider.low, Math.min(slider.high, target[k])) : target[k];
      this.module.arrays[slider.vector][slider.index] = value;
    });
    this.settle(this.positions());
  }

  /** Takes the nearest pose that the loops allow, holds its coordinates, and shows it. @param {(Slider | null)[]} moved */
  settle(moved) {
    if (this.data.is_following && !this.module.closeLoops(-1, true)) this.status = 2;
    for (const slider of moved) if (slider?.vector === "x") this.held.add(slider.index);
    this.update(null);
  }

  /**
   * Slider of the angle of the shown pose, and its axis; null for a free axis.
   * @returns {{ slider: Slider, axis: number[] } | null}
   */
  angle() {
    const stated = this.data.stated_poses[this.pose], axis = this.data.turn_axes[stated];
    const slider = this.sliders.find((each) => each.set === `${this.data.prefixes[stated]}angle`);
    return slider && axis?.length ? { slider, axis } : null;
  }

  /** Rotation of the shown pose for a hand to begin with: vector part of its quaternion, or its angle. */
  rotation() {
    const { arrays } = this.module, held = this.angle();
    return held ? [arrays[held.slider.vector][held.slider.index]] : (this.quaternion() ?? []).map((index) => arrays.x[index]);
  }

  /**
   * Turns the platform from a rotation, by a rotation vector in the world frame; about a fixed axis, by its part there.
   * @param {number[]} from result of `rotation`
   * @param {number[]} turn
   */
  turn(from, turn) {
    const q = this.quaternion(), held = this.angle();
    if (held) {
      const { slider, axis } = held, size = Math.hypot(...axis), by = turn.reduce((sum, each, k) => sum + (each * axis[k]) / size, 0);
      const value = slider.vector === "x" ? Math.max(slider.low, Math.min(slider.high, from[0] + by)) : from[0] + by;
      this.module.arrays[slider.vector][slider.index] = value;
      this.settle([slider]);
    }
    if (!q) return;
    const angle = Math.hypot(...turn), part = angle ? Math.sin(angle / 2) / angle : 0, real = Math.cos(angle / 2);
    const a = turn.map((each) => each * part), [x, y, z] = from, w = Math.sqrt(Math.max(0, 1 - x * x - y * y - z * z));
    const made = [
      real * x + w * a[0] + a[1] * z - a[2] * y,
      real * y + w * a[1] + a[2] * x - a[0] * z,
      real * z + w * a[2] + a[0] * y - a[1] * x,
    ];
    const { x: point, case_lower, case_upper } = this.module.arrays;
    q.forEach((index, k) => {
      point[index] = Math.max(case_lower[index], Math.min(case_upper[index], made[k]));
    });
    this.settle(this.sliders.filter((each) => each.vector === "x" && q.includes(each.index)));
  }

  /** Evaluates everything that is shown. */
  look() {
    const { poses, tasks } = this.data;
    this.taskSums = tasks.map(() => ({ F: 0, size: 0 }));
    // The module has the robot of one pose: F of one of several tasks needs all its poses, and the shown one comes last.
    for (let pose = 0; pose < poses && tasks.length > 1; pose += 1) {
      if (pose === this.pose) continue;
      this.module.evaluate(pose, false);
      this.addPose(pose);
    }
    this.fault = this.module.evaluate(this.pose, true).fault;
    this.addPose(this.pose);
  }

  /** Adds F at the evaluated pose to that of its tasks. @param {number} pose */
  addPose(pose) {
    const { blocks, pose_tasks } = this.data, { view } = this.module.arrays;
    this.taskSums.forEach((sum, task) => {
      if (pose_tasks.length && pose_tasks[pose] !== task) return;
      const k = pose_tasks.length ? 0 : task;
      sum.F += view[blocks.F[0] + k];
      sum.size += view[blocks.magnitude[0] + k];
    });
  }

  /** F of each of several tasks over its poses, and its separate optimum in the case as it is, null where it is not known. @returns {{ F: number, best: number | null }[]} */
  taskValues() {
    const { tasks, poses, pose_tasks, is_mean, answer } = this.data, count = pose_tasks.length ? poses / tasks.length : poses;
    if (tasks.length < 2) return [];
    const isKnown = this.isStatedCase(tasks.map((/** @type {{ weight: number }} */ each) => each.weight));
    return this.taskSums.map(({ F, size }, k) => {
      const value = Math.abs(F) <= ZERO_F * size ? 0 : F;
      return { F: is_mean ? value / count : value, best: isKnown ? (answer?.optima[k] ?? null) : null };
    });
  }

  /** Whether limits and fixed values are those of the case. @param {number[]} [besides] indices in p that may differ */
  isStatedCase(besides = []) {
    const { arrays } = this.module;
    return this.limits.every((each, k) => arrays.limits[k] === each.value) && arrays.p.every((each, k) => each === this.data.p[k] || besides.includes(k));
  }

  /**
   * Jumps to a point: the program's answer, the start of the case, or the next local optimum.
   * @param {"answer" | "start" | "next"} where
   */
  jump(where) {
    const { arrays } = this.module;
    this.held.clear();
    this.seconds = 0;
    if (where === "next") {
      this.next();
      return;
    }
    this.module.exports.reset();
    this.rowLow = arrays.g_lower.slice();
    this.rowHigh = arrays.g_upper.slice();
    this.tasks = this.statedTasks();
    this.weights = this.statedWeights();
    this.remark = "";
    this.others = [];
    this.kind = "point";
    this.status = 0;
    const { answer, start } = this.data;
    if (where === "answer" && answer) {
      arrays.x.set(answer.x);
      this.kind = answer.isOptimum ? "program" : "point";
    } else {
      arrays.x.set(start);
    }
    this.look();
  }

  /** Next local optimum of those from random starts, by its value. */
  next() {
    const { arrays } = this.module;
    this.restoreRows();
    this.bounds();
    if (!this.others.length) this.others = this.search();
    if (!this.others.length) {
      this.solveFromHere();
    } else {
      const now = arrays.x.slice();
      const at = this.others.findIndex((each) => this.isNear(each, now));
      arrays.x.set(this.others[(at + 1) % this.others.length]);
      this.kind = this.isProgram() ? "program" : "optimum";
      this.status = 0;
    }
    this.look();
  }

  /** Local optima from random starts, best first. */
  search() {
    const { arrays } = this.module;
    const kept = arrays.x.slice();
    /** @type {{ F: number, x: number[] }[]} */
    const found = [];
    let seed = 1;
    const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
    for (let k = 0; k < STARTS; k += 1) {
      for (let i = 0; i < arrays.x.length; i += 1) {
        const isJoint = this.inner.has(i);
        arrays.x[i] = isJoint ? this.data.start[i] : arrays.lower[i] + random() * (arrays.upper[i] - arrays.lower[i]);
      }
      const answer = this.module.solve(true, 0);
      if (answer.status !== 0) continue;
      const x = [...arrays.solution];
      if (!found.some((each) => this.isNear(each.x, x))) found.push({ F: answer.F, x });
    }
    arrays.x.set(kept);
    const sign = this.data.sense === "max" ? -1 : 1;
    return found.sort((a, b) => sign * (a.F - b.F)).map((each) => each.x);
  }

  /**
   * @param {ArrayLike<number>} one
   * @param {ArrayLike<number>} other
   */
  isNear(one, other) {
    const { case_lower, case_upper } = this.module.arrays;
    for (let i = 0; i < one.length; i += 1) {
      if (!this.inner.has(i) && Math.abs(one[i] - other[i]) > 1e-5 * (case_upper[i] - case_lower[i])) return false;
    }
    return true;
  }

  /** Smallest relative margin of all limits, negative for a violated one; Infinity without limits. */
  leastMargin() {
    return leastMarginOf(this.module, this.sides);
  }

  /** F at the point; 0 where it is rounding error of its terms, as in the terminal. */
  shownF() {
    const { F, view, p } = this.module.arrays, [first] = this.data.blocks.magnitude, { tasks, poses, pose_tasks } = this.data;
    if (this.fault & 3) return NaN;
    const terms = tasks.map((/** @type {{ weight: number }} */ task, /** @type {number} */ k) => view[first + (pose_tasks.length ? 0 : k)] * (task.weight < 0 ? 1 : Math.abs(p[task.weight])));
    const size = poses * terms.reduce((/** @type {number} */ sum, /** @type {number} */ each) => sum + each, 0);
    return Math.abs(F[0]) <= ZERO_F * size ? 0 : F[0];
  }

  /** Derivative of F by the shown value of a slider; NaN where it is not known. @param {Slider} slider */
  slope(slider) {
    if (!this.data.has_slopes || this.fault & 2) return NaN;
    const { gradient, slopes, x } = this.module.arrays;
    const raw = slider.vector === "x" ? gradient[slider.index] : slopes[slider.index];
    const turn = slider.turn ? Math.sqrt(Math.max(0, 1 - x[slider.index] ** 2)) / 2 : 1;
    return (raw * turn) / slider.factor;
  }

  /** Whether a task is not that of the case. */
  hasOtherTask() {
    const { p } = this.module.arrays, six = [0, 1, 2, 3, 4, 5];
    return this.data.tasks.some((/** @type {{ twist: number }} */ { twist }) => six.some((k) => p[twist + k] !== this.data.p[twist + k]));
  }

  /** Text of the headline: what is known about the point, and from whom. */
  headline() {
    const { data } = this;
    const held = this.sliders.filter((each) => each.vector === "x" && this.held.has(each.index)).map((each) => each.name);
    if (this.fault & 1) return { word: "no robot", words: "The robot has no configuration at these values.", isFault: true };
    if (this.kind === "program") return { word: "optimal", words: "found and checked by the program, not by this page", isFault: false };
    if (this.kind === "optimum") {
      const changed = this.sliders.filter((each) => each.vector === "p" && this.module.arrays.p[each.index] !== data.p[each.index]).map((each) => each.name);
      if (this.hasOtherTask()) changed.push("the task");
      if (this.statedWeights().some((each, k) => Math.abs(this.weights[k] - each) > 1e-12 * each)) changed.push("the weights");
      const parts = [held.length ? `${held.join(", ")} held` : "", changed.length ? `${changed.join(", ")} changed` : ""].filter(Boolean);
      const end = parts.length ? ` with ${parts.join(", ")}` : "";
      return { word: "local optimum", words: `found in this page${end}${data.notice ? ", limits only at the stated pose" : ""}; not proved`, isFault: false };
    }
    if (this.kind === "none") {
      return { word: "no optimum", words: data.statuses[this.status], isFault: true };
    }
    if (this.remark) return { word: "point", words: this.remark, isFault: false };
    return { word: "point", words: "value at this point; computed in this page, nothing is optimised", isFault: false };
  }
}
