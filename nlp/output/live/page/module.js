// The WebAssembly module of a case: its arrays in memory, evaluation and solve. All values are those of computations.

/**
 * @typedef {{ name: string, size: number }} ArrayData
 * @typedef {Record<string, Float64Array>} Arrays
 * @typedef {{ fault: number, F: number }} Evaluation
 * @typedef {{ status: number, F: number, violation: number, residual: number }} Solved
 */

/** Names of the statuses by code. */
export const STATUSES = ["OK", "NOT_CONVERGED", "INFEASIBLE", "BAD_INPUT", "BUDGET", "OTHER_ASSEMBLY", "RANGE_END"];

/** Live module of a case. */
export class CaseModule {
  /**
   * @param {WebAssembly.Instance} instance
   * @param {ArrayData[]} arrays arrays in the order of their numbers
   */
  constructor(instance, arrays) {
    /** @type {any} */
    this.exports = instance.exports;
    /** @type {Arrays} */
    this.arrays = {};
    arrays.forEach(({ name, size }, number) => {
      this.arrays[name] = new Float64Array(this.exports.memory.buffer, this.exports.place(number), size);
    });
    this.exports.reset();
  }

  /**
   * @param {BufferSource} bytes
   * @param {ArrayData[]} arrays
   */
  static async load(bytes, arrays) {
    const { instance } = await WebAssembly.instantiate(bytes, { Math: /** @type {any} */ (Math) });
    return new CaseModule(instance, arrays);
  }

  /**
   * F with its derivatives, limits, and the robot at a pose.
   * @param {number} pose index of the pose
   * @param {boolean} withSlopes whether derivatives are needed
   * @returns {Evaluation}
   */
  evaluate(pose, withSlopes) {
    const fault = this.exports.evaluate(pose, withSlopes ? 1 : 0);
    return { fault, F: this.arrays.F[0] };
  }

  /**
   * Solves from x, and from a number of seeds, between the bounds in `lower` and `upper`.
   * @param {boolean} fromX
   * @param {number} seeds
   * @param {number} [most] largest number of iterations; 0 for no bound
   * @returns {Solved}
   */
  solve(fromX, seeds, most = 0) {
    const status = this.exports.solve(fromX ? 1 : 0, seeds, most);
    const { solution_F, violation, residual } = this.arrays;
    return { status, F: solution_F[0], violation: violation[0], residual: residual[0] };
  }

  /**
   * Closes the loops at x by the smallest change of joint coordinates, and of poses if they follow; false where it cannot.
   * @param {number} moved index in x of a coordinate that stays; -1 for none
   * @param {boolean} withPoses
   */
  closeLoops(moved, withPoses) {
    return this.exports.close_loops(moved, withPoses ? 1 : 0) === 0;
  }

  /** Smallest singular value of J at the last evaluated pose. @param {number} length length by which moments are divided */
  smallestSingularValue(length) {
    return this.exports.smallest_singular_value(length);
  }

  /** Rank of J at the last evaluated pose. */
  rank() {
    return this.exports.rank();
  }

  /** Whether x is in the home assembly mode. */
  isHome() {
    return this.exports.is_home() === 1;
  }

  /**
   * Sets a limit; 0, or another number where it is not allowed.
   * @param {number} index
   * @param {number} value
   */
  setLimit(index, value) {
    return this.exports.set_limit(index, value);
  }

  /**
   * Twist of a unit screw; null for an axis of zero length.
   * @param {number[]} axis
   * @param {number[]} point
   * @param {number} pitch Infinity for a translation
   */
  twist(axis, point, pitch) {
    this.arrays.twist.set([...axis, ...point, pitch]);
    return this.exports.screw() ? null : [...this.arrays.twist.slice(0, 6)];
  }
}
