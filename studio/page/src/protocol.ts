// What goes between page and studio: messages as types, binary frames as decoders.

/** Version of the messages. */
export const kProtocol = 1;
export const kSubprotocol = 'tandem.studio.v1';

export interface JointInfo {
  name: string;
  type: string;
  unit: string;
  lower: number | null;
  upper: number | null;
  velocity: number | null;
  torque: number | null;
  passive: boolean;
}
/** A place on a link that can be led. */
export interface SiteInfo {
  name: string;
  link: string;
}
export interface Foot {
  name: string;
  link: string;
  xyz: number[];
  rpy: number[];
}
/** A mesh of the description: where it can be had, or why it cannot. */
export interface MeshFile {
  file: string;
  path: string | null;
  why: string;
}
/** Lines along x and y, and the heights where they cross: of each y a row. */
export interface Terrain {
  x_m: number[];
  y_m: number[];
  height_m: number[];
  /** Lines that are close to each other are left out. */
  coarser: boolean;
}
export interface Patch {
  name: string;
  x_m: number[];
  y_m: number[];
  static_friction: number;
  sliding_friction: number;
  stiffness_share: number;
}
export interface Ground {
  height_m: number;
  terrain?: Terrain;
  patches?: Patch[];
}
export interface Hello {
  protocol: number;
  version: string;
  robot: string;
  experiment: string;
  title: string;
  simulated: boolean;
  /** Of an emulation, boards and a plant without a cycle: the --hal of the run that leads it. */
  emulated?: string | null;
  floating: boolean;
  ground: Ground | null;
  period_s: number;
  run: string;
  history_s: number[];
  joints: JointInfo[];
  passive: string[];
  feet: Foot[];
  postures: string[];
  sites?: SiteInfo[];
  meshes?: MeshFile[];
  urdf: string;
}
export interface Field {
  name: string;
  unit: string;
  doc: string;
  type: string;
  elements: string[] | null;
  count: number;
}
/** How the numbers of a source are drawn in 3D: fields NAME, NAME.shown and NAME.text. */
export interface MarkInfo {
  name: string;
  /** points, arrow, line, polygon, text */
  shape: string;
  /** The frame of its places: a link, or odom, and where it is in that. */
  link: string;
  xyz: number[];
  rpy: number[];
  size_m: number;
  rgba: number[];
}
export interface SourceTable {
  name: string;
  first: number;
  fields: Field[];
  marks?: MarkInfo[];
}
export interface RunEvent {
  time_s: number;
  cycle: number;
  level: string;
  who: string;
  text: string;
}
/** Whether an event is a command that somebody asked for. */
export function isRequest(event: RunEvent): boolean {
  return event.who === '' && event.text.startsWith('request ');
}
/** Simulated time went back to `time_s`: what lay after it is forgotten. */
export interface TimeBack {
  time_s: number;
  cycle: number;
  from_s: number;
}
export interface Control {
  taken: boolean;
  yours: boolean;
  by: string;
  /** It ended as time went back: nothing was halted. */
  wentBack?: boolean;
}
/** A request to the registry: its name and its keys. */
export interface Request {
  do: string;
  [key: string]: unknown;
}
/** An answer of the registry. */
export interface Answer {
  ok: boolean;
  error?: string;
  hint?: string;
  [key: string]: unknown;
}

/** One frame of live values: per signal the least, the largest and the last since the former one. */
export interface Tick {
  paused: boolean;
  gap: boolean;
  revision: number;
  lost: number;
  cycle: number;
  time: number;
  count: number;
  /** count × (min, max, last) */
  values: Float32Array;
}

/** A piece of history: per signal a row of values, or of pairs (min, max). */
export interface Window {
  id: number;
  level: number;
  rows: number;
  cyclesPerRow: number;
  start: number;
  step: number;
  min: Float32Array[];
  max: Float32Array[];
}

const kTickHead = 32;
const kWindowHead = 32;

const littleEndian = new Uint8Array(new Uint32Array([1]).buffer)[0] === 1;

/** Floats at a place of any alignment, little endian. */
function floats(buffer: ArrayBuffer, offset: number, count: number): Float32Array {
  if (littleEndian) return new Float32Array(buffer.slice(offset, offset + 4 * count));
  const view = new DataView(buffer, offset, 4 * count);
  return Float32Array.from({ length: count }, (_, i) => view.getFloat32(4 * i, true));
}

export function decodeTick(buffer: ArrayBuffer): Tick {
  if (buffer.byteLength < kTickHead) {
    throw new Error(`a tick of ${buffer.byteLength} bytes: its head alone has ${kTickHead}`);
  }
  const view = new DataView(buffer);
  if (view.getUint8(0) !== 1) throw new Error(`kind ${view.getUint8(0)} is no tick`);
  const count = view.getUint32(12, true);
  if (buffer.byteLength !== kTickHead + 12 * count) {
    throw new Error(`a tick of ${count} signals has ${buffer.byteLength} bytes`);
  }
  const flags = view.getUint8(1);
  return {
    paused: (flags & 1) !== 0,
    gap: (flags & 2) !== 0,
    revision: view.getUint32(4, true),
    lost: view.getUint32(8, true),
    cycle: Number(view.getBigUint64(16, true)),
    time: view.getFloat64(24, true),
    count,
    values: floats(buffer, kTickHead, 3 * count),
  };
}

export function decodeWindow(buffer: ArrayBuffer): Window {
  if (buffer.byteLength < kWindowHead) {
    throw new Error(`a window of ${buffer.byteLength} bytes: its head alone has ${kWindowHead}`);
  }
  const view = new DataView(buffer);
  if (view.getUint8(0) !== 2) throw new Error(`kind ${view.getUint8(0)} is no window`);
  const signals = view.getUint16(2, true);
  const rows = view.getUint32(8, true);
  const cyclesPerRow = view.getUint32(12, true);
  const width = cyclesPerRow === 1 ? 1 : 2;
  if (buffer.byteLength !== kWindowHead + 4 * signals * rows * width) {
    throw new Error(`a window of ${signals} x ${rows} rows has ${buffer.byteLength} bytes`);
  }
  const all = floats(buffer, kWindowHead, signals * rows * width);
  const min: Float32Array[] = [];
  const max: Float32Array[] = [];
  for (let s = 0; s < signals; ++s) {
    const own = all.subarray(s * rows * width, (s + 1) * rows * width);
    if (width === 1) {
      min.push(own);
      max.push(own);
    } else {
      min.push(Float32Array.from({ length: rows }, (_, i) => own[2 * i]));
      max.push(Float32Array.from({ length: rows }, (_, i) => own[2 * i + 1]));
    }
  }
  return {
    id: view.getUint32(4, true),
    level: view.getUint8(1),
    rows,
    cyclesPerRow,
    start: view.getFloat64(16, true),
    step: view.getFloat64(24, true),
    min,
    max,
  };
}
