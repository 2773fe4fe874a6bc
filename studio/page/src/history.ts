// The newest values of the signals that the page looks at: rows of minimum, maximum and last.
import type { Tick, Window } from './protocol';

interface Column {
  min: Float32Array;
  max: Float32Array;
  last: Float32Array;
}

export interface Rows {
  times: Float64Array;
  min(id: number): Float32Array | undefined;
  max(id: number): Float32Array | undefined;
  last(id: number): Float32Array | undefined;
}

/**
 * Rows in the order of time, kept_s long at least. A tick that comes too soon after the last row's
 * begin is merged into it, so that slow simulated time needs no more memory.
 */
export class History {
  private readonly room: number;
  private times: Float64Array;
  private readonly columns = new Map<number, Column>();
  private readonly newestValues = new Map<number, number>();
  private begin = 0;
  private end = 0;
  private rowStart = Number.NEGATIVE_INFINITY;

  constructor(
    private readonly capacity = 4000,
    private readonly kept_s = 64,
  ) {
    this.room = 2 * capacity;
    this.times = new Float64Array(this.room);
  }

  get rows(): number {
    return this.end - this.begin;
  }
  get newest(): number {
    return this.rows > 0 ? this.times[this.end - 1] : Number.NaN;
  }
  /** The signals that have columns. */
  ids(): number[] {
    return [...this.columns.keys()];
  }
  has(id: number): boolean {
    return this.columns.has(id);
  }

  clear(): void {
    this.newestValues.clear();
    this.begin = 0;
    this.end = 0;
    this.rowStart = Number.NEGATIVE_INFINITY;
  }

  /** Time went back: rows that reach beyond `time` did not happen. */
  forgetAfter(time: number): void {
    while (this.end > this.begin && this.times[this.end - 1] > time) --this.end;
    this.rowStart = Number.NEGATIVE_INFINITY;
  }

  /** Keeps the columns of these signals alone. @return those that are new, and so empty. */
  track(ids: Iterable<number>): number[] {
    const wanted = new Set(ids);
    for (const id of this.columns.keys()) if (!wanted.has(id)) this.columns.delete(id);
    const fresh: number[] = [];
    for (const id of wanted) {
      if (this.columns.has(id)) continue;
      const empty = () => new Float32Array(this.room).fill(Number.NaN);
      this.columns.set(id, { min: empty(), max: empty(), last: empty() });
      fresh.push(id);
    }
    return fresh;
  }

  push(tick: Tick, ids: number[]): void {
    if (tick.time < this.newest) this.forgetAfter(tick.time);
    if (this.rows === 0) this.before(tick.time);
    const gap = this.kept_s / (0.9 * this.capacity);
    const merge = this.rows > 0 && tick.time - this.rowStart < gap;
    if (!merge) {
      if (this.end === this.room) this.compact();
      ++this.end;
      this.begin = Math.max(this.begin, this.end - this.capacity);
      this.rowStart = tick.time;
      for (const column of this.columns.values()) {
        column.min[this.end - 1] = Number.NaN;
        column.max[this.end - 1] = Number.NaN;
        column.last[this.end - 1] = Number.NaN;
      }
    }
    const row = this.end - 1;
    this.times[row] = tick.time;
    ids.forEach((id, i) => {
      if (i < tick.count) this.newestValues.set(id, tick.values[3 * i + 2]);
      const column = this.columns.get(id);
      if (!column || i >= tick.count) return;
      widen(column, row, tick.values[3 * i], tick.values[3 * i + 1]);
      column.last[row] = tick.values[3 * i + 2];
    });
  }

  /** Puts what the server kept into rows that have no value yet. */
  fill(ids: number[], window: Window): void {
    for (let s = 0; s < ids.length; ++s) {
      const column = this.columns.get(ids[s]);
      if (!column || window.rows === 0) continue;
      for (let row = this.begin; row < this.end; ++row) {
        if (Number.isFinite(column.last[row])) continue;
        const from = row > this.begin ? this.times[row - 1] : this.times[row] - window.step;
        const first = Math.max(0, Math.ceil((from - window.start) / window.step + 1e-6));
        const past = Math.floor((this.times[row] - window.start) / window.step + 1e-6);
        const last = Math.min(window.rows - 1, past);
        for (let i = Math.min(first, Math.max(last, 0)); i <= last; ++i) {
          widen(column, row, window.min[s][i], window.max[s][i]);
          column.last[row] = (window.min[s][i] + window.max[s][i]) / 2;
        }
      }
    }
  }

  /** The last row whose time is not after `time`; -1 when there is none. */
  rowAt(time: number): number {
    let low = this.begin;
    let high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return low === this.begin ? -1 : low - 1;
  }

  /** The last value at a time. NaN: there is none. */
  at(id: number, time: number): number {
    const row = this.rowAt(time);
    return row < 0 ? Number.NaN : (this.columns.get(id)?.last[row] ?? Number.NaN);
  }
  /** The newest value of any signal that ticks have, with or without a column. */
  latest(id: number): number {
    return this.newestValues.get(id) ?? Number.NaN;
  }

  /** The rows of a span; views, which hold until the next push. */
  view(from: number, to: number): Rows {
    const first = Math.max(this.rowAt(from), this.begin);
    const past = Math.max(first, this.rowAt(to) + 1);
    const part = (id: number, kind: keyof Column) =>
      this.columns.get(id)?.[kind].subarray(first, past);
    return {
      times: this.times.subarray(first, past),
      min: (id) => part(id, 'min'),
      max: (id) => part(id, 'max'),
      last: (id) => part(id, 'last'),
    };
  }

  /** Empty rows before the first tick, which fill() gets from the server. */
  private before(time: number): void {
    const step = this.kept_s / (0.9 * this.capacity);
    const count = Math.min(this.capacity - 1, Math.floor(Math.min(this.kept_s, time) / step));
    for (const column of this.columns.values()) {
      column.min.fill(Number.NaN);
      column.max.fill(Number.NaN);
      column.last.fill(Number.NaN);
    }
    for (let i = 0; i < count; ++i) this.times[i] = time - (count - i) * step;
    this.begin = 0;
    this.end = count;
    this.rowStart = Number.NEGATIVE_INFINITY;
  }

  private compact(): void {
    this.times.copyWithin(0, this.begin, this.end);
    for (const column of this.columns.values()) {
      column.min.copyWithin(0, this.begin, this.end);
      column.max.copyWithin(0, this.begin, this.end);
      column.last.copyWithin(0, this.begin, this.end);
    }
    this.end -= this.begin;
    this.begin = 0;
  }
}

function widen(column: Column, row: number, min: number, max: number): void {
  if (!(column.min[row] <= min)) column.min[row] = min;
  if (!(column.max[row] >= max)) column.max[row] = max;
}
