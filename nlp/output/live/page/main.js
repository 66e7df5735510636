// The live page: loads the module, and shows the state after each change.
import { CaseModule } from "./module.js";
import { measuredSide } from "./limits.js";
import { State } from "./state.js";
import { argumentsOf, caseFileOf, fragmentOf, takeFragment, unpack } from "./text.js";
import { axesOf, colourOf, conesOf, extentOf, piecesOf, robotOf } from "./scene.js";
import { Picture } from "./canvas.js";
import { Sliders, byId, make, showValues } from "./panel.js";
import { TaskSliders } from "./tasks.js";
import { LimitBars, showActuators } from "./bars.js";
import { addJumps } from "./jumps.js";
import { ValueMap } from "./map.js";
import { Player } from "./play.js";
import { Track } from "./track.js";
import { plus } from "./numbers.js";

const data = JSON.parse(byId("data").textContent ?? "{}");
/** @type {State | null} */
let state = null;
const colours = () => {
  const style = getComputedStyle(document.documentElement), get = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
  return { ink: get("ink"), muted: get("muted"), line: get("line"), halo: get("back"), purple: get("purple"), rail: get("rail"), joint: get("joint"), baseFace: get("base-face"), platformFace: get("platform-face"), baseEdge: get("base-edge"), platformEdge: get("platform-edge"), bad: get("bad"), cone: get("cone"), mostNegative: get("most-negative"), negative: get("negative"), zero: get("zero"), positive: get("positive"), mostPositive: get("most-positive") };
};
let palette = colours();
const picture = new Picture(/** @type {HTMLCanvasElement} */ (byId("robot")), data.camera, () => draw());
let isWaiting = false;

/** Value of each limb for its colour, relative to the largest. @param {ArrayLike<number>} view */
const limbValues = (view) => {
  const choice = /** @type {HTMLSelectElement} */ (byId("colour")).value, [kind, index] = choice.split(" ");
  /** @type {Map<string, number>} */
  const found = new Map();
  const take = (/** @type {string} */ limb, /** @type {number} */ value) => {
    if (Number.isFinite(value) && !(Math.abs(found.get(limb) ?? 0) > Math.abs(value))) found.set(limb, value);
  };
  if (kind === "force") {
    const count = data.actuators.length;
    data.actuators.forEach((/** @type {any} */ each, /** @type {number} */ k) => {
      const [high, low] = ["largest", "smallest"].map((name) => view[data.blocks[name][0] + Number(index) * count + k]);
      take(each.limb, Math.abs(high) >= Math.abs(low) ? high : low);
    });
  } else {
    // The robot of a task has the rates of this task only.
    const [first] = data.blocks.rates, tasks = data.pose_tasks.length ? 1 : data.tasks.length;
    data.row_limbs.forEach((/** @type {string} */ limb, /** @type {number} */ k) => take(limb, view[first + k * tasks + Number(index)]));
  }
  const most = Math.max(...[...found.values()].map(Math.abs), 1e-300);
  return { found, part: (/** @type {string | null} */ limb) => (found.get(limb ?? "") ?? 0) / most };
};

/** Half angle of a joint's cone, and whether its limit is violated there at the shown pose. @param {string} key @param {number} index */
const coneLimit = (key, index) => {
  if (!state) return null;
  const own = state.sides.filter((each) => each.key === key), count = own.length / data.poses;
  const side = own[state.pose * count + index];
  if (!side) return null;
  const { limit, margin } = measuredSide(state.module, side);
  return { limit, isViolated: margin < -1e-6 };
};

