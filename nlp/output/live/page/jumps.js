// Jump to the worst pose of the workspace among poses that the page samples.
import { digits } from "./numbers.js";
import { byId, make } from "./panel.js";

/**
 * @typedef {import("./state.js").State} State
 * @typedef {{ coordinates: [number, number, number][], turn: number, notice: string }} Travel
 */

/** Largest number of samples, most milliseconds for them, and samples near the worst of them. */
const SAMPLES = 4000, MILLISECONDS = 250, NEAR = 300;

/** Parts between 0 and 1 of a pose: its coordinates, then three for a rotation by a free axis. @param {Travel} travel */
const sizeOf = (travel) => travel.coordinates.length + (travel.turn ? 3 : 0);

/** Puts the robot at a pose of the workspace. @param {State} state @param {Travel} travel @param {number[]} parts */
const put = (state, travel, parts) => {
  const { arrays } = state.module;
  travel.coordinates.forEach(([index, low, high], k) => {
    const slider = state.sliders[index];
    arrays[slider.vector][slider.index] = low + parts[k] * (high - low);
  });
  const q = state.quaternion();
  if (!travel.turn || !q) return;
  // The vector of a turn is inside the ball of the largest angle.
  const vector = parts.slice(-3).map((each) => 2 * each - 1), size = Math.hypot(...vector), most = Math.max(1, size);
  const angle = travel.turn * (size / most), sine = size ? Math.sin(angle / 2) / size : 0;
  q.forEach((index, k) => (arrays.x[index] = vector[k] * sine));
};

/** Moves the robot to the worst of sampled poses, and says so. @param {State} state */
export const goToWorst = (state) => {
  const travel = /** @type {Travel} */ (state.data.travel), size = sizeOf(travel), { arrays } = state.module;
  const begun = arrays.x.slice(), fixed = arrays.p.slice(), hasLimits = state.sides.length > 0, begin = performance.now();
  let seed = 7;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  /** How good a pose is: -Infinity where the robot cannot be. @param {number[]} parts */
  const look = (parts) => {
    arrays.x.set(begun);
    arrays.p.set(fixed);
    put(state, travel, parts);
    state.close(null);
    state.fault = state.module.evaluate(state.pose, false).fault;
    if (state.kind === "none" || state.fault & 1) return -Infinity;
    return hasLimits ? state.leastMargin() : arrays.singular_values[5];
  };
  let worst = Array.from({ length: size }, () => 0.5), least = look(worst), count = 1;
  const take = (/** @type {number[]} */ parts) => {
    const value = look(parts);
    count += 1;
    if (value < least) [worst, least] = [parts, value];
  };
  for (let k = 0; k < 2 ** size && k < 512; k += 1) take(Array.from({ length: size }, (_, i) => (k >> i) & 1));
  while (count < SAMPLES && performance.now() - begin < MILLISECONDS) take(Array.from({ length: size }, random));
  for (let k = 0; k < NEAR && least > -Infinity; k += 1) {
    const radius = 0.15 * (1 - k / NEAR);
    take(worst.map((each) => Math.max(0, Math.min(1, each + radius * (2 * random() - 1)))));
  }
  look(worst);
  state.mode = "evaluate";
  state.others = [];
  state.look();
  const where = travel.notice ? `, ${travel.notice}` : "", by = hasLimits ? `nearest limit ${digits(100 * least, 3)} %` : `smallest singular value ${digits(least, 4)}`;
  const what = least === -Infinity ? "the robot cannot take this pose" : by;
  state.remark = `worst of ${count} poses of the workspace that this page sampled${where}: ${what}; not proved`;
};

/** Adds the button of the jump to the other ones. @param {State} state @param {(act: () => void) => void} change */
export const addJumps = (state, change) => {
  if (!state.data.travel) return;
  const button = make("button", { type: "button", id: "to-worst" }, "Worst pose of the workspace");
  button.addEventListener("click", () => change(() => goToWorst(state)));
  byId("to-next").after(button);
};
