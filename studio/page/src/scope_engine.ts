// The oscilloscope without its picture: looks for the trigger cycle by cycle, and takes records.
import { pieceOf, type Rows, rowsOf } from './record';
import { kMostOverlay, type ScopeSettings } from './scope_settings';
import type { Source } from './source';
import { TriggerDetector } from './trigger';

export type ScopeState = 'stopped' | 'waiting' | 'filling' | 'filled';

/** One record: rows of cycles about the trigger. */
export interface Capture {
  number: number;
  period_s: number;
  /** Cycle of the trigger. */
  trigger: number;
  /** Cycle of the first row. */
  first: number;
  count: number;
  /** Values of a row, by the names of the channels; NaN: a gap. */
  channels: Map<string, Float32Array>;
  /** Nothing triggered it: it was forced, or came by itself. */
  forced: boolean;
}

/** What the engine has to know of the run. */
export interface ScopeRun {
  period_s(): number;
  /** Cycle of the newest values; NaN: there are none. */
  newest(): number;
  /** How far back each cycle is kept. */
  reach_s(): number;
  /** The id of a signal; undefined: the run has none of that name. */
  idOf(name: string): number | undefined;
}

/** Without a trigger for so long, `auto` takes a record. */
const kAuto_s = 1;

export class ScopeEngine {
  state: ScopeState = 'stopped';
  /** Newest first. */
  captures: Capture[] = [];
  /** Seconds that were no longer kept when they were asked for: a trigger in them was not seen. */
  missed_s = 0;
  private settings: ScopeSettings;
  private detector: TriggerDetector;
  private next = 0;
  /** Whence `auto` counts. */
  private quietSince = 0;
  /** Before this cycle nothing triggers: a record has it already. */
  private holdoff = 0;
  private trigger = 0;
  private forced = false;
  /** Of the reach: less after an answer that was coarser all the same. */
  private reachShare = 1;
  private made = 0;
  private busy = false;
  private newest = Number.NEGATIVE_INFINITY;
  /** Another one: what is under way counts no more. */
  private turn = 0;

  /** @param changed  state or captures are others than before */
  constructor(
    private readonly source: Pick<Source, 'window'>,
    private readonly run: ScopeRun,
    settings: ScopeSettings,
    private readonly changed: () => void,
  ) {
    this.settings = settings;
    this.detector = new TriggerDetector(settings.trigger);
  }

  /** Share of the record that is there while it fills. */
  get filled(): number {
    const { past, rows } = this.record();
    return Math.min(1, Math.max(0, 1 - (past - this.now()) / rows));
  }

  /** Other settings count from now on: who waits, waits anew. */
  set(settings: ScopeSettings): void {
    this.settings = settings;
    if (this.state === 'waiting' || this.state === 'filling') this.arm();
  }

  arm(): void {
    this.missed_s = 0;
    this.begin(this.now(), 'waiting');
    void this.look();
  }
  stop(): void {
    this.begin(this.now(), 'stopped');
  }
  clear(): void {
    this.captures = [];
    this.changed();
  }

  /** A record without a trigger: about a time, else the newest. @return whether one is there */
  async force(time_s: number | null): Promise<boolean> {
    const now = this.now();
    const { rows, before } = this.lengths();
    const period = this.run.period_s();
    const trigger = time_s === null ? now - (rows - 1 - before) : Math.round(time_s / period);
    const turn = this.begin(now, this.state === 'filling' ? 'waiting' : this.state);
    const capture = await this.capture(Math.max(0, trigger), true);
    if (typeof capture === 'string' || turn !== this.turn) return false;
    this.keep(capture);
    return true;
  }

  /** New values came. */
  tick(): void {
    const now = this.now();
    // Time went back: the run began anew, or was led back.
    const back = now < this.newest;
    if (back && (this.state === 'waiting' || this.state === 'filling')) this.begin(now, 'waiting');
    this.newest = now;
    void this.look();
  }

  /**
   * The next trigger after a time, or the last one before it, as far as the source has values.
   * @return  its time; null: there is none
   */
  async find(from_s: number, forward: boolean): Promise<number | null> {
    const id = this.run.idOf(this.settings.trigger.signal);
    const period = this.run.period_s();
    if (id === undefined) return null;
    const turn = this.begin(this.now(), 'stopped');
    this.missed_s = 0;
    const most = pieceOf(1);
    const at = Math.round(from_s / period);
    const end = this.now();
    this.detector = new TriggerDetector(this.settings.trigger);
    for (let k = 0; turn === this.turn; ++k) {
      const first = forward ? at + 1 + k * most : at - (k + 1) * most;
      const last = Math.min(end, first + most - 1);
      if (forward ? first > end : last < this.kept()) break;
      // Rows before a piece say in which state the detector is at its begin.
      const lead = forward && k > 0 ? 0 : most;
      if (!forward) this.detector = new TriggerDetector(this.settings.trigger);
      const begin = Math.max(first - lead, this.kept());
      const rows = await rowsOf(this.source, [id], begin, last, period);
      if (!rows) this.missed_s += (last + 1 - Math.max(0, first)) * period;
      const found = rows ? this.hits(rows, first, false) : [];
      if (found.length === 0) continue;
      const trigger = forward ? found[0] : found[found.length - 1];
      const capture = await this.capture(trigger, false);
      if (turn !== this.turn) return null;
      this.captures = this.captures.filter((one) => one.trigger !== trigger);
      if (typeof capture !== 'string') this.keep(capture);
      return trigger * period;
    }
    return null;
  }

