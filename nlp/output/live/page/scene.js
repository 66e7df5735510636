// The robot as lines, faces and dots in space, in painting order, from the values of a module.
import { cross, norm, plus, unitOf, dot } from "./numbers.js";

/**
 * @typedef {import("./numbers.js").Vector} Vector
 * @typedef {{ right: Vector, up: Vector, towards: Vector }} Axes
 * @typedef {{ kind: "line" | "face" | "dot", points: Vector[], colour: string, width: number, depth: number,
 *   edge?: string, dash?: boolean, limb?: string, head?: boolean }} Piece
 * @typedef {{ points: Vector[], circles: Vector[][], joints: Vector[][], position: Vector }} Robot
 * @typedef {{ centre: Vector, axis: Vector, angle: number, isViolated: boolean }} Cone
 * @typedef {{ ends: [number, number], limb: string | null, body: string, kind: string, row: number | null }} LinkData
 */

/** Pieces of a line, which are sorted on their own. */
const PARTS = 6;
/** Names of the colours of rates and forces, from -1 to 1. */
const STOPS = ["mostNegative", "negative", "zero", "positive", "mostPositive"];

/** Colour of a value between -1 and 1; that of zero where there is no value. @param {number} part @param {Record<string, string>} colours of the form #rrggbb */
export const colourOf = (part, colours) => {
  const stops = STOPS.map((name) => [1, 3, 5].map((k) => parseInt(colours[name].slice(k, k + 2), 16)));
  const at = (Math.max(-1, Math.min(1, Number.isNaN(part) ? 0 : part)) + 1) * 2, low = Math.min(3, Math.floor(at)), share = at - low;
  return `rgb(${stops[low].map((each, k) => Math.round(each + share * (stops[low + 1][k] - each))).join(",")})`;
};

/** Directions to the right, upwards and to the viewer, from azimuth and elevation in degrees. @param {{ azimuth: number, elevation: number }} camera @returns {Axes} */
export const axesOf = ({ azimuth, elevation }) => {
  const a = (azimuth * Math.PI) / 180, e = (elevation * Math.PI) / 180;
  return {
    right: [-Math.sin(a), Math.cos(a), 0],
    up: [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)],
    towards: [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)],
  };
};

/** Points of the robot from the values of a view. @param {ArrayLike<number>} view @param {Record<string, [number, number]>} blocks @param {any} scene @returns {Robot} */
export const robotOf = (view, blocks, scene) => {
  const vectors = (/** @type {string} */ name) => {
    const [first, size] = blocks[name];
    /** @type {Vector[]} */
    const found = [];
    for (let k = first; k < first + size; k += 3) found.push([view[k], view[k + 1], view[k + 2]]);
    return found;
  };
  const all = vectors("joints"), circles = vectors("circles");
  let at = 0;
  const joints = scene.joints.map((/** @type {{ axes: number }} */ { axes }) => all.slice(at, (at += 1 + axes)));
  return { points: vectors("points"), circles: circles.map((_, k) => circles.slice(k, k + 3)).filter((_, k) => k % 3 === 0), joints, position: vectors("position")[0] };
};

/** Cones of joints with a limited angle. @param {ArrayLike<number>} view @param {any} data @param {(key: string, index: number) => { limit: number, isViolated: boolean } | null} look @returns {Cone[]} */
export const conesOf = (view, data, look) => {
  let at = data.blocks.cones[0];
  return data.cones.flatMap((/** @type {{ count: number, key: string, angle: number }} */ { count, key, angle }) =>
    Array.from({ length: count }, (_, k) => {
      const parts = Array.from({ length: 6 }, (_, i) => view[at + i]), own = look(key, k);
      at += 6;
      return { centre: /** @type {Vector} */ (parts.slice(0, 3)), axis: /** @type {Vector} */ (parts.slice(3)), angle: own ? own.limit : angle, isViolated: Boolean(own?.isViolated) };
    }),
  );
};

/** Straight line in pieces. @param {Piece[]} into @param {Vector} a @param {Vector} b @param {Partial<Piece> & { colour: string, width: number }} style @param {Axes} axes @param {number} [parts] */
const addLine = (into, a, b, style, axes, parts = PARTS) => {
  const way = plus(b, a, -1);
  for (let k = 0; k < parts; k += 1) {
    const points = [plus(a, way, k / parts), plus(a, way, (k + 1) / parts)];
    into.push({ kind: "line", points, depth: (dot(points[0], axes.towards) + dot(points[1], axes.towards)) / 2, ...style, head: style.head && k === parts - 1 });
  }
};

