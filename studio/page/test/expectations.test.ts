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
});

test('how many expectations hold is said', () => {
  assert.match(expectedWords([]), /expects nothing/);
  assert.equal(expectedWords([one(true, 1), one(true, 2)]), 'All 2 hold so far.');
  assert.equal(expectedWords([one(true, 1), one(false, -2)]), '1 of 2 hold so far.');
});

test('what has not begun is neither good nor bad, until the run is over', () => {
  const waits = (reason: string): Expected => ({ ...one(false, null), reason });
  const all: [string, string][] = [
    ['its controllers never started', 'its controllers have not started'],
    [
      'its window was never reached: it begins at 1 s, and the run ended at 0.4 s',
      'it begins at 1 s',
    ],
    [
      "its window was never reached: 'tilt() > 3deg' never held",
      "it begins once 'tilt() > 3deg' holds",
    ],
  ];
  for (const [reason, why] of all) {
    assert.deepEqual(standingOf(waits(reason), false), { sort: 'muted', word: '… not yet', why });
    assert.deepEqual(standingOf(waits(reason), true), {
      sort: 'bad',
      word: '✗ does not',
      why: reason,
    });
  }
  assert.equal(standingOf(waits('it did not hold in 3 of 9 cycles'), false).sort, 'bad');
  const mixed = [one(true, 1), one(false, -1), waits(all[0][0])];
  assert.equal(expectedWords(mixed), '1 of 3 hold so far, 1 not begun.');
  assert.equal(expectedWords(mixed, true), '1 of 3 hold so far.');
});

test('a margin has its unit, and a dash where there is none', () => {
  assert.equal(marginWords(one(true, 24.512)), '24.51 Nm');
  assert.equal(marginWords(one(false, -0.5, '')), '-0.5');
  assert.equal(marginWords(one(true, null)), '–');
});
