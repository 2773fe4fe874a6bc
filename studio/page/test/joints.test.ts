// What the table of joints says of values.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ageWords, figure } from '../src/joints';

test('what nobody has measured is no 0', () => {
  assert.equal(figure(Number.NaN, 'Nm'), '–');
  assert.equal(figure(0, 'Nm'), '0.00 Nm');
  assert.equal(ageWords(4294967295, false), 'never');
  assert.equal(ageWords(Number.NaN, false), '–');
  assert.equal(ageWords(0, true), 'fresh');
  assert.equal(ageWords(3, true), 'old, 3');
  assert.equal(ageWords(11, true), 'lost, 11');
});
