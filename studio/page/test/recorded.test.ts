// What the recording of a log becomes again: report/packing.hpp is the other side.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { deflateSync } from 'node:zlib';
import type { Hello, Window } from '../src/protocol';
import { type Code, type Grid, inflate, RecordedSource, unpack } from '../src/recorded';
import { Catalog } from '../src/signals';
import type { Source } from '../src/source';
import { TimeModel } from '../src/time';
import { colourOf, withTwins } from '../src/twins';

const grid = (rows: number, cycles = 1): Grid => ({ start_s: 2, step_s: 0.5, rows, cycles });

test('unpacks the codes of a signal: literal bytes', () => {
  // Codes 1, 3, 2, gap, 0: steps +1, +2, -1, -3 (to 65535), +1; folded 2, 4, 1, 5, 2.
  const bytes = Uint8Array.from([9, 2, 4, 1, 5, 2, 0, 0, 0, 0, 0]);
  const { min, max } = unpack([10, 0.5, 2], bytes, 1, grid(5));
  assert.deepEqual([...min], [10.5, 11.5, 11, Number.NaN, 10]);
  assert.equal(max, min);
  // Two cycles a row: the largest is 0 and 300 codes above the least.
  const pairs = Uint8Array.from([2, 4, 0, 0, 0, 44, 0, 1]);
  const found = unpack([0, 1, 2], pairs, 0, grid(2, 2));
  assert.deepEqual([...found.min], [1, 3]);
  assert.deepEqual([...found.max], [1, 303]);
  // Three bytes: 70000 is folded to 140000 = 0x0222E0.
  assert.deepEqual(
    [...unpack([5, 1, 3], Uint8Array.from([0xe0, 0x22, 2]), 0, grid(1)).min],
    [70005],
  );
  assert.deepEqual([...unpack(7, bytes, 0, grid(2)).min], [7, 7]);
  assert.ok(Number.isNaN(unpack(null, bytes, 0, grid(1)).min[0]));
});

test('inflates what zlib has deflated', async () => {
  const packed = deflateSync(new TextEncoder().encode('some bytes')).toString('base64');
  assert.equal(Buffer.from(await inflate(packed)).toString(), 'some bytes');
});

const play = async (
  codes: Code[],
  bytes: number[],
  where: Grid,
  finer: Source['window'] | null = null,
) => {
  const source = new RecordedSource(
    {
      format: 1,
      hello: {} as Hello,
      signals: { sources: [] },
      events: { events: [] },
      urdf: '',
      figures: [],
      logs: [],
      at_s: where.start_s,
      grid: where,
      codes,
      data: deflateSync(Uint8Array.from(bytes)).toString('base64'),
    },
    finer,
  );
  await source.open();
  return source;
};

test('asks who serves the log for each cycle, where so many rows may be given', async () => {
  const asked: number[] = [];
  const served = { rows: 7 } as Window;
  const finer = async (_: number[], from: number) => {
    asked.push(from);
    return served;
  };
  const where = { ...grid(1000), cycles: 2 };
  const source = await play([0], [], where, finer);
  // As the oscilloscope asks: for every cycle of 1000 rows of two cycles.
  const span = 1000 * where.step_s;
  const points = Math.ceil((2000 + 2) / 4);
  assert.equal(await source.window([0], where.start_s, where.start_s + span, points), served);
  assert.notEqual(await source.window([0], where.start_s, where.start_s + span, 100), served);
  assert.deepEqual(asked, [where.start_s]);
});

test('answers windows, and ticks at the time that is sought', async () => {
  const source = await play([[0, 1, 2], 4], [2, 2, 2, 2, 0, 0, 0, 0], grid(4));
  const window = await source.window([0, 1], 2.5, 3, 100);
  assert.deepEqual([...window.min[0]], [2, 3]);
  assert.equal(window.start, 2.5);
  assert.equal(window.cyclesPerRow, 1);
  const merged = await source.window([0], 0, 99, 0.5);
  assert.deepEqual([merged.rows, merged.cyclesPerRow, merged.step], [1, 4, 2]);
  assert.deepEqual([merged.min[0][0], merged.max[0][0]], [1, 4]);
  const seen: number[][] = [];
  source.on({ tick: (tick) => seen.push([tick.time, tick.cycle, ...tick.values]) });
  source.subscribe(3, [0]);
  await Promise.resolve();
  source.seek(3.2);
  source.seek(99);
  assert.deepEqual(seen, [
    [2, 0, 1, 1, 1],
    [3.2, 2, 3, 3, 3],
    [3.5, 3, 4, 4, 4],
  ]);
  assert.equal((await source.ask()).ok, false);
});

test('keeps the whole of a recording in view', () => {
  const time = new TimeModel();
  time.whole = { from: 1, to: 9 };
  time.follow();
  assert.deepEqual(time.span(), { from: 1, to: 9 });
  time.select(20);
  assert.equal(time.selected, 9);
  time.select(null);
  assert.equal(time.selected, 9, 'there is no now');
});

test('lays the same signals of other logs over the first, in its colour', () => {
  const field = { name: 'q', unit: '', doc: '', type: 'f64', elements: null, count: 1 };
  const catalog = new Catalog(1, [
    { name: 'state', first: 0, fields: [field, { ...field, name: 'only' }] },
    { name: 'B/state', first: 2, fields: [field] },
  ]);
  const list = withTwins(
    [
      { kind: 'signal', name: 'state.q' },
      { kind: 'signal', name: 'state.only' },
    ],
    catalog,
  );
  assert.deepEqual(
    list.map((one) => one.name),
    ['state.q', 'B/state.q', 'state.only'],
  );
  assert.deepEqual(
    list.map((one) => colourOf(one, list)),
    [0, 0, 1],
  );
  assert.deepEqual(withTwins(list, catalog), list);
});
