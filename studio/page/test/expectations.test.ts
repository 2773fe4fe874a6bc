import assert from 'node:assert/strict';
import { test } from 'node:test';
import { type Expected, expectedWords, marginWords, standingOf } from '../src/expectations';

const one = (passed: boolean, margin: number | null, unit = 'Nm'): Expected => ({
  name: 'knee',
  passed,
  margin,
  unit,
  at_s: 1.5,
  reason: '',
  awaits: '',
  holds_so_far: false,
});

test('how many expectations hold is said', () => {
  assert.match(expectedWords([]), /expects nothing/);
  assert.equal(expectedWords([one(true, 1), one(true, 2)]), 'All 2 hold so far.');
  assert.equal(expectedWords([one(true, 1), one(false, -2)]), '1 of 2 hold so far.');
});

test('what is not decided is neither bad nor failed, until the run is over', () => {
  const awaits = (holds_so_far: boolean): Expected => ({
    ...one(false, null),
    reason: 'its window ends at 5 s, and the run ended at 2.1 s',
    awaits: 'its window ends at 5 s',
    holds_so_far,
  });
  for (const [holds, sort, word] of [
    [false, 'muted', '… not yet'],
    [true, 'good', '✓ holds'],
  ] as const) {
    const waiting = awaits(holds);
    assert.deepEqual(standingOf(waiting, false), { sort, word, why: waiting.awaits });
    const over = { sort: 'bad', word: '✗ does not', why: waiting.reason };
    assert.deepEqual(standingOf(waiting, true), over);
  }
  const failed = { ...one(false, -1), reason: 'it did not hold in 3 of 9 cycles' };
  assert.equal(standingOf(failed, false).sort, 'bad');
  const optional = { ...one(true, null), reason: 'did not come (optional)' };
  assert.equal(standingOf(optional, false).why, 'did not come (optional)');
  const mixed = [one(true, 1), one(false, -1), awaits(false)];
  assert.equal(expectedWords(mixed), '1 of 3 hold so far, 1 not yet.');
  assert.equal(expectedWords(mixed, true), '1 of 3 hold so far.');
});

test('a margin has its unit, and a dash where there is none', () => {
  assert.equal(marginWords(one(true, 24.512)), '24.51 Nm');
  assert.equal(marginWords(one(false, -0.5, '')), '-0.5');
  assert.equal(marginWords(one(true, null)), '–');
});
