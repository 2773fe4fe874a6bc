import assert from 'node:assert/strict';
import { test } from 'node:test';
import { heightAt, patchWords } from '../src/ground';
import { centreOn } from '../src/pressure';

// A ramp along x from 0 to 2, of 0.5; a step along y.
const kTerrain = {
  x_m: [-1, 0, 2],
  y_m: [0, 1],
  height_m: [0, 0, 1, 0.2, 0.2, 1.2],
  coarser: false,
};

test('the ground is as high as the run says, and straight between its heights', () => {
  assert.equal(heightAt(kTerrain, 2, 1), 1.2);
  assert.equal(heightAt(kTerrain, 1, 0), 0.5);
  assert.ok(Math.abs(heightAt(kTerrain, 1, 0.5) - 0.6) < 1e-12);
  assert.equal(heightAt(kTerrain, 99, -99), 1, 'beyond its ends as at them');
});

test('a patch says its friction', () => {
  const patch = {
    name: 'ice',
    x_m: [0, 1],
    y_m: [0, 1],
    static_friction: 0.12,
    sliding_friction: 0.1,
    stiffness_share: 0.5,
  };
  assert.equal(patchWords(patch), 'ice: friction 0.12, sliding 0.1, 50 % stiff');
});

test('the centre of pressure is on the ground, wherever that is', () => {
  const slope = (x: number) => 0.1 * x;
  // One foot at the slope, whose force leans: its line meets the ground in the foot.
  const at = centreOn(slope, [2, 0, 0.2], [-10, 0, 100], [0, 0, 0]);
  assert.ok(at);
  assert.ok(Math.hypot(at[0] - 2, at[1], at[2] - 0.2) < 1e-3, String(at));
});
