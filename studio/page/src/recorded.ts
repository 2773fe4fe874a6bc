// The source of a recording that is in the page itself: what report/recording.cpp has packed.
import type { Answer, Hello, RunEvent, SourceTable, Tick, Window } from './protocol';
import type { Listener, Source } from './source';

/** Equal spans of time; cycles: of a row. */
export interface Grid {
  start_s: number;
  step_s: number;
  rows: number;
  cycles: number;
}
/** A number that never changes (null: there is none), or least, scale and bytes of the codes. */
export type Code = number | null | [number, number, number];

export interface Recording {
  format: 1;
  hello: Hello;
  signals: { sources: SourceTable[] };
  events: { events: RunEvent[] };
  urdf: string;
  figures: { title: string; series: string[] }[];
  logs: { prefix: string; path: string }[];
  /** The time that is shown at first. */
  at_s: number;
  grid: Grid;
  codes: Code[];
  data: string;
}

interface Rows {
  min: Float32Array;
  max: Float32Array;
}

/** The recording of this page; null: it is a page of a run. @throws Error in words */
export function recordingIn(page: Document): Recording | null {
  const text = page.getElementById('recording')?.textContent;
  if (!text) return null;
  const recording = JSON.parse(text) as Recording;
  if (recording.format !== 1) throw new Error(`format ${recording.format} is not known here`);
  return recording;
}

