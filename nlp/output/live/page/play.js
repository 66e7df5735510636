// Motion of a task in the picture: the module follows the screw motion from the present pose, or recorded positions are shown.
import { cross, dot, plus } from "./numbers.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./numbers.js").Vector} Vector
 * @typedef {{ zero: number, frames: number[][] }} Recorded robot along a motion: values of the drawing in each position
 * @typedef {{ x: Float64Array, p: Float64Array, held: Set<number>, kind: any, status: number, others: number[][] }} Kept
 */

/** Largest turn, radians, and largest way of a platform's corner as a part of the robot's size. */
const TURN = 0.2, WAY = 0.12;
/** Steps from the pose to each end of the motion, which find where the robot can follow, and seconds forth and back. */
const STEPS = 12, SECONDS = 4;
/** Blocks of the drawing in recorded positions, in their order. */
const DRAWN = ["points", "circles", "joints", "position"];

/**
 * Pose after a screw motion: the position, and the turn as a quaternion with its real part first.
 * @param {number[]} twist angular velocity, and velocity of the point at the world's origin
 * @param {number} t
 * @param {Vector} position
 * @returns {{ position: Vector, turn: [number, number, number, number] }}
 */
export const displaced = (twist, t, position) => {
  const omega = /** @type {Vector} */ (twist.slice(0, 3)), v = /** @type {Vector} */ (twist.slice(3, 6));
  const square = dot(omega, omega);
  if (!square) return { position: plus(position, v, t), turn: [1, 0, 0, 0] };
  const speed = Math.sqrt(square), angle = speed * t;
  const axis = /** @type {Vector} */ (omega.map((each) => each / speed));
  const centre = /** @type {Vector} */ (cross(omega, v).map((each) => each / square));
  const arm = plus(position, centre, -1), side = cross(axis, arm), along = dot(axis, arm);
  // Rodrigues' formula, and the way along the axis.
  const turned = plus(plus(/** @type {Vector} */ (arm.map((each) => each * Math.cos(angle))), side, Math.sin(angle)), axis, along * (1 - Math.cos(angle)));
  const sine = Math.sin(angle / 2);
  return { position: plus(plus(centre, turned), axis, (dot(axis, v) * t)), turn: [Math.cos(angle / 2), axis[0] * sine, axis[1] * sine, axis[2] * sine] };
};

/** Vector part of the product of a turn and a unit quaternion, which is given by its vector part. @param {number[]} turn @param {number[]} from */
export const turnedVector = ([real, a, b, c], from) => {
  const [x, y, z] = from, w = Math.sqrt(Math.max(0, 1 - x * x - y * y - z * z));
  const made = [real * x + w * a + b * z - c * y, real * y + w * b + c * x - a * z, real * z + w * c + a * y - b * x];
  return real * w - (a * x + b * y + c * z) < 0 ? made.map((each) => -each) : made;
};

/** Motion of the tasks of a page. */
export class Player {
  /**
   * @param {State | null} state null for recorded positions only
   * @param {any} data
   * @param {(act: () => void, key?: any) => void} change runs a change before the next frame
   */
  constructor(state, data, change) {
    this.state = state;
    this.data = data;
    this.change = change;
    /** Index of the task that plays; -1 for none. */
    this.task = -1;
    /** @type {number[] | null} values of the drawing in a recorded position */
    this.view = null;
    /** @type {Kept | null} */
    this.kept = null;
    this.begin = 0;
    /** @type {[number, number]} ends of the motion */
    this.ends = [0, 0];
    /** @type {HTMLButtonElement[]} */
    this.buttons = [...document.querySelectorAll("button[data-play]")].map((each) => /** @type {HTMLButtonElement} */ (each));
    this.buttons.forEach((button, task) => {
      button.hidden = !this.canFollow(task) && !this.recorded(task);
      // Not by the key of the steps: the next step of a motion would take the place of its end.
      button.addEventListener("click", () => (this.task === task ? change(() => this.stop()) : change(() => this.start(task))));
    });
  }

  /** Recorded positions of a task. @param {number} task @returns {Recorded | null} */
  recorded(task) {
    return this.data.recorded[task] ?? null;
  }

  /** @param {number} task @returns {number[]} */
  twist(task) {
    const { p } = this.state ? this.state.module.arrays : this.data, first = this.data.tasks[task].twist;
    return [...p.slice(first, first + 6)];
  }

  /** Sliders of the position of the shown pose. */
  positions() {
    if (!this.state) return [];
    const prefix = this.data.prefixes[this.data.stated_poses[this.state.pose]];
    return ["x", "y", "z"].map((letter) => this.data.sliders.find((/** @type {any} */ each) => each.set === `${prefix}p_${letter}`));
  }