const draw = () => {
  const view = player?.view ?? (state ? state.module.arrays.view : data.view);
  const robot = robotOf(view, data.blocks, data.scene), values = limbValues(view);
  const p = state ? state.module.arrays.p : data.p;
  const coloured = Number(/** @type {HTMLSelectElement} */ (byId("colour")).value.startsWith("rate") ? /** @type {HTMLSelectElement} */ (byId("colour")).value.split(" ")[1] : 0);
  const task = data.pose_tasks[state?.pose ?? 0] ?? coloured;
  const twist = data.is_stated && (!track || track.schedule) ? [...p.slice(data.tasks[task].twist, data.tasks[task].twist + 6)] : null;
  const axes = axesOf(picture.camera);
  if (!picture.fitted.length) picture.fitted = [...extentOf(robot, data.scene, twist), ...(track?.way ?? [])];
  const pieces = piecesOf(robot, data.scene, { axes, colours: palette, limbColour: (link) => colourOf(values.part(link.limb), palette), twist, cones: conesOf(view, data, coneLimit) });
  if (track) pieces.push(...track.pieces(axes, palette)), pieces.sort((a, b) => a.depth - b.depth);
  /** @type {Map<string, { text: string, at: any }>} */
  const labels = new Map();
  for (const link of data.scene.links) {
    if (link.limb === null || link.kind === "rail" || labels.has(link.limb)) continue;
    const [a, b] = link.ends.map((/** @type {number} */ k) => robot.points[k]);
    labels.set(link.limb, { text: link.limb, at: plus(a, plus(b, a, -1), 0.3) });
  }
  picture.draw(pieces, [...labels.values()], palette);
  document.documentElement.dataset.drawn = "yes";
};

/** Shows the state: values, limits, picture. */
const show = () => {
  if (state) {
    sliders?.refresh();
    fields?.refresh();
    showValues(state, bars?.refresh() ?? [], track?.schedule?.headline() ?? null);
    showActuators(state);
    map?.refresh();
    track?.refresh();
    const isEvaluated = state.mode === "evaluate";
    byId("mode-solve").setAttribute("aria-pressed", String(!isEvaluated));
    byId("mode-evaluate").setAttribute("aria-pressed", String(isEvaluated));
  }
  draw();
};
/** @type {Sliders | undefined} */
let sliders;
/** @type {ValueMap | undefined} */
let map;
/** @type {TaskSliders | undefined} */
let fields;
/** @type {LimitBars | undefined} */
let bars;
/** @type {Player | undefined} */
let player;
/** @type {Track | undefined} */
let track;
/** @type {Map<any, () => void>} */
const pending = new Map();
/**
 * Runs a change before the next frame, and shows it. Of several changes with one key, only the last one runs.
 * @param {() => void} act
 * @param {any} [key]
 */
const change = (act, key = Symbol("change")) => {
  // Any other change ends a motion, at the pose where it began.
  if (key !== player) player?.stop();
  pending.set(key, act);
  if (isWaiting) return;
  isWaiting = true;
  requestAnimationFrame(() => {
    isWaiting = false;
    const acts = [...pending.values()];
    pending.clear();
    for (const each of acts) each();
    show();
  });
};

/** @param {string} text @param {string} words */
const copy = async (text, words) => {
  const area = /** @type {HTMLTextAreaElement} */ (byId("copied-text"));
  area.value = text;
  byId("copied").hidden = false;
  byId("copied-words").textContent = words;
  try {
    await navigator.clipboard.writeText(text);
    byId("copied-words").textContent = `${words}, copied`;
  } catch {
    area.focus();
    area.select();
  }
};

/** Whether a point is in a polygon, or near one of its corners. @param {number} x @param {number} y @param {number[][]} corners */
const isOn = (x, y, corners) => {
  let isIn = false;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay > y !== by > y && x < ax + ((y - ay) * (bx - ax)) / (by - ay)) isIn = !isIn;
  });
  return isIn || corners.some(([ax, ay]) => Math.hypot(x - ax, y - ay) < 14);
};