/** What base64 holds of a zlib stream. @throws Error in words where the browser cannot unpack. */
export async function inflate(base64: string): Promise<Uint8Array> {
  if (typeof DecompressionStream === 'undefined') {
    throw new Error(
      'this browser cannot unpack the numbers (DecompressionStream): a newer one can',
    );
  }
  const packed = new Uint8Array(Array.from(atob(base64), (one) => one.charCodeAt(0)));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The rows of one signal, as report/packing.hpp says. @param at where its codes begin */
export function unpack(code: Code, bytes: Uint8Array, at: number, grid: Grid): Rows {
  const { rows } = grid;
  if (!Array.isArray(code)) {
    const same = new Float32Array(rows).fill(code ?? Number.NaN);
    return { min: same, max: same };
  }
  const [least, scale, size] = code;
  const gap = 2 ** (8 * size) - 1;
  const number = (plane: number, row: number) => {
    let sum = 0;
    for (let byte = size - 1; byte >= 0; --byte) {
      sum = sum * 256 + bytes[at + (plane * size + byte) * rows + row];
    }
    return sum;
  };
  const min = new Float32Array(rows);
  const max = grid.cycles > 1 ? new Float32Array(rows) : min;
  let now = 0;
  for (let row = 0; row < rows; ++row) {
    const folded = number(0, row);
    now = (now + (folded % 2 === 1 ? -(folded + 1) / 2 : folded / 2) + gap + 1) % (gap + 1);
    min[row] = now === gap ? Number.NaN : least + scale * now;
    if (max !== min) max[row] = now === gap ? Number.NaN : least + scale * (now + number(1, row));
  }
  return { min, max };
}

/** Rows from..to of a signal, so many merged into one. */
function merged(rows: Rows, from: number, count: number, merge: number): Rows {
  if (merge === 1) {
    const min = rows.min.subarray(from, from + count);
    return { min, max: rows.min === rows.max ? min : rows.max.subarray(from, from + count) };
  }
  const length = Math.ceil(count / merge);
  const min = new Float32Array(length).fill(Number.NaN);
  const max = new Float32Array(length).fill(Number.NaN);
  for (let i = 0; i < count; ++i) {
    const at = Math.floor(i / merge);
    if (!(min[at] <= rows.min[from + i])) min[at] = rows.min[from + i];
    if (!(max[at] >= rows.max[from + i])) max[at] = rows.max[from + i];
  }
  return { min, max };
}

const kNobody: Answer = {
  ok: false,
  error: 'this is a recording: nobody is there to ask',
  hint: 'tandem run … --studio',
};

export class RecordedSource implements Source {
  readonly live = false;
  private readonly listeners: Partial<Listener>[] = [];
  private bytes: Uint8Array = new Uint8Array();
  private readonly places: number[] = [];
  private readonly unpacked = new Map<number, Rows>();
  private revision = 0;
  private signals: number[] = [];
  private time: number;

  /** @param finer windows of a server that has the log; null: there is none. */
  constructor(
    private readonly recording: Recording,
    private readonly finer: Source['window'] | null = null,
  ) {
    this.time = recording.at_s;
  }

  async mesh(): Promise<ArrayBuffer> {
    throw new Error('a log has its name alone');
  }

  get first(): number {
    return this.recording.at_s;
  }
  get start(): number {
    return this.recording.grid.start_s;
  }
  get end(): number {
    const { start_s, step_s, rows } = this.recording.grid;
    return start_s + step_s * Math.max(1, rows - 1);
  }

  on(listener: Partial<Listener>): void {
    this.listeners.push(listener);
  }

  /** Unpacks the numbers, and says what a run would say. */
  async open(): Promise<void> {
    const { hello, signals, events, grid, codes } = this.recording;
    this.each((l) => l.connection?.('recorded', ''));
    this.each((l) => l.hello?.({ ...hello, urdf: this.recording.urdf ? hello.urdf : '' }));
    try {
      this.bytes = await inflate(this.recording.data);
    } catch (error) {
      const words = error instanceof Error ? error.message : String(error);
      this.each((l) => l.trouble?.(`No plots and no 3D view: ${words}`, ''));
      return;
    }
    let at = 0;
    for (const code of codes) {
      this.places.push(at);
      if (Array.isArray(code)) at += code[2] * grid.rows * (grid.cycles > 1 ? 2 : 1);
    }
    this.each((l) => l.signals?.(1, signals.sources));
    this.each((l) => l.events?.(events.events));
  }

  /** Goes to a time: ticks say what was then. */
  seek(time: number): void {
    this.time = Math.min(this.end, Math.max(this.start, time));
    this.tick();
  }

  async description(): Promise<string> {
    return this.recording.urdf;
  }

  subscribe(revision: number, signals: number[]): void {
    this.revision = revision;
    this.signals = signals;
    queueMicrotask(() => this.tick());
  }

  async window(signals: number[], from: number, to: number, points: number): Promise<Window> {
    const { start_s, step_s, rows, cycles } = this.recording.grid;
    const first = Math.max(0, Math.floor((from - start_s) / step_s));
    const past = Math.min(rows, Math.ceil((to - start_s) / step_s) + 1);
    const count = Math.max(0, past - first);
    // Where these rows are too coarse, or each cycle may be given.
    const each = count * cycles <= 4 * points + 2 * cycles;
    if (this.finer && cycles > 1 && (count < 2 * points || each)) {
      try {
        return await this.finer(signals, from, to, points);
      } catch (error) {
        const words = error instanceof Error ? error.message : String(error);
        this.each((l) => l.trouble?.(`Not every cycle is shown: ${words}`, ''));
      }
    }
    const merge = count > 4 * points ? Math.ceil(count / (2 * points)) : 1;
    const found = signals.map((id) => merged(this.rows(id), first, count, merge));
    return {
      id: 0,
      level: 0,
      rows: Math.ceil(count / merge),
      cyclesPerRow: cycles * merge,
      start: start_s + first * step_s,
      step: step_s * merge,
      min: found.map((one) => one.min),
      max: found.map((one) => one.max),
    };
  }

  async ask(): Promise<Answer> {
    return kNobody;
  }
  watch(): void {}
  control(): void {}
  alive(): void {}

  private rows(id: number): Rows {
    const had = this.unpacked.get(id);
    if (had) return had;
    const { grid, codes } = this.recording;
    const rows = unpack(codes[id] ?? null, this.bytes, this.places[id] ?? 0, grid);
    this.unpacked.set(id, rows);
    return rows;
  }

  private tick(): void {
    const { start_s, step_s, rows, cycles } = this.recording.grid;
    const row = Math.min(rows - 1, Math.max(0, Math.floor((this.time - start_s) / step_s + 1e-6)));
    const values = new Float32Array(3 * this.signals.length);
    this.signals.forEach((id, i) => {
      const { min, max } = this.rows(id);
      values.set([min[row], max[row], min === max ? min[row] : (min[row] + max[row]) / 2], 3 * i);
    });
    const tick: Tick = {
      paused: false,
      gap: false,
      revision: this.revision,
      lost: 0,
      cycle: row * cycles,
      time: this.time,
      count: this.signals.length,
      values,
    };
    this.each((l) => l.tick?.(tick));
  }

  private each(call: (listener: Partial<Listener>) => void): void {
    for (const listener of this.listeners) call(listener);
  }
}
