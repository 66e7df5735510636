// Types of the data of reports, as frames.py, pathview.py and report.py write them; pages do not have this file.

type Vector = number[];
type Style = Record<string, unknown>;

interface LinkData {
  ends: number[];
  limb: string | null;
  body: string;
  kind: "bar" | "rod" | "rail";
  row: number | null;
}

interface JointData {
  kind: "R" | "P" | "H" | "C" | "U" | "S" | "Pa";
  words: string;
  actuated: boolean;
}

interface RowData {
  limb: string;
  member: string;
  kind: string;
  at: number | null;
}

/** Posture of a robot; `joints` has the place and the axes of each joint. */
interface Posture {
  words: string;
  points: Vector[];
  position: Vector;
  joints: Vector[][];
}

/** Part of a view that all pages with a robot have. */
interface RobotData {
  unit: string;
  size: number;
  eye: Vector;
  links: LinkData[];
  joints: JointData[];
  plates: Partial<Record<"base" | "platform", number[]>>;
}

interface Frame extends Posture {
  jacobian: Vector[];
  rates: number[];
  F: number;
  noise: number;
  lengths: (number | null)[];
  velocities: Vector[];
}

interface MotionData {
  line: Vector[];
  path: Vector[];
}

interface ForceData {
  kind: "load" | "moment" | "push" | "pull" | "drive";
  name: string;
  words: string;
  colour: string;
  ends: [Vector, Vector];
}

interface View extends RobotData {
  task: number;
  pose: number;
  pose_words: string;
  is_worst: boolean;
  measure: { words: string; units: string[] };
  rate_word: string;
  rate_unit: string;
  objective_unit: string;
  corners: number[];
  rows: RowData[];
  motion: MotionData | null;
  free: MotionData[];
  forces: ForceData[];
  forces_words: string;
  reference: Vector[] | null;
  colours: string[];
  zero: number;
  frames: Frame[];
}

/** F over two coordinates; `inside` has a row of the digits 0 and 1 for each row of F. */
interface Plane {
  names: string[];
  units: string[];
  label: string;
  first: number[];
  second: number[];
  F: (number | null)[][];
  inside: string[];
  at: number[];
  words: string;
}

interface ReportData {
  views: View[];
  planes: Plane[][];
}

interface PathFrame extends Posture {
  at: number;
}

interface PathView extends RobotData {
  ranges: [number, number][];
  limits: { words: string; colour: string }[];
  path: Vector[];
  nearest: number[];
  margins: (number | null)[];
  most: number;
  marks: { words: string; position: Vector }[];
  first: number;
  frames: PathFrame[];
}

interface Point3 {
  x: number;
  y: number;
  z: number;
}

interface Camera {
  eye: Point3;
  center: Point3;
  up: Point3;
  projection: { type: string };
}

/** Layout of the 3-D view: the parts that scripts change. */
interface Layout {
  scene: { camera: Camera; annotations?: object[]; [key: string]: unknown };
  [key: string]: unknown;
}

interface PlotlyElement extends HTMLElement {
  on(event: string, then: (change: Record<string, Camera>) => void): void;
}

interface Plotly {
  react(element: HTMLElement, traces: object[], layout: object, config: object): Promise<unknown>;
  relayout(element: HTMLElement, change: Record<string, unknown>): Promise<unknown>;
  toImage(element: HTMLElement, options: { format: string; width: number; height: number }): Promise<string>;
}

interface Window {
  /** Library of the page; missing before the first picture, and where it cannot start. */
  Plotly?: Plotly;
}

/** Elements that are more than an `HTMLElement`, by identifier. */
interface Elements {
  travel: HTMLInputElement;
  task: HTMLSelectElement;
  pose: HTMLInputElement;
  worst: HTMLButtonElement;
  pair: HTMLSelectElement;
  colour: HTMLSelectElement;
  view: PlotlyElement;
  "view-copy": HTMLImageElement;
}
