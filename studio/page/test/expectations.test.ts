import assert from 'node:assert/strict';
import { test } from 'node:test';
import { type Expected, expectedWords, marginWords } from '../src/expectations';

const one = (passed: boolean, margin: number | null, unit = 'Nm'): Expected => ({
  name: 'knee',
  passed,
  margin,
  unit,
  at_s: 1.5,
  reason: '',
});

test('how many expectations hold is said', () => {
  assert.match(expectedWords([]), /expects nothing/);
  assert.equal(expectedWords([one(true, 1), one(true, 2)]), 'All 2 hold so far.');
  assert.equal(expectedWords([one(true, 1), one(false, -2)]), '1 of 2 hold so far.');
});

test('a margin has its unit, and a dash where there is none', () => {
  assert.equal(marginWords(one(true, 24.512)), '24.51 Nm');
  assert.equal(marginWords(one(false, -0.5, '')), '-0.5');
  assert.equal(marginWords(one(true, null)), '–');
});
