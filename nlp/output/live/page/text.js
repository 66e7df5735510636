// The state of a page as arguments of the command line, as a case file, and as the fragment of an address.

/**
 * @typedef {import("./state.js").State} State
 * @typedef {import("./state.js").Slider} Slider
 */

/** Bytes from base64, unpacked. @param {string} text */
export const unpack = (text) => {
  const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
};

/** Axis and angle in the case's unit of each rotation with a free axis. @param {State} state */
export const rotationsOf = (state) => {
  const factor = state.data.units.angle === "deg" ? 180 / Math.PI : 1;
  return state.data.rotations.map((/** @type {{ prefix: string, q: number[] }} */ { prefix, q }) => {
    const parts = q.map((index) => state.module.arrays.x[index]);
    const sine = Math.hypot(...parts);
    const axis = sine > 0 ? parts.map((each) => each / sine) : [0, 0, 1];
    return { prefix, axis, angle: 2 * Math.asin(Math.min(1, sine)) * factor };
  });
};

/** Settings that state the point: names and values of `--set`. @param {State} state @returns {[string, string][]} */
export const settingsOf = (state) => {
  /** @type {[string, string][]} */
  const found = [];
  for (const slider of state.sliders) {
    if (slider.set && (slider.vector === "x" || !isStart(state, slider))) found.push([slider.set, String(state.read(slider))]);
  }
  for (const { prefix, axis, angle } of rotationsOf(state)) {
    found.push([`${prefix}axis`, axis.join(",")], [`${prefix}angle`, String(angle)]);
  }
  found.push(...taskSettings(state, false));
  state.limits.forEach((limit, k) => {
    const value = state.module.arrays.limits[k];
    if (value !== limit.value && limit.key.includes(".") && !limit.key.startsWith("angle")) {
      found.push([`limits.${limit.key}`, String(value * limit.factor)]);
    }
  });
  return found;
};

/** Names and values of the tasks, all or the changed ones. @param {State} state @param {boolean} all @returns {[string, string][]} */
const taskSettings = (state, all) => {
  const stated = state.statedTasks(), { weights } = state;
  // Weights are relative, so one changed weight states all.
  const weighed = weights.length && (all || state.statedWeights().some((each, k) => each !== weights[k])) ? weights.map((each, k) => /** @type {[string, string]} */ ([`task[${k}].weight`, String(each)])) : [];
  return [...weighed, ...state.tasks.flatMap((task, k) =>
    /** @type {const} */ (["axis", "point", "pitch"])
      .filter((key) => state.data.stated_tasks[k][key] !== undefined && (all || String(task[key]) !== String(stated[k][key])))
      .map((key) => /** @type {[string, string]} */ ([`task[${k}].${key}`, key === "pitch" ? infinite(task.pitch) : task[key].join(",")])),
  )];
};
/** @param {number} value */
const infinite = (value) => (value === Infinity ? "inf" : String(value));

/** @param {State} state @param {Slider} slider */
const isStart = (state, slider) => state.module.arrays[slider.vector][slider.index] === slider.start;

/** Arguments of the command line. @param {State} state */
export const argumentsOf = (state) =>
  settingsOf(state).map(([name, value]) => `--set ${/^[\w.,+-]+$/.test(`${name}${value}`) ? `${name}=${value}` : `'${name}=${value}'`}`).join(" ");

/** Case file with the point in place of the variables; empty where no case file can state it. @param {State} state */
export const caseFileOf = (state) => {
  if (!state.data.case_parts) return "";
  const values = new Map(settingsOf(state).map(([name, value]) => [name, value]));
  for (const slider of state.sliders) if (slider.set) values.set(slider.set, String(state.read(slider)));
  // The weights of the case are scaled in the module, so only changed ones take the place of the stated ones.
  for (const [name, value] of taskSettings(state, true)) if (!name.endsWith(".weight")) values.set(name, value);
  state.limits.forEach((limit, k) => values.set(`limits.${limit.key}`, String(state.module.arrays.limits[k] * limit.factor)));
  return state.data.case_parts
    .map((/** @type {string | { set: string, stated?: string }} */ part) => (typeof part === "string" ? part : tomlNumber(values.get(part.set) ?? part.stated ?? "0", part.set)))
    .join("");
};

/** @param {string} text @param {string} name */
const tomlNumber = (text, name) => (name.endsWith("axis") || name.endsWith(".point") ? `[${text.split(",").map(whole).join(", ")}]` : whole(text));
/** A number of TOML: with a digit on both sides of a point, and a sign of an exponent. @param {string} text */
const whole = (text) => text.replace(/^(-?\d+)e/, "$1.0e");

/** Fragment of an address with the whole state. @param {State} state */
export const fragmentOf = (state) => {
  const parts = new URLSearchParams();
  for (const slider of state.sliders) parts.set(slider.name, String(state.read(slider)));
  for (const [name, value] of taskSettings(state, false)) parts.set(name, value);
  const held = state.sliders.filter((each) => each.vector === "x" && state.held.has(each.index));
  if (held.length) parts.set("held", held.map((each) => each.name).join(" "));
  if (state.mode === "evaluate") parts.set("mode", "evaluate");
  state.limits.forEach((limit, k) => {
    const value = state.module.arrays.limits[k];
    if (value !== limit.value) parts.set(`limits.${limit.key}`, String(value * limit.factor));
  });
  return `#${parts}`;
};

/** Takes a state from a fragment; false where it has none. Only finite numbers of known names are read. @param {State} state @param {string} fragment */
export const takeFragment = (state, fragment) => {
  const parts = new URLSearchParams(fragment.replace(/^#/, ""));
  const { arrays } = state.module;
  let isFound = false;
  const finite = (/** @type {string | null} */ text) => (text !== null && text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : null);
  state.limits.forEach((limit, k) => {
    const shown = finite(parts.get(`limits.${limit.key}`));
    if (shown !== null && state.setLimit(k, shown)) isFound = true;
  });
  for (const [name] of taskSettings(state, true)) {
    const [, index, key] = /** @type {RegExpExecArray} */ (/^task\[(\d+)\]\.(axis|point|pitch|weight)$/.exec(name));
    if (key === "weight") {
      const weight = finite(parts.get(name));
      if (weight !== null) isFound = state.setWeight(Number(index), weight) || isFound;
      continue;
    }
    const values = (parts.get(name) ?? "").split(",").filter(Boolean);
    const isWhole = values.length === (key === "pitch" ? 1 : 3);
    if (isWhole) values.forEach((text, k) => (isFound = state.setTask(Number(index), /** @type {any} */ (key), k, text === "inf" ? Infinity : Number(text)) || isFound));
  }
  for (const slider of state.sliders) {
    const shown = finite(parts.get(slider.name));
    if (shown === null) continue;
    const value = state.inside(slider, shown);
    arrays[slider.vector][slider.index] = slider.vector === "x" ? Math.max(slider.low, Math.min(slider.high, value)) : value;
    isFound = true;
  }
  if (!isFound) return false;
  const held = (parts.get("held") ?? "").split(" ");
  for (const slider of state.sliders) if (slider.vector === "x" && held.includes(slider.name)) state.held.add(slider.index);
  state.mode = parts.get("mode") === "evaluate" ? "evaluate" : "solve";
  state.close(null);
  state.look();
  return true;
};
