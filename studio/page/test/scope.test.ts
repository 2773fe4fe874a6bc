// Triggers, and the engine of the oscilloscope against a run that keeps some of its cycles.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { csv, float32 } from '../src/csv';
import { readLayout } from '../src/layout';
import type { Window } from '../src/protocol';
import { rowsOf } from '../src/record';
import { ScopeEngine } from '../src/scope_engine';
import { firstSettings, readScope, type ScopeSettings } from '../src/scope_settings';
import { type Trigger, TriggerDetector } from '../src/trigger';

const kPeriod_s = 0.001;

const trigger = (over: Partial<Trigger>): Trigger => ({
  ...firstSettings().trigger,
  signal: 'a',
  ...over,
});
/** The rows at which it triggers. */
function fired(over: Partial<Trigger>, values: number[]): number[] {
  const detector = new TriggerDetector(trigger(over));
  return values.flatMap((value, i) => (detector.take(value) ? [i] : []));
}

test('edges are found in the cycle in which the level is reached', () => {
  const wave = [0, 0.4, 0.5, 1, 0.5, 0.4, 0, 1];
  assert.deepEqual(fired({ kind: 'rising', level: 0.5 }, wave), [2, 7]);
  assert.deepEqual(fired({ kind: 'falling', level: 0.5 }, wave), [4]);
  assert.deepEqual(fired({ kind: 'either', level: 0.5 }, wave), [2, 4, 7]);
  assert.deepEqual(fired({ kind: 'rising', level: 0.5 }, [1, 1, 1]), []);
  assert.deepEqual(
    fired({ kind: 'falling', level: 0.5, hysteresis: 0.25 }, [1, 0.5, 0.75, 0]),
    [1, 3],
  );
  assert.deepEqual(fired({ kind: 'rising', level: 0.5 }, [0, 0, 1, 0, 0]), [2]);
});

test('hysteresis keeps noise at the level from triggering again', () => {
  const noisy = [0, 0.52, 0.48, 0.51, 0.49, 0.6, 0.3, 0.6];
  assert.deepEqual(fired({ kind: 'rising', level: 0.5 }, noisy), [1, 3, 5, 7]);
  assert.deepEqual(fired({ kind: 'rising', level: 0.5, hysteresis: 0.1 }, noisy), [1, 7]);
});

test('conditions trigger where they begin, at once where they hold already', () => {
  assert.deepEqual(fired({ kind: 'above', level: 1 }, [2, 2, 1, 1.1, 3, 0, 1]), [0, 3]);
  assert.deepEqual(fired({ kind: 'below', level: 1 }, [2, 1, 0.9, 0.8]), [2]);
  assert.deepEqual(fired({ kind: 'outside', level: -1, upper: 1 }, [0, 1.5, 0, -2, -2]), [1, 3]);
  assert.deepEqual(fired({ kind: 'changes' }, [1, 1, 2, 3, 3, 3, 1]), [2, 6]);
  assert.deepEqual(fired({ kind: 'changes', hysteresis: 0.5 }, [1, 1.4, 1, 2]), [3]);
});

test('a gap hides no crossing', () => {
  assert.deepEqual(fired({ kind: 'rising', level: 0.5 }, [0, Number.NaN, Number.NaN, 1, 1]), [3]);
  assert.deepEqual(fired({ kind: 'changes' }, [1, Number.NaN, 2, 2]), [2]);
});

/** A run that keeps `reach` cycles of its signals, a (id 0) and its number of the cycle (id 1). */
class Ring {
  now = -1;
  asked: { from: number; to: number }[] = [];
  linked = true;
  constructor(
    readonly reach: number,
    readonly a: (cycle: number) => number,
    readonly claims = reach,
  ) {}

  async window(signals: number[], from: number, to: number, points: number): Promise<Window> {
    const first = Math.max(0, Math.floor(from / kPeriod_s));
    const last = Math.min(this.now, Math.floor(to / kPeriod_s));
    this.asked.push({ from: first, to: last });
    const rows = this.linked ? Math.max(0, last - first + 1) : 0;
    const fine = first > this.now - this.reach && rows <= 4 * points;
    const value = (id: number, cycle: number) => (id === 0 ? this.a(cycle) : cycle);
    const values = signals.map((id) =>
      Float32Array.from({ length: rows }, (_, i) => value(id, first + i)),
    );
    const head = { id: 0, level: fine ? 0 : 1, rows, cyclesPerRow: fine ? 1 : 16 };
    return { ...head, start: first * kPeriod_s, step: kPeriod_s, min: values, max: values };
  }
}

function scopeOn(ring: Ring, over: Partial<ScopeSettings> = {}): ScopeEngine {
  const ids: Record<string, number> = { a: 0, cycle: 1 };
  const settings: ScopeSettings = {
    ...firstSettings(),
    channels: ['cycle', 'a'],
    trigger: trigger({ kind: 'rising', level: 0.5 }),
    length_s: 0.1,
    before: 0.25,
    ...over,
  };
  const run = {
    period_s: () => kPeriod_s,
    newest: () => (ring.now < 0 ? Number.NaN : ring.now),
    reach_s: () => ring.claims * kPeriod_s,
    idOf: (name: string) => ids[name],
  };
  return new ScopeEngine(ring, run, settings, () => {});
}

