// Statistics, derivatives and differences, against figures worked out by hand.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { derivative, evaluate, unitOf } from '../src/series';
import { Catalog } from '../src/signals';
import { statistics } from '../src/statistics';

const near = (a: number, b: number, by = 1e-12) =>
  assert.ok(Math.abs(a - b) <= by, `${a}, not ${b}`);

test('statistics of 2, 4, 4, 4, 5, 5, 7, 9', () => {
  const found = statistics([2, 4, 4, 4, 5, 5, 7, 9]);
  assert.equal(found.min, 2);
  assert.equal(found.max, 9);
  near(found.mean, 5);
  near(found.std, 2);
  near(found.rms, Math.sqrt(29));
});

test('a large mean does not hide a small spread', () => {
  near(statistics([1e8, 1e8 + 1, 1e8 + 2]).std, Math.sqrt(2 / 3), 1e-6);
});

test('rows without a value do not count, extremes are those of the bands', () => {
  const found = statistics([Number.NaN, 1, 3], [Number.NaN, -5, 3], [Number.NaN, 1, 30]);
  assert.equal(found.count, 2);
  assert.equal(found.min, -5);
  assert.equal(found.max, 30);
  near(found.mean, 2);
  assert.ok(Number.isNaN(statistics([]).mean));
});

test('the derivative of a square is exact inside', () => {
  const times = [0, 1, 2, 3, 4];
  const slope = derivative(
    times,
    times.map((t) => t * t),
  );
  assert.deepEqual([...slope], [1, 2, 4, 6, 7]);
});

test('the derivative leaves out rows without a value and without time', () => {
  const slope = derivative([0, 1, 2, 2], [0, Number.NaN, 4, 4]);
  assert.deepEqual([...slope], [Number.NaN, Number.NaN, Number.NaN, Number.NaN]);
});

test('a difference has the widest band that its signals allow', () => {
  const curves: Record<string, { min: number[]; max: number[]; middle: number[] }> = {
    a: { min: [1], max: [3], middle: [2] },
    b: { min: [0], max: [1], middle: [0.5] },
  };
  const found = evaluate(
    { kind: 'difference', name: 'a', minus: 'b' },
    [0],
    (name) => curves[name],
  );
  assert.deepEqual([found?.min[0], found?.max[0], found?.middle[0]], [0, 3, 1.5]);
});

test('units of derivatives', () => {
  const of = (unit: string) =>
    unitOf(
      { kind: 'derivative', name: 'x.y' },
      new Catalog(1, [
        {
          name: 'x',
          first: 0,
          fields: [{ name: 'y', unit, doc: '', type: 'f64', elements: null, count: 1 }],
        },
      ]),
    );
  assert.equal(of('rad'), 'rad/s');
  assert.equal(of('rad/s or m/s'), 'rad/s2 or m/s2');
  assert.equal(of(''), '1/s');
});
