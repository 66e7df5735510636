(() => {
  /** @type {ReportData} */
  const data = JSON.parse(byId("data").textContent ?? "");
  // The rates of a free motion are rounding errors, and shown as 0.
  for (const frame of data.views.flatMap((each) => each.frames)) {
    frame.rates = frame.rates.map((rate) => (Math.abs(rate) > frame.noise ? rate : 0));
    if (frame.rates.every((rate) => rate === 0)) frame.F = 0;
  }
  document.documentElement.classList.add("scripted");
  const VELOCITY = "#6d2a8c", FREE = "#0b6b57";

  // A page without a view has none of the elements that call functions with a view.
  let view = data.views[0];
  let index = view ? view.zero : 0;
  /** @type {Layout | null} */
  let layout = null;
  // Until the platform is moved, the box encloses only the posture of the design.
  let isMoved = false;

  // Colours and bars have the scale of the shown pose, as in picture files.
  const largest = () => Math.max(...view.frames[index].rates.map(Math.abs)) || 1;

  /** @param {number} rate */
  function colour(rate) {
    const colours = view.colours, last = colours.length - 1;
    const place = Math.min(Math.max((rate / largest() + 1) / 2, 0), 1) * last;
    const k = Math.min(Math.floor(place), last - 1), part = place - k;
    const mixed = [1, 3, 5].map((at) => {
      const [a, b] = [colours[k], colours[k + 1]].map((each) => parseInt(each.slice(at, at + 2), 16));
      return Math.round(a + part * (b - a));
    });
    return `rgb(${mixed.join(",")})`;
  }

  /** @param {Frame} frame @param {string | null} limb */
  function limbText(frame, limb) {
    const rows = view.rows.map((row, k) => /** @type {const} */ ([row, k])).filter(([row]) => row.limb === limb);
    const text = [`<b>limb ${plain(limb)}</b>`];
    const length = rows.length ? frame.lengths[rows[0][1]] : null;
    if (length !== null) text.push(`${view.measure.words} ${shown(length, 5)} ${plain(view.measure.units[rows[0][1]])}`);
    for (const [row, k] of rows) {
      const rate = frame.rates[k], share = frame.F > 0 ? `${(100 * rate * rate / frame.F).toFixed(1)} % of F` : "no share of F";
      const wrench = frame.jacobian[k].map((value) => shown(Math.abs(value) < 1e-12 ? 0 : value));
      text.push(`${row.member === limb ? "" : `${plain(row.member)}, `}${row.kind}: ${view.rate_word} ${shown(rate, 6, true)} ${plain(view.rate_unit)}, ${share}`);
      text.push(`wrench (${wrench.slice(0, 3).join(", ")}; ${wrench.slice(3).join(", ")})`);
    }
    return text.join("<br>");
  }

  /** @param {Frame} frame */
  function traces(frame) {
    /** @type {Style[]} */
    const found = [];
    const size = view.size, points = frame.points;
    const { reference, motion } = view;
    if (reference) {
      found.push(lines("start", view.links.map((link) => link.ends.map((end) => reference[end])), { color: "#8b959e", width: 2, dash: "dot" }));
    }
    found.push(...bodyTraces(view, points));
    if (motion) {
      found.push(lines("axis", [motion.line], { color: INK, width: 9 }));
      const along = plus(motion.line[1], motion.line[0], -1), unit = along.map((each) => each / norm(along));
      found.push(heads("axis head", [plus(motion.line[1], unit, 0.06 * size)], [unit], 0.11 * size, INK));
      const path = motion.path;
      if (path.length > 2) {
        found.push(lines("path", [path], { color: VELOCITY, width: 5 }));
        const last = path[path.length - 1], step = plus(last, path[path.length - 2], -1);
        found.push(heads("path head", [plus(last, step, 0.05 * size / norm(step))], [step.map((each) => each / norm(step))], 0.08 * size, VELOCITY));
      }
    }
    view.free.forEach((each) => found.push(lines("free motion", [each.line], { color: FREE, width: 5, dash: "dash" })));
    for (const own of groupedLinks(view.links)) {
      const { limb, row, kind } = own[0];
      // Points along the limb, so that its whole length shows the tooltip.
      const parts = own.map(({ ends: [a, b] }) => Array.from({ length: 13 }, (_, n) => plus(points[a], plus(points[b], points[a], -1), n / 12)));
      const text = limbText(frame, limb);
      found.push(lines(`limb ${limb}`, parts, { color: row === null ? MUTED : colour(frame.rates[row]), width: kind === "rod" ? 7 : 12 }, {
        hoverinfo: "text", hovertext: parts.flatMap((part) => [...part.map(() => text), text]), hoverlabel: { align: "left", bgcolor: "#fff", bordercolor: INK, font: { color: INK, size: 13 } },
      }));
    }
    found.push(...jointTraces(view, frame, INK));
    const factor = speedScale();
    if (factor > 0) {
      /** @type {Vector[][]} */
      const [starts, tips, ways] = [[], [], []];
      frame.velocities.forEach((velocity, k) => {
        const speed = norm(velocity);
        if (speed * factor < 1e-6 * size) return;
        const start = points[view.corners[k]];
        starts.push(start); tips.push(plus(start, velocity, factor)); ways.push(velocity.map((each) => each / speed));
      });
      found.push(lines("velocities", starts.map((start, k) => [start, tips[k]]), { color: VELOCITY, width: 4 }));
      found.push(heads("velocity heads", tips, ways, 0.075 * size, VELOCITY));
    }
    view.rows.forEach((row, k) => {
      if (row.kind !== "couple" || row.at === null) return;
      const moment = frame.jacobian[k].slice(3), way = moment.map((each) => each / norm(moment)), start = points[row.at];
      const tip = plus(start, way, 0.24 * size);
      found.push(lines(`couple ${row.limb}`, [[start, tip]], { color: colour(frame.rates[k]), width: 6 }));
      found.push(heads(`couple heads ${row.limb}`, [tip, plus(tip, way, -0.06 * size)], [way, way], 0.07 * size, colour(frame.rates[k])));
    });
    // Forces are computed for the pose of the design only.
    if (index === view.zero) found.push(...forceTraces(view, INK));
    if (view.rows.length) {
      const top = largest();
      found.push({
        type: "scatter3d", mode: "markers", name: "scale", x: [points[0][0]], y: [points[0][1]], z: [points[0][2]], hoverinfo: "skip", showlegend: false,
        marker: { size: 0.1, opacity: 0, color: [0], cmin: -top, cmax: top, colorscale: view.colours.map((each, k) => [k / (view.colours.length - 1), each]),
          showscale: byId("view").clientWidth > 620, colorbar: { exponentformat: "e", x: 0.99, xanchor: "right", title: { text: `${view.rate_word}, ${plain(view.rate_unit)}`, side: "right" }, thickness: 14, len: 0.7 } },
      });
    }
    return found;
  }

  // Length of an arrow for a velocity of 1; 0 without motion.
  function speedScale() {
    const fastest = Math.max(0, ...view.frames[view.zero].velocities.map(norm));
    return fastest > 1e-9 * view.size ? (0.42 * view.size) / fastest : 0;
  }

  /** @returns {[number, number][]} */
  function ranges() {
    const shownFrames = isMoved ? view.frames : [view.frames[view.zero]], every = shownFrames.flatMap((frame) => frame.points);
    // Plotly does not draw outside of the box, so it must enclose the arrows too.
    const factor = speedScale();
    for (const frame of shownFrames) {
      frame.velocities.forEach((velocity, k) => every.push(plus(frame.points[view.corners[k]], velocity, factor)));
      view.rows.forEach((row, k) => {
        if (row.kind !== "couple" || row.at === null) return;
        const moment = frame.jacobian[k].slice(3);
        every.push(plus(frame.points[row.at], moment, 0.24 * view.size / norm(moment)));
      });
    }
    every.push(...view.forces.flatMap((each) => each.ends));
    if (view.reference) every.push(...view.reference);
    if (view.motion) every.push(...view.motion.line, ...view.motion.path);
    const room = 0.08 * view.size;
    return [0, 1, 2].map((k) => [Math.min(...every.map((p) => p[k])) - room, Math.max(...every.map((p) => p[k])) + room]);
  }

  const newLayout = () => sceneLayout(ranges(), view.unit, camera());

  // Clearest view, as near as the box with its ticks stays visible.
  const camera = () => fittedCamera(ranges(), view.eye, { width: byId("view").clientWidth, height: byId("view").clientHeight });

  function draw() {
    if (!view || !window.Plotly || !layout) return null;
    keep();
    layout.scene.annotations = limbNames(view, view.frames[index].points, byId("view").clientWidth < 480);
    return window.Plotly.react(byId("view"), traces(view.frames[index]), layout, CONFIG);
  }

  // The copy for printing is updated when the picture has not changed for a while.
  let later = 0;
  function keep() {
    clearTimeout(later);
    later = setTimeout(async () => {
      if (!window.Plotly) return;
      byId("view-copy").src = await window.Plotly.toImage(byId("view"), { format: "png", width: 1000, height: 560 });
      document.documentElement.dataset.copied = "yes";
    }, 700);
  }

  // Numbers of a column are aligned at the decimal point, as tables.py does it: digits before it have one width.
  /** @param {string} name @param {string[]} texts */
  function writeColumn(name, texts) {
    const SIGN = 1.35, parts = texts.map((each) => /^([+\u2212]?)(\d+)(.*)$/.exec(each));
    const width = Math.max(0, ...parts.map((each) => (each ? each[2].length : 0))) + (parts.some((each) => each && each[1]) ? SIGN : 0);
    document.querySelectorAll(`#rates tbody .${name}`).forEach((cell, k) => {
      const found = parts[k];
      if (!found) {
        cell.textContent = texts[k];
        return;
      }
      const head = document.createElement("span");
      head.className = "w";
      head.style.setProperty("--w", String(width));
      head.textContent = found[1] + found[2];
      cell.replaceChildren(head, found[3]);
    });
  }

  function tell() {
    const frame = view.frames[index];
    if (byId("travel")) {
      byId("travelled").textContent = frame.words;
      byId("travel").setAttribute("aria-valuetext", frame.words);
    }
    if (byId("forces-words")) byId("forces-words").textContent = view.forces_words;
    if (!byId("rates")) return;
    byId("where").textContent = frame.words;
    byId("F-there").textContent = `${shown(frame.F, 7)} ${view.objective_unit}`.trim();
    const { rates, lengths } = frame;
    writeColumn("length", lengths.map((each) => (each === null ? "" : shown(each, 5))));
    writeColumn("rate", rates.map((each) => shown(each, 6, true)));
    writeColumn("share", rates.map((each) => (frame.F > 0 ? `${(100 * each * each / frame.F).toFixed(1)} %` : "none")));
    document.querySelectorAll("#rates tbody tr").forEach((row, k) => {
      const rate = rates[k], bar = /** @type {HTMLElement} */ (row.querySelector(".bar"));
      bar.classList.toggle("minus", rate < 0);
      bar.style.setProperty("--part", (Math.abs(rate) / largest()).toFixed(4));
    });
  }

  // Views are in order of tasks, and of poses within a task.
  const task = () => (byId("task") ? Number(byId("task").value) : data.views[0].task);
  const worst = () => (data.views.find((each) => each.task === task() && each.is_worst) || view).pose + 1;

  function tellPose() {
    const words = view.is_worst ? `${view.pose_words}, worst pose` : view.pose_words;
    byId("posed").textContent = words;
    byId("pose").setAttribute("aria-valuetext", words);
    byId("worst").disabled = view.is_worst;
  }

  function choose() {
    const pose = byId("pose") ? Number(byId("pose").value) - 1 : 0, found = data.views.find((each) => each.task === task() && each.pose === pose);
    if (!found) {
      byId("posed").textContent = "The robot does not exist at this pose.";
      return;
    }
    view = found;
    if (byId("travel")) {
      byId("travel").max = String(view.frames.length - 1);
      byId("travel").value = String(view.zero);
    }
    /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("img.still")).forEach((each) => each.classList.toggle("chosen", Number(each.dataset.view) === data.views.indexOf(view)));
    if (byId("pose")) tellPose();
    if (window.Plotly && layout) layout = newLayout();
    move(view.zero);
  }

  let waiting = false;
  /** @param {number} to */
  function move(to) {
    index = to;
    tell();
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  }

  /** @param {string | undefined} key */
  function turn(key) {
    if (!window.Plotly || !layout) return;
    layout.scene.camera = key === "reset" ? camera() : turnedCamera(layout.scene.camera, key);
    keep();
    window.Plotly.relayout(byId("view"), { "scene.camera": layout.scene.camera });
  }

  function map() {
    const [part, which] = byId("pair").value.split(" ").map(Number), plane = data.planes[part][which];
    const label = (/** @type {number} */ k) => plane.names[k] + (plane.units[k] ? `, ${plane.units[k]}` : "");
    byId("map-words").textContent = plane.words;
    byId("map").setAttribute("aria-label", plane.words);
    if (!window.Plotly) return;
    const hover = `${plain(label(0))}: %{x:.5g}<br>${plain(label(1))}: %{y:.5g}<br>F: %{z:.5g}<extra></extra>`;
    const kept = plane.F.map((row, r) => row.map((value, k) => (plane.inside[r][k] === "1" ? value : null)));
    const values = plane.F.flat().filter((value) => value !== null);
    const contour = (/** @type {(number | null)[][]} */ z, /** @type {Style} */ more) => ({ type: "contour", x: plane.first, y: plane.second, z, zmin: Math.min(...values), zmax: Math.max(...values), colorscale: "Viridis", connectgaps: false, line: { width: 0.6, color: "rgba(255,255,255,0.6)" }, hovertemplate: hover, ...more });
    const all = kept.flat().every((value, k) => value === plane.F.flat()[k]);
    window.Plotly.react(byId("map"), [
      ...(all ? [] : [contour(plane.F, { opacity: 0.35, showscale: false })]),
      contour(kept.flat().some((value) => value !== null) ? kept : plane.F, { colorbar: { title: { text: plain(plane.label), side: "right" }, thickness: 14 }, visible: true, ...(kept.flat().some((value) => value !== null) ? {} : { opacity: 0.35 }) }),
      { type: "scatter", mode: "markers", x: [plane.at[0]], y: [plane.at[1]], marker: { size: 13, color: "#ff8c1a", line: { color: "#000", width: 2 } }, hovertemplate: "this point<extra></extra>", cliponaxis: false, showlegend: false },
    ], {
      margin: { l: 64, r: 10, t: 12, b: 52 }, paper_bgcolor: "#fff", plot_bgcolor: "#eceff2", font: { family: FONT, color: INK, size: 12 },
      xaxis: { title: { text: plain(label(0)) }, range: [plane.first[0], plane.first[plane.first.length - 1]], zeroline: false },
      yaxis: { title: { text: plain(label(1)) }, range: [plane.second[0], plane.second[plane.second.length - 1]], zeroline: false },
    }, CONFIG);
  }

  async function copy() {
    const text = byId("case-text").textContent ?? "";
    let done = true;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Without permission for the clipboard, try the older command for the selection.
      getSelection()?.selectAllChildren(byId("case-text"));
      done = document.execCommand("copy");
    }
    byId("copied").textContent = done ? "Copied." : "Not copied: the text is selected, copy it with the keyboard.";
  }

  byId("copy").addEventListener("click", copy);
  if (view) {
    if (byId("travel")) byId("travel").addEventListener("input", () => {
      if (!isMoved && layout) {
        isMoved = true;
        layout = newLayout();
      }
      move(Number(byId("travel").value));
    });
    /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-turn]")).forEach((button) => button.addEventListener("click", () => turn(button.dataset.turn)));
    tell();
    if (byId("task")) byId("task").addEventListener("change", choose);
    if (byId("pose")) byId("pose").addEventListener("input", choose);
    if (byId("worst")) byId("worst").addEventListener("click", () => { byId("pose").value = String(worst()); choose(); });
    if (byId("pose")) tellPose();
  }
  if (byId("pair")) {
    byId("pair").addEventListener("change", map);
    map();
  }

  // A page with a live view and without maps needs no library.
  if (!view && !byId("pair")) document.documentElement.dataset.drawn = "yes";
  else afterPaint(async () => {
    if (view && !hasWebGL()) throw new Error("no WebGL");
    if (view) {
      byId("view").textContent = "";
      layout = newLayout();
      await draw();
      byId("view").on("plotly_relayout", keep);
    }
  }, () => { layout = null; }, () => {
    if (!byId("pair")) return;
    byId("map").textContent = "";
    map();
  });
})();
