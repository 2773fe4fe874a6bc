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

test('what is not decided is neither bad nor failed, until the run is over', () => {
  const waits = (reason: string): Expected => ({ ...one(false, null), reason });
  const never = 'its window was never reached: ';
  const all: [string, string, string][] = [
    ['its controllers never started', '… not yet', 'its controllers have not started'],
    [`${never}it begins at 1 s, and the run ended at 0.4 s`, '… not yet', 'it begins at 1 s'],
    [`${never}'tilt() > 3deg' never held`, '… not yet', "it begins once 'tilt() > 3deg' holds"],
    ['its window ends at 5 s, and the run ended at 2.1 s', '✓ holds', 'its window ends at 5 s'],
    ['the run ended 0.2 s after its window began', '✓ holds', 'its window goes on'],
  ];
  for (const [reason, word, why] of all) {
    const { sort: _, ...now } = standingOf(waits(reason), false);
    assert.deepEqual(now, { word, why });
    const over = { sort: 'bad', word: '✗ does not', why: reason };
    assert.deepEqual(standingOf(waits(reason), true), over);
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