/** Time goes on, a tick every `by` cycles. */
async function play(ring: Ring, scope: ScopeEngine, until: number, by = 33): Promise<void> {
  while (ring.now < until) {
    ring.now = Math.min(until, ring.now + by);
    scope.tick();
    await scope.settled();
  }
}

test('a spike of one cycle between two ticks is found, and its record has every cycle', async () => {
  const ring = new Ring(1000, (cycle) => Number(cycle === 517));
  const scope = scopeOn(ring);
  await play(ring, scope, 100);
  scope.arm();
  await play(ring, scope, 540);
  assert.equal(scope.state, 'filling');
  assert.ok(scope.filled > 0.4 && scope.filled < 0.6, String(scope.filled));
  await play(ring, scope, 700);
  assert.equal(scope.state, 'waiting');
  assert.equal(scope.captures.length, 1);
  const [capture] = scope.captures;
  assert.equal(capture.trigger, 517);
  assert.deepEqual([capture.first, capture.count], [492, 100]);
  const cycles = capture.channels.get('cycle') ?? [];
  assert.deepEqual([cycles[0], cycles[25], cycles[99]], [492, 517, 591]);
  assert.equal(capture.channels.get('a')?.[25], 1);
});

test('no trigger is missed between records, and none is in two', async () => {
  // Every 100 cycles: the record of 100 ends with the 75th, the next edge comes behind it.
  const ring = new Ring(1000, (cycle) => Number(cycle % 100 === 0));
  const scope = scopeOn(ring);
  ring.now = 10;
  scope.arm();
  await play(ring, scope, 1100, 61);
  assert.deepEqual(
    scope.captures.map((one) => one.trigger),
    [1000, 900, 800, 700, 600, 500, 400, 300, 200, 100],
  );
  assert.equal(scope.missed_s, 0);
});

test('a trigger within a record takes none; the first cycle behind it does', async () => {
  const ring = new Ring(1000, (cycle) => Number([100, 150, 175].includes(cycle)));
  const scope = scopeOn(ring);
  ring.now = 10;
  scope.arm();
  await play(ring, scope, 400);
  assert.deepEqual(
    scope.captures.map(({ trigger, first, count }) => [trigger, first, count]),
    [
      [175, 150, 100],
      [100, 75, 100],
    ],
  );
});

test('single takes one record, and then stands', async () => {
  const ring = new Ring(1000, (cycle) => Number(cycle % 100 === 0));
  const scope = scopeOn(ring, { mode: 'single' });
  ring.now = 10;
  scope.arm();
  await play(ring, scope, 900);
  assert.equal(scope.state, 'filled');
  assert.deepEqual(
    scope.captures.map((one) => one.trigger),
    [100],
  );
});

test('auto takes a record after a second without a trigger', async () => {
  const ring = new Ring(5000, () => 0);
  const scope = scopeOn(ring, { mode: 'auto' });
  ring.now = 0;
  scope.arm();
  await play(ring, scope, 990);
  assert.equal(scope.captures.length, 0);
  await play(ring, scope, 1100);
  assert.equal(scope.captures.length, 1);
  assert.equal(scope.captures[0].forced, true);
  assert.equal(scope.captures[0].count, 100);
});

test('while time stands a record can be forced; a step of time triggers', async () => {
  const ring = new Ring(1000, (cycle) => Number(cycle >= 305));
  const scope = scopeOn(ring, { mode: 'normal' });
  ring.now = 300;
  assert.equal(await scope.force(null), true);
  const [forced] = scope.captures;
  assert.deepEqual([forced.first, forced.first + forced.count - 1], [201, 300]);
  scope.arm();
  await scope.settled();
  for (let k = 0; k < 100; ++k) {
    ++ring.now;
    scope.tick();
    await scope.settled();
  }
  assert.equal(scope.captures.length, 2);
  assert.equal(scope.captures[0].trigger, 305);
});

test('what a slow link lost is counted, and the scope goes on', async () => {
  const ring = new Ring(200, (cycle) => Number(cycle === 900 || cycle === 150));
  const scope = scopeOn(ring);
  ring.now = 20;
  scope.arm();
  await scope.settled();
  ring.now = 800; // the link stood for 780 cycles, of which 200 are kept
  scope.tick();
  await scope.settled();
  assert.ok(scope.missed_s > 0.55 && scope.missed_s < 0.7, String(scope.missed_s));
  await play(ring, scope, 1000, 20);
  assert.equal(scope.captures[0].trigger, 900);
});

test('a run that keeps less than it said is asked less and less far back', async () => {
  const ring = new Ring(300, (cycle) => Number(cycle === 3000), 1000);
  const scope = scopeOn(ring);
  ring.now = 20;
  scope.arm();
  await scope.settled();
  ring.now = 2900;
  scope.tick();
  await scope.settled();
  assert.ok(ring.asked.length < 30, `${ring.asked.length} questions`);
  await play(ring, scope, 3200, 20);
  assert.equal(scope.captures[0].trigger, 3000);
});

