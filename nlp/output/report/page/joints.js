// Groups of links with the same limb, kind, and row of the Jacobian that gives the colour.
/** @param {LinkData[]} links @returns {LinkData[][]} */
const groupedLinks = (links) => {
  /** @type {Map<string, LinkData[]>} */
  const found = new Map();
  for (const link of links) {
    if (link.limb === null || link.kind === "rail") continue;
    const key = JSON.stringify([link.limb, link.row, link.kind]);
    found.set(key, [...(found.get(key) ?? []), link]);
  }
  return [...found.values()];
};

// Symbols of joints, as in picture files: shape by kind, dark if actuated, strokes for axes.
/** @type {Record<JointData["kind"], [string, number]>} */
const LOOKS = { R: ["circle", 5], P: ["square", 7], H: ["cross", 6], C: ["square", 7], U: ["diamond", 6], S: ["circle", 7], Pa: ["circle", 3] };
/** @param {RobotData} view @param {Posture} frame @param {string} ink */
const jointTraces = (view, frame, ink) => {
  const dots = (/** @type {string} */ name, /** @type {Vector[]} */ places, /** @type {Style} */ marker, /** @type {Style} */ more = {}) => ({
    type: "scatter3d", mode: "markers", name, x: places.map((p) => p[0]), y: places.map((p) => p[1]), z: places.map((p) => p[2]),
    marker, hoverinfo: "skip", showlegend: false, ...more,
  });
  if (!view.joints.length) {
    const ends = [...new Set(view.links.filter((link) => link.limb !== null).flatMap((link) => link.ends))];
    return [dots("joints", ends.map((each) => frame.points[each]), { size: 5, color: "#fff", line: { color: ink, width: 2 } })];
  }
  /** @type {Style[]} */
  const found = [];
  /** @type {(number | null)[][]} */
  const ends = [[], [], []];
  view.joints.forEach(({ kind }, k) => {
    if (kind === "P" || kind === "Pa") return;
    const [place, ...axes] = frame.joints[k];
    for (const axis of axes) {
      for (const reach of [-0.06, 0.06]) plus(place, axis, reach * view.size).forEach((value, n) => ends[n].push(value));
      ends.forEach((each) => each.push(null));
    }
  });
  found.push({ type: "scatter3d", mode: "lines", name: "joint axes", x: ends[0], y: ends[1], z: ends[2], line: { color: ink, width: 3 }, hoverinfo: "skip", showlegend: false });
  for (const kind of new Set(view.joints.map((each) => each.kind))) {
    const own = view.joints.map((each, k) => /** @type {const} */ ([each, frame.joints[k][0]])).filter(([each]) => each.kind === kind), [symbol, size] = LOOKS[kind];
    found.push(dots(`joints ${kind}`, own.map(([, place]) => place), { symbol, size, color: own.map(([each]) => (each.actuated ? ink : "#fff")), line: { color: ink, width: 2 } }, {
      hoverinfo: "text", hovertext: own.map(([each]) => plain(each.words)),
    }));
    if (kind === "S" || kind === "C") found.push(dots(`joints ${kind} within`, own.map(([, place]) => place), { size: 2.5, color: ink }));
  }
  return found;
};


// Arrows of the load and of the actuators' forces, as in picture files: a pull begins with a dot, a moment has two heads.
/** @param {View} view @param {string} ink @returns {Style[]} */
const forceTraces = (view, ink) => view.forces.flatMap(({ kind, name, words, colour, ends: [start, end] }) => {
  const way = plus(end, start, -1), long = norm(way);
  if (!(long > 0)) return [];
  const reach = Math.min(0.08 * view.size, long), tips = kind === "moment" ? [end, plus(end, way, -0.75 * reach / long)] : [end];
  const steps = Array.from({ length: 9 }, (_, n) => plus(start, way, n / 8)), unit = way.map((each) => each / long);
  return [
    {
      type: "scatter3d", mode: kind === "pull" ? "lines+markers" : "lines", name: `${kind} ${name}`, x: steps.map((p) => p[0]), y: steps.map((p) => p[1]), z: steps.map((p) => p[2]),
      line: { color: colour, width: kind === "load" || kind === "moment" ? 8 : 6 }, marker: { size: steps.map((_, n) => (n ? 0.1 : 6)), color: colour }, showlegend: false,
      hoverinfo: "text", hovertext: steps.map(() => plain(words)), hoverlabel: { bgcolor: "#fff", bordercolor: ink, font: { color: ink, size: 13 } },
    },
    heads(`${kind} head ${name}`, tips, tips.map(() => unit), reach, colour),
  ];
});