/** Takes hold of the platform at a point of the picture. @type {NonNullable<Picture["grab"]>} */
const grab = (x, y, turns) => {
  if (!state) return null;
  const own = state, { place, axes } = picture.last;
  const robot = robotOf(own.module.arrays.view, data.blocks, data.scene);
  const corners = (data.scene.plates.platform ?? data.scene.corners).map((/** @type {number} */ k) => place(robot.points[k]));
  if (!isOn(x, y, [...corners]) && Math.hypot(...place(robot.position).map((each, k) => each - [x, y][k])) > 16) return null;
  const from = own.rotation();
  if (turns && from.length) {
    const size = data.scene.size;
    return (across, up, twist = 0) => change(() => own.turn(from, [0, 1, 2].map((k) => (axes.up[k] * across - axes.right[k] * up) / (0.6 * size) + axes.towards[k] * twist)), "grab");
  }
  const begin = own.positions().map((slider) => (slider ? own.module.arrays[slider.vector][slider.index] : 0));
  return (across, up) => change(() => own.place(begin.map((each, k) => each + axes.right[k] * across + axes.up[k] * up)), "grab");
};

const listen = () => {
  picture.grab = grab;
  const on = (/** @type {string} */ id, /** @type {() => void} */ act) => byId(id).addEventListener("click", act);
  const live = () => /** @type {State} */ (state);
  on("mode-solve", () => change(() => live().setMode("solve")));
  on("mode-evaluate", () => change(() => live().setMode("evaluate")));
  on("to-answer", () => change(() => live().jump("answer")));
  on("to-start", () => change(() => live().jump("start")));
  on("to-next", () => change(() => live().jump("next")));
  on("free-all", () => change(() => {
    live().held.clear();
    live().update(null);
  }));
  on("copy-set", () => copy(`screwsynth evaluate ${data.command} ${argumentsOf(live())}`, "Command"));
  on("copy-case", () => copy(caseFileOf(live()), "Case file"));
  on("copy-link", () => copy(`${location.href.split("#")[0]}${track?.schedule?.fragment() ?? fragmentOf(live())}`, "Link"));
  byId("copy-case").hidden = !data.case_parts.length;
  globalThis.addEventListener("hashchange", () => change(() => {
    takeFragment(live(), location.hash);
    track?.take(location.hash);
  }));
};

byId("colour").addEventListener("change", draw);
// Both buttons stay on one line.
const buttons = make("span", { class: "together" });
byId("view-reset").before(buttons);
buttons.append(byId("view-reset"), byId("view-fit"));
byId("view-reset").addEventListener("click", () => picture.reset());
byId("view-fit").addEventListener("click", () => {
  picture.fitted = [];
  picture.camera.zoom = 1;
  draw();
});
globalThis.addEventListener("resize", () => requestAnimationFrame(draw));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  palette = colours();
  draw();
});
const poseChoice = /** @type {HTMLSelectElement | null} */ (document.getElementById("pose"));
poseChoice?.addEventListener("change", () => change(() => {
  if (!state) return;
  state.pose = Number(poseChoice.value);
  state.look();
}));

// Texts that the program wrote get the minus signs of the page.
for (const each of document.querySelectorAll("#stated-task p, #F, #task-values li")) each.textContent = (each.textContent ?? "").replace(/(^|[\s(,=])-(?=[\d.])/g, "$1\u2212");
document.documentElement.classList.toggle("still", !data.has_module);
show();
if (data.has_module) {
  const loaded = await CaseModule.load(await unpack(byId("module").textContent ?? ""), data.arrays);
  state = new State(loaded, data);
  if (location.hash.length > 1) takeFragment(state, location.hash);
  sliders = new Sliders(state, change);
  bars = new LimitBars(state, change);
  fields = new TaskSliders(state, change);
  map = new ValueMap(state, change);
  addJumps(state, change);
  player = new Player(state, data, change);
  listen();
  if (data.track) {
    track = new Track(state, data.track, change, copy);
    track.take(location.hash);
    // The pose is that of the path, and the picture contains the path.
    picture.grab = null;
    picture.fitted = [];
  }
  document.documentElement.classList.add("live");
  document.documentElement.classList.toggle("no-slopes", !data.has_slopes);
  Object.assign(globalThis, { screwsynth: { state, show, player, track, place: () => picture.last.place(robotOf(loaded.arrays.view, data.blocks, data.scene).position) } });
  show();
} else {
  player = new Player(null, data, change);
}
document.documentElement.dataset.ready = "yes";
