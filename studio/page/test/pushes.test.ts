import assert from 'node:assert/strict';
import { test } from 'node:test';
import { pushPoint } from '../src/pushes';

test('a push acts on its line, nearest to the centre of mass', () => {
  // 40 N along x at a point 0.3 m above the centre: M = r x F = (0, 12, 0).
  assert.deepEqual(pushPoint([0.1, 0.2, 0.5], [40, 0, 0], [0, 12, 0]), [0.1, 0.2, 0.8]);
  // A torque along the force is of no point.
  assert.deepEqual(pushPoint([0, 0, 1], [0, 0, -5], [0, 0, 3]), [0, 0, 1]);
  assert.equal(pushPoint([0, 0, 1], [0, 0, 0], [0, 0, 3]), null);
  assert.equal(pushPoint([Number.NaN, 0, 1], [1, 0, 0], [0, 0, 0]), null);
  assert.equal(pushPoint([], [], []), null);
});