test('a lost connection loses nothing that is still kept', async () => {
  const ring = new Ring(1000, (cycle) => Number(cycle === 150));
  const scope = scopeOn(ring);
  ring.now = 20;
  scope.arm();
  ring.linked = false;
  await play(ring, scope, 300);
  assert.equal(scope.captures.length, 0);
  ring.linked = true;
  await play(ring, scope, 350);
  assert.equal(scope.captures[0].trigger, 150);
  assert.equal(scope.missed_s, 0);
});

test('time that goes back begins the search anew', async () => {
  const ring = new Ring(1000, (cycle) => Number(cycle === 150));
  const scope = scopeOn(ring);
  ring.now = 500;
  scope.arm();
  await play(ring, scope, 550);
  ring.now = 0;
  scope.tick();
  await play(ring, scope, 300);
  assert.equal(scope.captures[0].trigger, 150);
  scope.stop();
  ring.now = 0;
  scope.tick();
  assert.equal(scope.state, 'stopped');
});

test('of a log the next and the last trigger are found, however far', async () => {
  const kEdges = [1000, 450000, 451000];
  const ring = new Ring(1e9, (cycle) => Number(kEdges.some((one) => Math.abs(cycle - one) < 3)));
  ring.now = 600000;
  const scope = scopeOn(ring);
  const find = async (from: number, forward: boolean) => {
    const found = await scope.find(from * kPeriod_s, forward);
    return found === null ? null : Math.round(found / kPeriod_s);
  };
  assert.equal(await find(-1, true), 998);
  assert.equal(await find(998, true), 449998);
  assert.equal(await find(449998, true), 450998);
  assert.equal(await find(450998, true), null);
  assert.equal(await find(600000, false), 450998);
  assert.equal(await find(450998, false), 449998);
  assert.equal(await find(449998, false), 998);
  assert.equal(await find(998, false), null);
  // An edge in the first cycle of the piece that is looked at.
  assert.equal(await find(998 + 200000, false), 998);
  assert.equal(await find(997, true), 998);
  assert.equal(scope.captures.length, 3);
  assert.equal(scope.captures[0].trigger, 998);
});

test('of a live run the last trigger is found as far back as it is kept', async () => {
  const ring = new Ring(1000, (cycle) => Number(cycle === 4000 || cycle === 4500));
  ring.now = 5200;
  const scope = scopeOn(ring);
  assert.equal(await scope.find(5.2, false), 4.5);
  assert.equal(await scope.find(4.5, false), null);
  assert.equal(scope.captures.length, 1);
  assert.equal(scope.missed_s, 0);
});

test('long records are asked for in pieces of full rate', async () => {
  const ring = new Ring(1e9, (cycle) => cycle);
  ring.now = 600000;
  const rows = await rowsOf(ring, [0, 1], 1000, 500000, kPeriod_s);
  assert.ok(rows && ring.asked.length > 2);
  assert.deepEqual([rows.first, rows.count], [1000, 499001]);
  assert.ok(rows.values[1].every((one, i) => one === Math.fround(1000 + i)));
});

test('settings of a layout; what is none there is as at first', () => {
  const own: ScopeSettings = {
    ...firstSettings(),
    channels: ['a', 'b'],
    trigger: trigger({ kind: 'outside', level: -1, upper: 2, hysteresis: 0.1 }),
    length_s: 2,
    before: 0.5,
    mode: 'single',
    overlay: 12,
    response: 'a',
    reference: 'b',
  };
  assert.deepEqual(readScope(JSON.parse(JSON.stringify(own))), own);
  assert.deepEqual(readScope(undefined), firstSettings());
  const odd = { channels: [1, 'a'], trigger: { kind: 'toString', level: 'x' }, overlay: 1e9 };
  assert.deepEqual(readScope(odd), { ...firstSettings(), channels: ['a'], overlay: 20 });
});

test('a layout has the settings of the oscilloscope, or none', () => {
  const layout = { version: 1, width_s: 10, panes: [] };
  assert.equal(readLayout(JSON.stringify(layout)).scope, undefined);
  const scope = { ...firstSettings(), channels: ['a'], before: 0.75 };
  assert.deepEqual(readLayout(JSON.stringify({ ...layout, scope })).scope, scope);
});

test('numbers of 32 bits are written with the digits that they need', () => {
  assert.equal(float32(Math.fround(0.1)), '0.1');
  assert.equal(float32(Number.NaN), '');
  for (const value of [1 / 3, -2e-30, 16777217, 0.49988598925, 6.02e23].map(Math.fround)) {
    assert.equal(Math.fround(Number(float32(value))), value);
  }
});

test('names of any kind are one cell', () => {
  assert.equal(csv(['a [m]', 'b,"c"'], [['1', '']]), 'a [m],"b,""c"""\r\n1,\r\n');
});
