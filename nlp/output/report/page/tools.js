"use strict";
// Plotly's camera for a box that fills its frame, in units that make the product of the sides 1.
/** @param {[number, number][]} ranges @param {Vector} eye @param {{ width: number, height: number }} frame @returns {Camera} */
const fittedCamera = (ranges, eye, frame) => {
  // Half of the angle of Plotly's perspective is 22.5 deg; ticks and titles need room, in pixels.
  const HALF = Math.tan(Math.PI / 8), SIDE = 72;
  const dot = (/** @type {Vector} */ a, /** @type {Vector} */ b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const unit = (/** @type {Vector} */ a) => a.map((each) => each / Math.hypot(...a));
  const sides = ranges.map(([low, high]) => high - low), mean = Math.cbrt(sides[0] * sides[1] * sides[2]);
  const half = sides.map((each) => each / mean / 2);
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => half.map((each, k) => ((n >> k) & 1 ? each : -each)));
  // Seen from above, the title of an axis is beyond the far edge.
  const TOP = eye[2] > 0.9 * Math.hypot(...eye) ? 64 : 36;
  const towards = unit(eye), right = unit(cross([0, 0, 1], towards)), up = cross(towards, right);
  const wide = Math.max(0.2, 1 - (2 * SIDE) / frame.width), high = Math.max(0.2, 1 - (2 * TOP) / frame.height);
  const shape = frame.width / frame.height;
  let centre = [0, 0, 0], far = 10;
  // In perspective, centre and distance depend on each other: iterate.
  for (let round = 0; round < 12; round += 1) {
    const from = corners.map((corner) => corner.map((each, k) => each - centre[k]));
    // The distance must bring every corner into the frame.
    far = Math.max(...from.map((each) => dot(each, towards) + Math.max(Math.abs(dot(each, right)) / (HALF * shape * wide), Math.abs(dot(each, up)) / (HALF * high))));
    const seen = from.map((each) => [right, up].map((way) => dot(each, way) / (far - dot(each, towards))));
    const middle = [0, 1].map((k) => (Math.min(...seen.map((each) => each[k])) + Math.max(...seen.map((each) => each[k]))) / 2);
    centre = centre.map((each, k) => each + far * (middle[0] * right[k] + middle[1] * up[k]));
  }
  const point = (/** @type {Vector} */ values) => ({ x: values[0], y: values[1], z: values[2] });
  return { eye: point(centre.map((each, k) => each + far * towards[k])), up: point([0, 0, 1]), center: point(centre), projection: { type: "perspective" } };
};

/** Element of the page. Where a page may be without it, the caller tests it.
 * @template {string} K @param {K} id @returns {K extends keyof Elements ? Elements[K] : HTMLElement} */
const byId = (id) => /** @type {any} */ (document.getElementById(id));
// Text of a case must not become markup in a tooltip, which interprets some tags.
/** @param {unknown} text */
const plain = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
/** @param {number} value @param {number} [digits] @param {boolean} [signed] */
const shown = (value, digits = 6, signed = false) => {
  const text = String(Number(value.toPrecision(digits)));
  return (signed && value > 0 ? "+" : "") + text.replace(/-/g, "\u2212");
};
/** @param {Vector} a @param {Vector} b @param {number} [factor] @returns {Vector} */
const plus = (a, b, factor = 1) => a.map((each, k) => each + factor * b[k]);
/** @param {Vector} a */
const norm = (a) => Math.hypot(...a);
/** @param {Vector} a @param {Vector} b @returns {Vector} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// Arrow heads as one mesh of cones, from tips, unit directions, and a common length.
/** @param {string} name @param {Vector[]} tips @param {Vector[]} directions @param {number} length @param {string} fill */
function heads(name, tips, directions, length, fill) {
  /** @type {number[][]} */
  const [x, y, z, i, j, k] = [[], [], [], [], [], []];
  const sides = 10;
  const add = (/** @type {Vector} */ point) => { x.push(point[0]); y.push(point[1]); z.push(point[2]); return x.length - 1; };
  tips.forEach((tip, n) => {
    const s = directions[n], other = Math.abs(s[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0];
    let a = cross(s, other);
    a = a.map((each) => each / norm(a));
    const b = cross(s, a), back = plus(tip, s, -length), top = add(tip), middle = add(back);
    /** @type {number[]} */
    const rim = [];
    for (let m = 0; m < sides; m += 1) {
      const angle = (2 * Math.PI * m) / sides;
      rim.push(add(plus(plus(back, a, 0.27 * length * Math.cos(angle)), b, 0.27 * length * Math.sin(angle))));
    }
    rim.forEach((at, m) => {
      const next = rim[(m + 1) % sides];
      i.push(top, middle); j.push(at, next); k.push(next, at);
    });
  });
  return { type: "mesh3d", name, x, y, z, i, j, k, color: fill, hoverinfo: "skip", flatshading: true, showlegend: false, lighting: { ambient: 0.85, diffuse: 0.4, specular: 0 } };
}

// Text from compressed bytes in base64; a browser without this function shows the page without the library.
/** @param {string} text */
const unpacked = (text) => {
  const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
};

const hasWebGL = () => {
  try {
    return Boolean(document.createElement("canvas").getContext("webgl"));
  } catch {
    return false;
  }
};

