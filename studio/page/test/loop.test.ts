import assert from 'node:assert/strict';
import { test } from 'node:test';
import { overrunWords, placeOf } from '../src/loop';
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