/** Circle or arc about an axis. @param {Vector} centre @param {Vector} axis @param {Vector} arm @param {number} turn @param {number} rise @param {number} count @returns {Vector[]} */
const arcOf = (centre, axis, arm, turn, rise, count) => {
  const side = cross(axis, arm);
  return Array.from({ length: count + 1 }, (_, k) => {
    const angle = (turn * k) / count;
    return plus(plus(plus(centre, arm, Math.cos(angle)), side, Math.sin(angle)), axis, rise * angle);
  });
};

/** Axis of a twist as its direction, its point next to the origin, and its pitch. @param {number[]} twist */
export const screwOf = (twist) => {
  const omega = /** @type {Vector} */ (twist.slice(0, 3)), v = /** @type {Vector} */ (twist.slice(3, 6));
  const square = dot(omega, omega);
  if (square <= 1e-24 * dot(v, v)) return { axis: unitOf(v), point: /** @type {Vector} */ ([0, 0, 0]), pitch: Infinity };
  const point = /** @type {Vector} */ (cross(omega, v).map((each) => each / square));
  return { axis: unitOf(omega), point, pitch: dot(omega, v) / square };
};

/** Ends of the drawn axis of a twist. @param {{ axis: Vector, point: Vector, pitch: number }} screw @param {Robot} robot @param {number} size @returns {Vector[]} */
const endsOf = ({ axis, point, pitch }, robot, size) => {
  if (pitch === Infinity) return [robot.position, plus(robot.position, axis, 0.7 * size)];
  const along = robot.points.map((each) => dot(plus(each, point, -1), axis));
  return [plus(point, axis, Math.min(...along) - 0.12 * size), plus(point, axis, Math.max(...along) + 0.3 * size)];
};

/** Points that a picture should contain. @param {Robot} robot @param {any} scene @param {number[] | null} twist @returns {Vector[]} */
export const extentOf = (robot, scene, twist) => {
  const round = robot.circles.flatMap(([centre, through, normal]) => arcOf(centre, unitOf(normal), plus(through, centre, -1), 2 * Math.PI, 0, 12));
  return [...robot.points, robot.position, ...round, ...(twist ? endsOf(screwOf(twist), robot, scene.size) : [])];
};

/** Pieces of the task's motion: axis with arrow, helix of its pitch, and velocities of the platform's corners. @param {Piece[]} into @param {number[]} twist @param {Robot} robot @param {any} scene @param {Axes} axes @param {Record<string, string>} colours */
const addMotion = (into, twist, robot, scene, axes, colours) => {
  const screw = screwOf(twist), { axis, pitch } = screw, { size } = scene;
  const [from, end] = endsOf(screw, robot, size);
  addLine(into, from, end, { colour: colours.ink, width: 2.5, head: true }, axes, 12);
  if (pitch !== Infinity) {
    const other = /** @type {Vector} */ (Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]);
    const arm = /** @type {Vector} */ (unitOf(cross(axis, other)).map((each) => each * 0.11 * size));
    const isFlat = Math.abs(pitch) <= 0.01 * 0.11 * size;
    const turn = isFlat ? 5.6 : Math.min(6 * Math.PI, (0.3 * size) / Math.abs(pitch));
    const rise = isFlat ? 0 : pitch;
    const path = arcOf(plus(end, axis, -0.12 * size - Math.abs(rise * turn)), axis, arm, turn, rise, 48);
    path.slice(1).forEach((to, k) => addLine(into, path[k], to, { colour: colours.purple, width: 2, head: k === path.length - 2 }, axes, 1));
  }
  const omega = /** @type {Vector} */ (twist.slice(0, 3)), v = /** @type {Vector} */ (twist.slice(3, 6));
  const corners = scene.corners.map((/** @type {number} */ k) => robot.points[k]);
  const speeds = corners.map((/** @type {Vector} */ each) => plus(v, cross(omega, each)));
  const most = Math.max(...speeds.map(norm), 1e-300);
  corners.forEach((/** @type {Vector} */ each, /** @type {number} */ k) => {
    if (norm(speeds[k]) > 0.02 * most) addLine(into, each, plus(each, speeds[k], (0.25 * size) / most), { colour: colours.purple, width: 1.8, head: true }, axes, 2);
  });
};