  /** Waits for what `tick` began; for tests. */
  async settled(): Promise<void> {
    while (this.busy) await new Promise((resolve) => setTimeout(resolve, 0));
  }

  private now(): number {
    const newest = this.run.newest();
    return Number.isFinite(newest) ? newest : 0;
  }

  private lengths(): { rows: number; before: number } {
    const rows = Math.max(2, Math.round(this.settings.length_s / this.run.period_s()));
    return { rows, before: Math.round(this.settings.before * (rows - 1)) };
  }
  private record(): { first: number; past: number; rows: number } {
    const { rows, before } = this.lengths();
    const first = this.trigger - before;
    return { first, past: first + rows, rows };
  }

  private begin(next: number, state: ScopeState): number {
    this.state = state;
    this.next = next;
    this.holdoff = next;
    this.quietSince = next;
    this.forced = false;
    this.detector = new TriggerDetector(this.settings.trigger);
    this.changed();
    return ++this.turn;
  }

  private async look(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    try {
      for (let turn = this.turn; ; turn = this.turn) {
        const goesOn =
          this.state === 'waiting'
            ? await this.seek(turn)
            : this.state === 'filling' && (await this.fill(turn));
        if (!goesOn && turn === this.turn) return;
      }
    } finally {
      this.busy = false;
    }
  }

  /** Looks for the trigger in the next piece. @return whether there is more to do at once */
  private async seek(turn: number): Promise<boolean> {
    const id = this.run.idOf(this.settings.trigger.signal);
    const now = this.now();
    if (id !== undefined && this.next <= now) {
      const last = Math.min(now, this.next + pieceOf(1) - 1);
      const rows = await rowsOf(this.source, [id], this.next, last, this.run.period_s());
      if (turn !== this.turn) return false;
      if (!rows) return this.skip();
      this.reachShare = 1;
      const [trigger] = this.hits(rows, Math.max(this.next, this.holdoff), true);
      if (trigger !== undefined) return this.triggered(trigger, false);
      this.next = Math.max(this.next, rows.first + rows.count);
      if (rows.count > 0 && this.next <= now) return true;
    }
    const quiet = (now - this.quietSince) * this.run.period_s();
    if (this.settings.mode !== 'auto' || quiet < Math.max(kAuto_s, this.settings.length_s)) {
      return false;
    }
    const { rows, before } = this.lengths();
    return this.triggered(now - (rows - 1 - before), true);
  }

  private triggered(trigger: number, forced: boolean): boolean {
    this.trigger = trigger;
    this.forced = forced;
    this.state = 'filling';
    this.changed();
    return true;
  }

  private async fill(turn: number): Promise<boolean> {
    const { past } = this.record();
    if (this.now() < past - 1) return false;
    const capture = await this.capture(this.trigger, this.forced);
    if (turn !== this.turn || capture === 'no answer') return false;
    if (capture === 'not kept') this.missed_s += this.settings.length_s;
    else this.keep(capture);
    if (capture !== 'not kept' && this.settings.mode === 'single') {
      this.state = 'filled';
      this.changed();
      return false;
    }
    // The detector saw all up to the trigger: it goes on from there, and fires behind the record.
    this.state = 'waiting';
    if (!this.forced) this.next = this.trigger + 1;
    this.holdoff = past;
    this.quietSince = this.now();
    this.changed();
    return true;
  }

  private async capture(
    trigger: number,
    forced: boolean,
  ): Promise<Capture | 'not kept' | 'no answer'> {
    const { channels } = this.settings;
    const wanted = channels.length > 0 ? channels : [this.settings.trigger.signal];
    const names = wanted.filter((name) => this.run.idOf(name) !== undefined);
    const ids = names.map((name) => this.run.idOf(name) as number);
    if (ids.length === 0) return 'not kept';
    const period_s = this.run.period_s();
    const { rows, before } = this.lengths();
    const first = trigger - before;
    const found =
      (await rowsOf(this.source, ids, first, first + rows - 1, period_s)) ??
      // Its begin is gone: what is left of it.
      (await rowsOf(this.source, ids, Math.max(first, this.kept()), first + rows - 1, period_s));
    if (!found) return 'not kept';
    if (found.count === 0) return 'no answer';
    return {
      number: ++this.made,
      period_s,
      trigger,
      first: found.first,
      count: found.count,
      channels: new Map(names.map((name, i) => [name, found.values[i]])),
      forced,
    };
  }

  private keep(capture: Capture): void {
    this.captures = [capture, ...this.captures].slice(0, kMostOverlay);
    this.changed();
  }

  /** The oldest cycle that is kept for some time yet. */
  private kept(): number {
    const reach_s = this.run.reach_s();
    const cycles = (this.reachShare * (reach_s > 0 ? reach_s : 1)) / this.run.period_s();
    return Math.max(0, Math.ceil(this.now() - 0.95 * cycles));
  }

  /** Cycles that are no longer kept are passed over, and counted. */
  private skip(): boolean {
    const next = Math.max(this.next + 1, this.kept());
    this.reachShare *= 0.9;
    this.missed_s += (next - this.next) * this.run.period_s();
    this.next = next;
    return true;
  }

  /** Cycles from `from` on at which it triggers. @param first  the first of them alone */
  private hits(rows: Rows, from: number, first: boolean): number[] {
    const found: number[] = [];
    for (let i = 0; i < rows.count; ++i) {
      if (!this.detector.take(rows.values[0][i]) || rows.first + i < from) continue;
      found.push(rows.first + i);
      if (first) break;
    }
    return found;
  }
}
