// 3-D view of a robot, for all pages: bodies, names of limbs, axes, and camera.
const INK = "#17212b", MUTED = "#55616c", FACES = { base: "#c3ccd5", platform: "#a9c6de" };
const FONT = "Arial, 'DejaVu Sans', sans-serif";
const CONFIG = { displaylogo: false, displayModeBar: false, responsive: true, scrollZoom: false };

// Polylines from lists of points, separated by gaps.
/** @param {string} name @param {Vector[][]} parts @param {Style} style @param {Style} [more] @returns {Style} */
const lines = (name, parts, style, more = {}) => {
  /** @type {(number | null)[][]} */
  const axes = [[], [], []];
  for (const part of parts) {
    for (const point of part) point.forEach((value, k) => axes[k].push(value));
    axes.forEach((axis) => axis.push(null));
  }
  return { type: "scatter3d", mode: "lines", name, x: axes[0], y: axes[1], z: axes[2], line: style, hoverinfo: "skip", showlegend: false, ...more };
};

// Faces of base and platform, rails, and edges that belong to no limb.
/** @param {RobotData} view @param {Vector[]} points */
const bodyTraces = (view, points) => {
  /** @type {Style[]} */
  const found = [];
  for (const body of /** @type {const} */ (["base", "platform"])) {
    const loop = view.plates[body];
    if (!loop) continue;
    const corners = loop.map((each) => points[each]);
    const middle = [0, 1, 2].map((k) => corners.reduce((sum, each) => sum + each[k], 0) / corners.length);
    const all = [...corners, middle], count = corners.length;
    found.push({
      type: "mesh3d", name: `${body} face`, x: all.map((p) => p[0]), y: all.map((p) => p[1]), z: all.map((p) => p[2]),
      i: corners.map((_, k) => k), j: corners.map((_, k) => (k + 1) % count), k: corners.map(() => count),
      color: FACES[body], opacity: 0.55, hoverinfo: "skip", showlegend: false, lighting: { ambient: 0.9, diffuse: 0.2, specular: 0 },
    });
  }
  const rails = view.links.filter((link) => link.kind === "rail");
  if (rails.length) found.push(lines("rails", rails.map((link) => link.ends.map((end) => points[end])), { color: "#8a949d", width: 6 }));
  const edges = view.links.filter((link) => link.limb === null && link.kind !== "rail");
  if (edges.length) found.push(lines("edges", edges.map((link) => link.ends.map((end) => points[end])), { color: MUTED, width: 4 }));
  return found;
};

// Name of each limb on its longest link.
/** @param {RobotData} view @param {Vector[]} points @param {boolean} isNarrow */
const limbNames = (view, points, isNarrow) => {
  /** @type {Map<string, { size: number, start: Vector, way: Vector }>} */
  const found = new Map();
  for (const { limb, kind, ends: [a, b] } of view.links) {
    if (limb === null || kind === "rail") continue;
    const way = plus(points[b], points[a], -1), long = norm(way);
    // Rods of several limbs meet at the platform: prefer a bar for the name.
    const size = long + (kind === "bar" ? 100 * view.size : 0);
    if (!((found.get(limb)?.size ?? -1) >= size)) found.set(limb, { size, start: points[a], way });
  }
  // Different heights, so that names of neighbouring limbs do not overlap.
  return [...found].map(([limb, { start, way }], k) => {
    const [x, y, z] = plus(start, way, 0.22 + (0.56 * ((k * 2.5) % found.size)) / found.size);
    return { x, y, z, text: (isNarrow ? "" : "limb ") + plain(limb), showarrow: false, xanchor: "center", bgcolor: "rgba(255,255,255,0.82)", borderpad: 1, font: { color: INK, size: 11 } };
  });
};

/** @param {[number, number][]} ranges @param {string} length @param {Camera} camera @returns {Layout} */
const sceneLayout = (ranges, length, camera) => {
  const unit = length ? `, ${plain(length)}` : "";
  const axis = (/** @type {string} */ name, /** @type {[number, number]} */ range) => ({ title: { text: name + unit }, range, autorange: false, backgroundcolor: "#f7f9fa", gridcolor: "#dde3e8", zerolinecolor: "#b9c1c9", showbackground: true, showspikes: false, nticks: 6, ticklen: 3, tickfont: { size: 11 } });
  const [x, y, z] = ranges;
  return {
    margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "#fff", font: { family: FONT, color: INK, size: 12 }, hovermode: "closest",
    scene: { aspectmode: "data", dragmode: "orbit", xaxis: axis("x", x), yaxis: axis("y", y), zaxis: axis("z", z), camera },
  };
};

/** @param {Camera} from @param {string | undefined} key @returns {Camera} */
const turnedCamera = (from, key) => {
  const { eye, center } = from, x = eye.x - center.x, y = eye.y - center.y, z = eye.z - center.z, far = Math.hypot(x, y, z);
  let round = Math.atan2(y, x), up = Math.asin(z / far), distance = far;
  if (key === "left") round -= Math.PI / 12;
  if (key === "right") round += Math.PI / 12;
  if (key === "up") up = Math.min(up + Math.PI / 18, 1.5);
  if (key === "down") up = Math.max(up - Math.PI / 18, -1.5);
  if (key === "in") distance /= 1.2;
  if (key === "out") distance *= 1.2;
  return { ...from, eye: { x: center.x + distance * Math.cos(up) * Math.cos(round), y: center.y + distance * Math.cos(up) * Math.sin(round), z: center.z + distance * Math.sin(up) } };
};

// Plotly takes half a second: it starts after text and tables are painted. Without it or WebGL, the drawing is fixed.
/** @param {() => Promise<void>} draw @param {() => void} giveUp @param {() => void} [end] */
const afterPaint = (draw, giveUp, end = () => {}) => requestAnimationFrame(() => setTimeout(async () => {
  try {
    const library = document.createElement("script");
    library.textContent = await unpacked(byId("plotly").textContent ?? "");
    document.head.append(library);
    await draw();
  } catch {
    giveUp();
    document.documentElement.classList.add("flat");
  }
  end();
  document.documentElement.dataset.drawn = "yes";
}, 0));