  /** Whether the module can place the robot along the motion. @param {number} task */
  canFollow(task) {
    if (!this.state || !this.positions().every(Boolean)) return false;
    return this.state.quaternion() !== null || this.twist(task).slice(0, 3).every((each) => each === 0);
  }

  /** @param {number} task */
  start(task) {
    this.stop();
    this.task = task;
    this.begin = performance.now();
    if (this.canFollow(task)) this.measure();
    else this.ends = [-1, 1];
    this.buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(k === task)));
    // A headline that changes with each frame is not read out.
    document.getElementById("answer")?.setAttribute("aria-live", "off");
    this.next();
  }

  /** Finds the ends of the motion: as far as the robot can follow, at most by the largest turn and way. */
  measure() {
    const state = /** @type {State} */ (this.state), { arrays } = state.module;
    const { x, p } = arrays, { kind, status, others } = state;
    this.kept = { x: x.slice(), p: p.slice(), held: new Set(state.held), kind, status, others };
    const twist = this.twist(this.task), turn = Math.hypot(...twist.slice(0, 3));
    const [first] = this.data.blocks.points, corners = /** @type {number[]} */ (this.data.scene.corners);
    const speeds = corners.map((k) => Math.hypot(...plus(/** @type {Vector} */ (twist.slice(3)), cross(/** @type {Vector} */ (twist.slice(0, 3)), /** @type {Vector} */ ([...arrays.view.slice(first + 3 * k, first + 3 * k + 3)])))));
    const speed = Math.max(...speeds, turn ? 0 : Math.hypot(...twist.slice(3)));
    const most = Math.min(turn ? TURN / turn : Infinity, speed ? (WAY * this.data.scene.size) / speed : Infinity);
    this.ends = /** @type {[number, number]} */ ([-1, 1].map((sign) => {
      let reached = 0;
      for (let k = 1; k <= STEPS; k += 1) {
        const t = (sign * most * k) / STEPS;
        if (!this.place(t)) break;
        reached = t;
      }
      this.restore();
      return reached;
    }));
  }

  /** Places the robot at a time of the motion; false where it cannot follow. @param {number} t */
  place(t) {
    const state = /** @type {State} */ (this.state), kept = /** @type {Kept} */ (this.kept), { arrays } = state.module;
    const sliders = this.positions(), from = /** @type {Vector} */ (sliders.map((each) => (each.vector === "x" ? kept.x : kept.p)[each.index]));
    const { position, turn } = displaced(this.twist(this.task), t, from), q = state.quaternion();
    sliders.forEach((each, k) => (arrays[/** @type {"x" | "p"} */ (each.vector)][each.index] = position[k]));
    if (q) turnedVector(turn, q.map((index) => kept.x[index])).forEach((value, k) => (arrays.x[q[k]] = value));
    state.close(null);
    state.look();
    return state.status === 0 && !(state.fault & 1);
  }

  restore() {
    const { state, kept } = this;
    if (!state || !kept) return;
    state.module.arrays.x.set(kept.x);
    state.module.arrays.p.set(kept.p);
    Object.assign(state, { held: new Set(kept.held), kind: kept.kind, status: kept.status, others: kept.others });
    state.look();
  }

  /** Next position, by the time since the start. */
  step() {
    if (this.task < 0) return;
    const phase = Math.sin((2 * Math.PI * (performance.now() - this.begin)) / 1000 / SECONDS), [back, forth] = this.ends;
    if (this.kept) this.place(phase > 0 ? phase * forth : -phase * back);
    else this.show(phase);
    this.next();
  }

  next() {
    requestAnimationFrame(() => {
      if (this.task >= 0) this.change(() => this.step(), this);
    });
  }

  /** Shows the recorded position at a part of the way, from -1 to 1. @param {number} part */
  show(part) {
    const { zero, frames } = /** @type {Recorded} */ (this.recorded(this.task));
    const values = frames[Math.round(zero + part * (part > 0 ? frames.length - 1 - zero : zero))];
    this.view = [...(this.state ? this.state.module.arrays.view : this.data.view)];
    let at = 0;
    for (const name of DRAWN) {
      const [first, size] = this.data.blocks[name];
      for (let k = 0; k < size; k += 1, at += 1) this.view[first + k] = values[at];
    }
  }

  /** Ends the motion, with the robot where it began. */
  stop() {
    if (this.task < 0) return;
    this.restore();
    this.kept = null;
    this.view = null;
    this.task = -1;
    for (const button of this.buttons) button.setAttribute("aria-pressed", "false");
    document.getElementById("answer")?.setAttribute("aria-live", "polite");
  }
}