/**
 * All pieces in painting order.
 * @param {Robot} robot
 * @param {any} scene
 * @param {{ axes: Axes, colours: Record<string, string>, limbColour: (link: LinkData) => string, twist: number[] | null, cones?: Cone[], isFaint?: boolean }} how
 * @returns {Piece[]}
 */
export const piecesOf = (robot, scene, { axes, colours, limbColour, twist, cones = [], isFaint = false }) => {
  /** @type {Piece[]} */
  const found = [];
  const depth = (/** @type {Vector[]} */ points) => points.reduce((sum, each) => sum + dot(each, axes.towards), 0) / points.length;
  for (const [body, loop] of Object.entries(scene.plates)) {
    const points = /** @type {number[]} */ (loop).map((k) => robot.points[k]);
    if (points.length) found.push({ kind: "face", points, colour: colours[`${body}Face`], edge: colours[`${body}Edge`], width: 1.6, depth: depth(points) - 0.02 * scene.size });
  }
  for (const [centre, through, normal] of robot.circles) {
    const arm = plus(through, centre, -1), path = arcOf(centre, unitOf(normal), arm, 2 * Math.PI, 0, 40);
    path.slice(1).forEach((to, k) => addLine(found, path[k], to, { colour: colours.line, width: 1.2 }, axes, 1));
  }
  for (const link of /** @type {LinkData[]} */ (scene.links)) {
    const [a, b] = link.ends.map((k) => robot.points[k]);
    if (link.kind === "rail") addLine(found, a, b, { colour: colours.rail, width: 7 }, axes);
    else if (link.limb === null) addLine(found, a, b, { colour: link.body === "platform" ? colours.platformEdge : colours.baseEdge, width: 2.4 }, axes);
    else addLine(found, a, b, { colour: isFaint ? colours.line : limbColour(link), width: link.kind === "rod" ? 3.4 : 5.5, limb: link.limb }, axes);
  }
  robot.joints.forEach((vectors, k) => {
    const [place, ...directions] = vectors, { actuated } = scene.joints[k];
    const colour = actuated ? colours.ink : colours.joint;
    for (const axis of directions) {
      if (!norm(axis)) continue;
      const half = 0.035 * scene.size, unit = unitOf(axis);
      addLine(found, plus(place, unit, -half), plus(place, unit, half), { colour, width: actuated ? 7 : 4 }, axes, 1);
    }
    if (!directions.length) found.push({ kind: "dot", points: [place], colour, width: 4, depth: depth([place]) + 0.01 * scene.size });
  });
  if (!robot.joints.length) {
    const ends = new Set(/** @type {LinkData[]} */ (scene.links).filter((each) => each.limb !== null).flatMap((each) => each.ends));
    for (const k of ends) found.push({ kind: "dot", points: [robot.points[k]], colour: colours.joint, width: 4.2, depth: depth([robot.points[k]]) + 0.02 * scene.size });
  }
  for (const { centre, axis, angle, isViolated } of cones) {
    // A circle about the axis at a fixed distance along the cone, and four lines to its tip.
    const long = 0.13 * scene.size, unit = unitOf(axis), other = /** @type {Vector} */ (Math.abs(unit[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]);
    const arm = /** @type {Vector} */ (unitOf(cross(unit, other)).map((each) => each * long * Math.sin(angle)));
    const path = arcOf(plus(centre, unit, long * Math.cos(angle)), unit, arm, 2 * Math.PI, 0, 24), style = { colour: isViolated ? colours.bad : colours.cone, width: isViolated ? 2 : 1 };
    path.slice(1).forEach((to, k) => addLine(found, path[k], to, style, axes, 1));
    for (let k = 0; k < 24; k += 6) addLine(found, centre, path[k], style, axes, 1);
  }
  if (twist) addMotion(found, twist, robot, scene, axes, colours);
  return found.filter((each) => each.points.every((point) => point.every(Number.isFinite))).sort((a, b) => a.depth - b.depth);
};
