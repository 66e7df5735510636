// Canvas with the robot: projection, painting, and a camera that turns by pointer, touch and keyboard.
import { axesOf } from "./scene.js";
import { dot } from "./numbers.js";

/**
 * @typedef {import("./numbers.js").Vector} Vector
 * @typedef {import("./scene.js").Piece} Piece
 */

/** Picture of a robot on a canvas. */
export class Picture {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ azimuth: number, elevation: number }} view first direction of the camera, degrees
   * @param {() => void} changed called when the camera moves
   */
  constructor(canvas, view, changed) {
    this.canvas = canvas;
    this.first = { ...view };
    this.camera = { ...view, zoom: 1 };
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** @type {Vector[]} points that fit into the frame */
    this.fitted = [];
    this.changed = changed;
    /** Last projection: directions, and pixels of the page per length. */
    this.last = { axes: axesOf(view), scale: 1, place: (/** @type {Vector} */ each) => [each[0], each[1]] };
    /** @type {((x: number, y: number, turns: boolean) => ((across: number, up: number, twist?: number) => void) | null) | null} takes hold of the platform */
    this.grab = null;
    this.listen();
  }

  /** Scale and centre for the fitted points. */
  frame() {
    const { width, height } = this.canvas, axes = axesOf(this.camera);
    const flat = this.fitted.map((each) => [dot(each, axes.right), dot(each, axes.up)]);
    const [x, y] = [0, 1].map((k) => [Math.min(...flat.map((each) => each[k])), Math.max(...flat.map((each) => each[k]))]);
    // The middle of the box in space, so that turning does not shift the picture.
    const middle = [0, 1, 2].map((k) => (Math.min(...this.fitted.map((p) => p[k])) + Math.max(...this.fitted.map((p) => p[k]))) / 2);
    const reach = Math.max(...this.fitted.map((p) => Math.hypot(...p.map((each, k) => each - middle[k]))), 1e-300);
    const half = Math.min((x[1] - x[0]) / 2 + 0.06 * reach, reach) || 1, tall = Math.min((y[1] - y[0]) / 2 + 0.06 * reach, reach) || 1;
    const scale = 0.86 * this.camera.zoom * Math.min(width / (2 * Math.max(half, 0.55 * reach)), height / (2 * Math.max(tall, 0.55 * reach)));
    const centre = /** @type {Vector} */ (middle);
    return { axes, scale, across: this.camera.zoom > 1.001 ? dot(centre, axes.right) : (x[0] + x[1]) / 2, upwards: this.camera.zoom > 1.001 ? dot(centre, axes.up) : (y[0] + y[1]) / 2 };
  }

  /** Matches the canvas to its place in the page. */
  resize() {
    const box = this.canvas.getBoundingClientRect(), ratio = Math.min(2, globalThis.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.ratio = ratio;
  }

  /**
   * @param {Piece[]} pieces in painting order
   * @param {{ text: string, at: Vector }[]} labels
   * @param {Record<string, string>} colours
   */
  draw(pieces, labels, colours) {
    this.resize();
    const { context, canvas } = this, ratio = this.ratio || 1;
    const { axes, scale, across, upwards } = this.frame();
    const place = (/** @type {Vector} */ each) => [
      canvas.width / 2 + scale * (dot(each, axes.right) - across),
      canvas.height / 2 - scale * (dot(each, axes.up) - upwards),
    ];
    this.last = { axes, scale: scale / ratio, place: (/** @type {Vector} */ each) => place(each).map((value) => value / ratio) };
    const part = Math.min(1.15, Math.max(0.62, Math.min(canvas.width, canvas.height) / ratio / 520));
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.lineCap = "round";
    context.lineJoin = "round";
    for (const piece of pieces) this.paint(piece, piece.points.map(place), ratio * part, colours);
    this.label(labels, place, ratio, colours);
    this.triad(axes, ratio, colours);
  }

  /** @param {Piece} piece @param {number[][]} flat @param {number} ratio @param {Record<string, string>} colours */
  paint(piece, flat, ratio, colours) {
    const { context } = this;
    context.beginPath();
    if (piece.kind === "dot") {
      context.arc(flat[0][0], flat[0][1], piece.width * ratio, 0, 2 * Math.PI);
      context.fillStyle = piece.colour;
      context.fill();
      context.lineWidth = 1.2 * ratio;
      context.strokeStyle = colours.halo;
      context.stroke();
      return;
    }
    if (piece.kind === "line" && Math.hypot(flat[1][0] - flat[0][0], flat[1][1] - flat[0][1]) < 1) {
      // A line that is seen from its end.
      context.arc(flat[0][0], flat[0][1], (piece.width * ratio) / 2, 0, 2 * Math.PI);
      context.fillStyle = piece.colour;
      context.fill();
      return;
    }
    flat.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (piece.kind === "face") {
      context.closePath();
      context.fillStyle = piece.colour;
      context.globalAlpha = 0.78;
      context.fill();
      context.globalAlpha = 1;
    }
    context.lineWidth = piece.width * ratio;
    context.strokeStyle = piece.edge ?? piece.colour;
    if (piece.limb !== undefined) {
      context.lineWidth = (piece.width + 2) * ratio;
      context.strokeStyle = colours.halo;
      context.lineCap = "butt";
      context.stroke();
      context.lineCap = "round";
      context.lineWidth = piece.width * ratio;
      context.strokeStyle = piece.colour;
    }
    context.stroke();
    if (piece.head) this.arrow(flat[flat.length - 2], flat[flat.length - 1], piece, ratio);
  }

  /** @param {number[]} from @param {number[]} to @param {Piece} piece @param {number} ratio */
  arrow(from, to, piece, ratio) {
    const { context } = this, size = (5 + 1.6 * piece.width) * ratio;
    const way = [to[0] - from[0], to[1] - from[1]], long = Math.hypot(...way);
    if (long < 0.5) return;
    const [x, y] = way.map((each) => each / long);
    context.beginPath();
    context.moveTo(to[0] + 0.4 * size * x, to[1] + 0.4 * size * y);
    context.lineTo(to[0] - 0.6 * size * x + 0.42 * size * y, to[1] - 0.6 * size * y - 0.42 * size * x);
    context.lineTo(to[0] - 0.6 * size * x - 0.42 * size * y, to[1] - 0.6 * size * y + 0.42 * size * x);
    context.closePath();
    context.fillStyle = piece.colour;
    context.fill();
  }

  /** Labels, none of which covers another. @param {{ text: string, at: Vector }[]} labels @param {(each: Vector) => number[]} place @param {number} ratio @param {Record<string, string>} colours */
  label(labels, place, ratio, colours) {
    const { context } = this, size = 12 * ratio;
    context.font = `${size}px system-ui, "DejaVu Sans", sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    /** @type {number[][]} */
    const taken = [];
    for (const { text, at } of labels) {
      const [x, y] = place(at), half = context.measureText(text).width / 2 + 3 * ratio;
      if (taken.some((box) => Math.abs(box[0] - x) < box[1] + half && Math.abs(box[2] - y) < 1.2 * size)) continue;
      taken.push([x, half, y]);
      context.lineWidth = 4 * ratio;
      context.strokeStyle = colours.halo;
      context.strokeText(text, x, y);
      context.fillStyle = colours.ink;
      context.fillText(text, x, y);
    }
  }

  /** World axes in a corner. @param {import("./scene.js").Axes} axes @param {number} ratio @param {Record<string, string>} colours */
  triad(axes, ratio, colours) {
    const { context, canvas } = this, size = 20 * ratio, x = canvas.width - 34 * ratio, y = canvas.height - 32 * ratio;
    context.font = `${11 * ratio}px system-ui, sans-serif`;
    context.lineWidth = 1.4 * ratio;
    context.strokeStyle = colours.muted;
    context.fillStyle = colours.muted;
    ["x", "y", "z"].forEach((name, k) => {
      const across = axes.right[k] * size, up = axes.up[k] * size;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + across, y - up);
      context.stroke();
      context.fillText(name, x + 1.35 * across, y - 1.35 * up);
    });
  }

  /** Turns the camera, degrees. @param {number} round @param {number} up */
  turn(round, up) {
    this.camera.azimuth += round;
    this.camera.elevation = Math.max(-89, Math.min(90, this.camera.elevation + up));
    this.changed();
  }

  /** @param {number} factor */
  zoom(factor) {
    this.camera.zoom = Math.max(0.4, Math.min(8, this.camera.zoom * factor));
    this.changed();
  }

  reset() {
    this.camera = { ...this.first, zoom: 1 };
    this.changed();
  }

  listen() {
    const { canvas } = this;
    /** @type {Map<number, { x: number, y: number }>} */
    const fingers = new Map();
    let apart = 0;
    /** @type {{ pull: (across: number, up: number, twist?: number) => void, x: number, y: number, angle: number } | null} */
    let grabbed = null;
    /** Middle of two fingers, and the angle of their line. */
    const pair = () => {
      const [a, b] = [...fingers.values()];
      return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, angle: Math.atan2(a.y - b.y, b.x - a.x) };
    };
    canvas.addEventListener("pointerdown", (event) => {
      const box = canvas.getBoundingClientRect();
      const before = [...fingers.values()][0];
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      // A second finger, while the first one has the platform, turns it.
      const isSecond = fingers.size === 2 && grabbed !== null, held = isSecond ? before : { x: event.clientX, y: event.clientY };
      const pull = fingers.size === 1 || isSecond ? (this.grab?.(held.x - box.left, held.y - box.top, event.shiftKey || isSecond) ?? null) : null;
      grabbed = pull && { pull, ...(isSecond ? pair() : { x: event.clientX, y: event.clientY, angle: 0 }) };
      canvas.setPointerCapture(event.pointerId);
      apart = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const now = { x: event.clientX, y: event.clientY };
      fingers.set(event.pointerId, now);
      if (fingers.size === 1 && grabbed) {
        grabbed.pull((now.x - grabbed.x) / this.last.scale, (grabbed.y - now.y) / this.last.scale);
        return;
      }
      if (fingers.size === 2 && grabbed) {
        const two = pair(), twist = Math.atan2(Math.sin(two.angle - grabbed.angle), Math.cos(two.angle - grabbed.angle));
        grabbed.pull((two.x - grabbed.x) / this.last.scale, (grabbed.y - two.y) / this.last.scale, twist);
        return;
      }
      if (fingers.size === 1) this.turn(-0.5 * (now.x - before.x), 0.4 * (now.y - before.y));
      if (fingers.size === 2) {
        const [a, b] = [...fingers.values()], far = Math.hypot(a.x - b.x, a.y - b.y);
        if (apart) this.zoom(far / apart);
        apart = far;
      }
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => {
        fingers.delete(/** @type {PointerEvent} */ (event).pointerId);
        grabbed = null;
      });
    }
    canvas.addEventListener("pointermove", (event) => {
      if (fingers.size) return;
      const box = canvas.getBoundingClientRect();
      canvas.style.cursor = this.grab?.(event.clientX - box.left, event.clientY - box.top, false) ? "move" : "grab";
    });
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const turns = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [8, 0], ArrowRight: [-8, 0], ArrowUp: [0, 6], ArrowDown: [0, -6] });
      if (event.key in turns) this.turn(...turns[event.key]);
      else if (event.key === "+" || event.key === "=") this.zoom(1.15);
      else if (event.key === "-") this.zoom(1 / 1.15);
      else if (event.key === "0") this.reset();
      else return;
      event.preventDefault();
    });
  }
}
