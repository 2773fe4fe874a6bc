import assert from 'node:assert/strict';
import { test } from 'node:test';
import { overrunWords, placeOf } from '../src/loop';
import { loadWords } from '../src/loop_buses';
import { type Bin, columnsOf, decadesOf, histogramWords } from '../src/loop_histogram';
import { pressureCentre } from '../src/pressure';

test('a bar of the loop is logarithmic, from a thousandth of the period to ten', () => {
  assert.equal(placeOf(1e3, 1e6), 0);
  assert.equal(placeOf(1e6, 1e6), 0.75);
  assert.equal(placeOf(1e7, 1e6), 1);
  assert.equal(placeOf(9e9, 1e6), 1);
  assert.equal(placeOf(0, 1e6), 0);
});

test('overruns are said with the period', () => {
  assert.equal(overrunWords(0, 10, 1e6), 'None of 10 cycles overran; the period is 1000 µs.');
  assert.equal(overrunWords(3, 10, 1e6), '3 of 10 cycles overran; the period is 1000 µs.');
  assert.equal(overrunWords(0, 0, 1e6), 'no cycle yet');
});

test('buckets of the loop become columns, and words', () => {
  const bins: Bin[] = [
    [10000, 3],
    [10200, 4],
    [2000000, 1],
  ];
  const columns = columnsOf(bins);
  assert.deepEqual(columns, [
    [4, 7],
    [100 / 16, 1],
  ]);
  assert.ok(10 ** columns[1][0] <= 2e6, 'a column begins at or below what it holds');
  assert.deepEqual(decadesOf([bins], 1e6), [4, 7]);
  assert.deepEqual(decadesOf([[[0, 1]]], 1e6), [0, 7]);
  assert.equal(
    histogramWords([{ label: 'work', bins }], 1e6),
    'How often each time was how long. work: 8 cycles, half up to 10 µs, the longest up to 2000 µs, 1 beyond the period.',
  );
});

test('the load of a bus is said as measured and as planned', () => {
  const bus = { interface: 'can0', status: '', planned_load: 0.4, max_load: 0.8 };
  assert.equal(
    loadWords({ ...bus, load: 0.312, most_load: 0.55 }),
    'load 31.2 %, most of a cycle 55.0 %; planned 40.0 % of at most 80.0 %',
  );
  assert.equal(
    loadWords({ ...bus, load: null, most_load: null }),
    'load not measured; planned 40.0 % of at most 80.0 %',
  );
  assert.equal(loadWords({ interface: 'can0', status: '' }), '');
});

test('the centre of pressure lies between the feet as they carry', () => {
  const near = (found: number[] | null, wanted: number[]) =>
    wanted.forEach((value, i) => {
      assert.ok(Math.abs((found?.[i] ?? Number.NaN) - value) < 1e-12, String(found));
    });
  // Three quarters of the weight on the left foot.
  near(
    pressureCentre([0, 0.1, 0, 0, -0.1, 0], [0, 0, 300, 0, 0, 100], Array(6).fill(0), 0),
    [0, 0.05, 0],
  );
  // A foot that presses 2 cm before its origin, which is 10 cm above the ground, and is pushed
  // along x: M = r x F with r = (0.02, 0.01, -0.1).
  const [fx, fy, fz] = [20, -5, 200];
  const moment = [0.01 * fz + 0.1 * fy, -0.1 * fx - 0.02 * fz, 0.02 * fy - 0.01 * fx];
  near(pressureCentre([1, 2, 0.6], [fx, fy, fz], moment, 0.5), [1.02, 2.01, 0.5]);
  assert.equal(pressureCentre([0, 0, 0], [0, 0, 0], [0, 0, 0], 0), null);
  assert.equal(pressureCentre([0, 0, 0], [0, 0, Number.NaN], [0, 0, 0], 0), null);
});
