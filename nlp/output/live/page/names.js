// Names of limits and turns in words, for people who have not read the case file.
import { digits, measured, settled } from "./numbers.js";

/** Words of limits whose key alone does not say what is measured. */
const WORDS = /** @type {Record<string, string>} */ ({
  "angle": "angle of the rotation",
  "joint_spacing": "distance between joints",
  "footprint.base": "circle of the base joints, radius",
  "footprint.platform": "circle of the platform joints, radius",
  "leg_length": "length of legs",
  "base_joint_angle": "angle of base joints",
  "platform_joint_angle": "angle of platform joints",
  "leg_clearance": "distance between legs",
  "rate_share": "largest share of a limb in F",
  "condition_number": "condition number of J",
  "singular_value": "smallest singular value of J",
  "actuator_force": "force of actuators",
  "actuator_speed": "speed of actuators",
  "actuator_angle": "angle of actuators",
});

/** Name of a limit from its key below `limits`. @param {string} key */
export const limitName = (key) => {
  const name = key.replace(/\.(min|max)$/, "");
  if (WORDS[name]) return WORDS[name];
  const [first, ...rest] = name.split("."), words = (WORDS[first] ?? first).replace(/_/g, " ");
  return rest.length ? `${words}: ${rest.join(", ").replace(/_/g, " ")}` : words;
};

/** A rotation as words: angle and axis. @param {{ axis: number[], angle: number }} turn @param {string} unit */
export const turnWords = ({ axis, angle }, unit) => {
  const own = settled(angle, 180);
  if (own === 0) return "none";
  const along = axis.findIndex((each) => Math.abs(Math.abs(each) - 1) < 1e-9);
  const about = along >= 0 ? `${axis[along] < 0 ? "\u2212" : ""}${"xyz"[along]}` : `(${axis.map((part) => digits(settled(part, 1), 4)).join(", ")})`;
  return `${measured(own, unit)} about ${about}`;
};
