// The decoders, against bytes written by hand.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decodeTick, decodeWindow } from '../src/protocol';

function bytes(hex: string): ArrayBuffer {
  const list = hex
    .trim()
    .split(/\s+/)
    .map((one) => Number.parseInt(one, 16));
  return new Uint8Array(list).buffer;
}

// Paused, revision 7, 2 frames lost, 1 signal, cycle 1000, 1.0 s; min -1, max 2.5, last 0.5.
const kTick = `01 01 00 00  07 00 00 00  02 00 00 00  01 00 00 00
  e8 03 00 00 00 00 00 00  00 00 00 00 00 00 f0 3f
  00 00 80 bf  00 00 20 40  00 00 00 3f`;

// Level 1, one signal, id 5, 2 rows of 16 cycles from 2 s, 0.016 s apart; (1, 2) and no value.
const kPairs = `02 01 01 00  05 00 00 00  02 00 00 00  10 00 00 00
  00 00 00 00 00 00 00 40  fc a9 f1 d2 4d 62 90 3f
  00 00 80 3f  00 00 00 40  00 00 c0 7f  00 00 c0 7f`;

// Level 0, two signals, id 6, one row of one cycle: 1 and 2.
const kSingle = `02 00 02 00  06 00 00 00  01 00 00 00  01 00 00 00
  00 00 00 00 00 00 00 40  fc a9 f1 d2 4d 62 50 3f
  00 00 80 3f  00 00 00 40`;

test('a tick has its head and three values per signal', () => {
  const tick = decodeTick(bytes(kTick));
  assert.equal(tick.paused, true);
  assert.equal(tick.gap, false);
  assert.equal(tick.revision, 7);
  assert.equal(tick.lost, 2);
  assert.equal(tick.cycle, 1000);
  assert.equal(tick.time, 1);
  assert.deepEqual([...tick.values], [-1, 2.5, 0.5]);
});

test('a window of several cycles per row has pairs', () => {
  const window = decodeWindow(bytes(kPairs));
  assert.equal(window.id, 5);
  assert.equal(window.level, 1);
  assert.equal(window.cyclesPerRow, 16);
  assert.equal(window.start, 2);
  assert.ok(Math.abs(window.step - 0.016) < 1e-15);
  assert.deepEqual([...window.min[0]], [1, Number.NaN]);
  assert.deepEqual([...window.max[0]], [2, Number.NaN]);
});

test('a window of one cycle per row has single values', () => {
  const window = decodeWindow(bytes(kSingle));
  assert.deepEqual([...window.min[0]], [1]);
  assert.deepEqual([...window.max[1]], [2]);
});

test('frames that were cut off, or are of another kind, are refused', () => {
  const tick = bytes(kTick);
  for (let size = 0; size < tick.byteLength; ++size) {
    assert.throws(() => decodeTick(tick.slice(0, size)), /bytes/);
  }
  const window = bytes(kPairs);
  for (let size = 0; size < window.byteLength; ++size) {
    assert.throws(() => decodeWindow(window.slice(0, size)), /bytes/);
  }
  assert.throws(() => decodeTick(window), /no tick/);
  assert.throws(() => decodeWindow(tick), /no window/);
});
