// Joins the source with the page: who needs which signals, their newest rows, and the time.
import { History } from './history';
import {
  type Hello,
  isRequest,
  type RunEvent,
  type SourceTable,
  type Tick,
  type TimeBack,
  type Window,
} from './protocol';
import { Catalog } from './signals';
import type { Source } from './source';
import { TimeModel } from './time';

const kBackfill_s = 64;
const kBackfillPoints = 900;
/** Revisions whose ticks may still be under way. */
const kRevisionsKept = 8;
const kMostSignals = 4096;
const kMostEvents = 5000;

interface Need {
  ids: number[];
  past: boolean;
}

export class Data {
  hello: Hello | null = null;
  catalog = new Catalog();
  /** As the run has them now. */
  sources: SourceTable[] = [];
  readonly time = new TimeModel();
  readonly history = new History();
  readonly events: RunEvent[] = [];
  lastTick: Tick | null = null;
  /** performance.now() of the newest tick. */
  heard = Number.NEGATIVE_INFINITY;
  private readonly needs = new Map<string, Need>();
  private readonly revisions = new Map<number, number[]>();
  private revision = 0;
  private pending = false;
  private lacking = new Set<number>();
  private readonly onHello: ((hello: Hello) => void)[] = [];
  private readonly onCatalog: (() => void)[] = [];
  private readonly onTick: (() => void)[] = [];
  private readonly onEvents: (() => void)[] = [];
  private readonly onBack: (() => void)[] = [];

  constructor(readonly source: Source) {
    source.on({
      hello: (hello) => this.begin(hello),
      signals: (revision, sources) => this.table(revision, sources),
      tick: (tick) => this.take(tick),
      events: (events) => this.say(events),
      back: (back) => this.goBack(back),
    });
  }

  whenHello(call: (hello: Hello) => void): void {
    this.onHello.push(call);
  }
  whenCatalog(call: () => void): void {
    this.onCatalog.push(call);
  }
  whenTick(call: () => void): void {
    this.onTick.push(call);
  }
  whenEvents(call: () => void): void {
    this.onEvents.push(call);
  }

  whenBack(call: () => void): void {
    this.onBack.push(call);
  }

  /** What `owner` looks at from now on. @param past what came before is wanted, too. */
  want(owner: string, ids: number[], past = false): void {
    const before = this.needs.get(owner);
    if (before && before.past === past && same(before.ids, ids)) return;
    this.needs.set(owner, { ids, past });
    if (this.pending) return;
    this.pending = true;
    queueMicrotask(() => {
      this.pending = false;
      this.subscribe();
    });
  }

  latest(id: number): number {
    return this.history.latest(id);
  }

  /** Values at a time: from the newest rows, else from what the run kept. */
  async valuesAt(ids: number[], time: number): Promise<number[]> {
    const near = ids.map((id) => this.history.at(id, time));
    const lacking = ids.filter((id, i) => id >= 0 && !Number.isFinite(near[i]));
    if (lacking.length === 0) return near;
    const period = this.hello?.period_s ?? 0.001;
    const window = await this.source.window(lacking, Math.max(0, time - 300 * period), time, 300);
    const kept = new Map(lacking.map((id, i) => [id, newestOf(window.max[i])]));
    return near.map((value, i) => kept.get(ids[i]) ?? value);
  }

  private begin(hello: Hello): void {
    if (this.hello && this.hello.run !== hello.run) {
      this.history.clear();
      this.time.now = Number.NaN;
      this.time.select(null);
    }
    this.events.length = 0;
    this.hello = hello;
    for (const call of this.onHello) call(hello);
  }

  private table(revision: number, sources: SourceTable[]): void {
    this.catalog = new Catalog(revision, sources, this.hello?.joints);
    this.sources = sources;
    for (const call of this.onCatalog) call();
    this.subscribe();
  }

  private subscribe(): void {
    const wanted = [...new Set([...this.needs.values()].flatMap((need) => need.ids))];
    const ids = wanted.slice(0, kMostSignals);
    // Only what is plotted has a past here: of all else the newest values do.
    const plotted = [...this.needs.values()].filter((need) => need.past);
    for (const id of this.history.track(plotted.flatMap((need) => need.ids))) this.lacking.add(id);
    this.revisions.set(++this.revision, ids);
    this.revisions.delete(this.revision - kRevisionsKept);
    this.source.subscribe(this.revision, ids);
  }

  private take(tick: Tick): void {
    const ids = this.revisions.get(tick.revision);
    this.heard = performance.now();
    this.lastTick = tick;
    if (ids) this.history.push(tick, ids);
    this.time.now = tick.time;
    if (this.lacking.size > 0 && tick.revision === this.revision) void this.backfill(tick.time);
    for (const call of this.onTick) call();
  }

  /** What lay after it did not happen; the run's events say that it went back. */
  private goBack({ time_s }: TimeBack): void {
    this.history.forgetAfter(time_s);
    // Older than the rows are: those before the next tick come from what the run kept.
    if (this.history.rows === 0) for (const id of this.history.ids()) this.lacking.add(id);
    // A request acts in the cycle after its time.
    const stays = (e: RunEvent) => e.time_s < time_s || (e.time_s === time_s && !isRequest(e));
    this.events.splice(0, this.events.length, ...this.events.filter(stays));
    this.time.goBack(time_s);
    for (const call of [...this.onBack, ...this.onEvents]) call();
  }

  private async backfill(now: number): Promise<void> {
    const ids = [...this.lacking].filter((id) => this.history.has(id));
    this.lacking = new Set();
    if (ids.length === 0) return;
    const from = Math.max(0, now - kBackfill_s);
    const window: Window = await this.source.window(ids, from, now, kBackfillPoints);
    this.history.fill(ids, window);
  }

  private say(events: RunEvent[]): void {
    this.events.push(...events);
    if (this.events.length > kMostEvents) this.events.splice(0, this.events.length - kMostEvents);
    for (const call of this.onEvents) call();
  }
}

/** The last value of a row of them; NaN: there is none. */
function newestOf(values: Float32Array): number {
  for (let i = values.length - 1; i >= 0; --i) if (Number.isFinite(values[i])) return values[i];
  return Number.NaN;
}

function same(a: number[], b: number[]): boolean {
  return a.length === b.length && a.every((one, i) => one === b[i]);
}
