(() => {
  /** @type {PathView} */
  const view = JSON.parse(byId("data").textContent ?? "").view;
  const RED = "#a3250f", NONE = "#68747f", BEYOND = -2, MOST = 6;
  document.documentElement.classList.add("scripted");
  // Colours of margins, from 0 to the margin above which the colour is constant.
  const MARGINS = [RED, "#e08a3c", "#9aa3ab", "#08519c"].map((each, k) => [k / 3, each]);
  let index = view.first;
  /** @type {Layout | null} */
  let layout = null;

  // Path coloured by the nearest limit, each piece up to the next point, or by the smallest margin.
  function pathTraces() {
    const { path, nearest, margins } = view;
    const marginText = (/** @type {number | null} */ margin) => (margin === null ? "" : `margin ${shown(margin, 3)} %`);
    const text = nearest.map((k, n) => `${marginText(margins[n])}${k < 0 ? "" : `, ${plain(view.limits[k].words)}`}`);
    const hover = { hoverinfo: "text", hoverlabel: { align: "left", bgcolor: "#fff", bordercolor: INK, font: { color: INK, size: 13 } } };
    if (byId("colour") && byId("colour").value === "margin") {
      const color = margins.map((each) => (each === null ? 0 : each));
      return [lines("path margin", [path], { color: [...color, 0], width: 9, colorscale: MARGINS, cmin: 0, cmax: view.most }, { ...hover, hovertext: [...text, ""] })];
    }
    /** @type {Style[]} */
    const found = [];
    const kinds = nearest.map((each, n) => ((margins[n] ?? 0) < 0 ? BEYOND : each));
    for (const k of new Set(kinds)) {
      /** @type {Vector[][]} */
      const parts = [];
      /** @type {string[]} */
      const words = [];
      kinds.forEach((each, n) => {
        if (each !== k || n + 1 === path.length) return;
        parts.push([path[n], path[n + 1]]);
        words.push(text[n], text[n + 1], "");
      });
      if (parts.length) found.push(lines(k === BEYOND ? "path beyond" : `path ${k}`, parts, { color: k === BEYOND ? RED : k < 0 ? NONE : view.limits[k].colour, width: 9 }, { ...hover, hovertext: words }));
    }
    return found;
  }

  /** @param {PathFrame} frame */
  function traces(frame) {
    const found = [...bodyTraces(view, frame.points)];
    for (const own of groupedLinks(view.links)) {
      const parts = own.map(({ ends }) => ends.map((end) => frame.points[end]));
      found.push(lines(`limb ${own[0].limb}`, parts, { color: "#7d8994", width: own[0].kind === "rod" ? 6 : 9 }));
    }
    found.push(...jointTraces(view, frame, INK), ...pathTraces());
    const dots = (/** @type {string} */ name, /** @type {Vector[]} */ places, /** @type {Style} */ marker, /** @type {Style} */ more = {}) => ({ type: "scatter3d", mode: "markers", name, x: places.map((p) => p[0]), y: places.map((p) => p[1]), z: places.map((p) => p[2]), marker, hoverinfo: "skip", showlegend: false, ...more });
    found.push(dots("platform's origin", [frame.position], { size: 4, color: "#fff", line: { color: INK, width: 2 } }));
    if (view.marks.length) found.push(dots("faults", view.marks.map((each) => each.position), { symbol: "diamond", size: 5, color: RED }, { hoverinfo: "text", hovertext: view.marks.map((each) => plain(each.words)) }));
    return found;
  }

  // Lines of the first violations, each line once.
  const faultNames = () => [...new Map(view.marks.map(({ words, position }) => /** @type {const} */ ([words.split(":")[0], position])).reverse())].reverse().slice(0, MOST)
    .map(([text, [x, y, z]]) => ({ x, y, z, text: plain(text), showarrow: false, yshift: 16, bgcolor: "rgba(255,255,255,0.82)", borderpad: 1, font: { color: RED, size: 12 } }));

  const camera = () => fittedCamera(view.ranges, view.eye, { width: byId("view").clientWidth, height: byId("view").clientHeight });

  function draw() {
    if (!window.Plotly || !layout) return null;
    keep();
    layout.scene.annotations = [...limbNames(view, view.frames[index].points, byId("view").clientWidth < 480), ...faultNames()];
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

  function tell() {
    const { words, at } = view.frames[index];
    byId("travel").value = String(index);
    byId("travelled").textContent = words;
    byId("travel").setAttribute("aria-valuetext", words);
    /** @type {NodeListOf<SVGElement>} */ (document.querySelectorAll(".cursor")).forEach((each) => {
      const { low, high, left, width } = each.dataset;
      const part = (at - Number(low)) / (Number(high) - Number(low));
      each.setAttribute("transform", `translate(${(Number(left) + part * Number(width)).toFixed(2)} 0)`);
      each.classList.add("placed");
    });
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

  // Duration of the whole path in milliseconds, independent of the frame rate.
  const LAP = 15000;
  let playing = 0;
  function play() {
    const last = view.frames.length - 1, button = byId("play");
    const stop = () => { cancelAnimationFrame(playing); playing = 0; button.textContent = "Play"; };
    if (playing) {
      stop();
      return;
    }
    button.textContent = "Pause";
    const from = index === last ? 0 : index;
    let begin = NaN;
    const step = (/** @type {number} */ now) => {
      if (Number.isNaN(begin)) begin = now;
      const to = Math.min(from + Math.floor((last * (now - begin)) / LAP), last);
      if (to !== index) move(to);
      if (to === last) stop();
      else playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
  }

  byId("play").addEventListener("click", play);
  byId("travel").addEventListener("input", () => {
    if (playing) play();
    move(Number(byId("travel").value));
  });
  if (byId("colour")) byId("colour").addEventListener("change", () => {
    document.documentElement.classList.toggle("margin-shown", byId("colour").value === "margin");
    draw();
  });
  /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-turn]")).forEach((button) => button.addEventListener("click", () => {
    if (!layout || !window.Plotly) return;
    layout.scene.camera = button.dataset.turn === "reset" ? camera() : turnedCamera(layout.scene.camera, button.dataset.turn);
    keep();
    window.Plotly.relayout(byId("view"), { "scene.camera": layout.scene.camera });
  }));
  tell();

  afterPaint(async () => {
    if (!hasWebGL()) throw new Error("no WebGL");
    byId("view").textContent = "";
    layout = sceneLayout(view.ranges, view.unit, camera());
    await draw();
    byId("view").on("plotly_relayout", (change) => { if (layout && change["scene.camera"]) layout.scene.camera = change["scene.camera"]; keep(); });
  }, () => { layout = null; });
})();
