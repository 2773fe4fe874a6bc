import assert from 'node:assert/strict';
import { test } from 'node:test';
import { uncut } from '../src/axes';

test('a label that the end of the picture would cut is left out', () => {
  const labels = ['310 s', '320 s', '330 s'];
  assert.deepEqual(uncut(labels, [100, 300, 500], [32, 32, 32], 516), labels);
  assert.deepEqual(uncut(labels, [100, 300, 500], [32, 32, 32], 515), ['310 s', '320 s', '']);
});
