// The rows of the newest values.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { History } from '../src/history';
import type { Tick, Window } from '../src/protocol';

function tick(time: number, ...triples: number[]): Tick {
  return {
    paused: false,
    gap: false,
    revision: 1,
    lost: 0,
    cycle: Math.round(time * 1000),
    time,
    count: triples.length / 3,
    values: Float32Array.from(triples),
  };
}

test('ticks become rows; what is older than the capacity goes', () => {
  const history = new History(10, 1);
  history.track([4]);
  for (let i = 0; i < 100; ++i) history.push(tick(i, i - 1, i + 1, i), [4]);
  assert.equal(history.rows, 10);
  assert.equal(history.newest, 99);
  assert.equal(history.latest(4), 99);
  const rows = history.view(95, 98);
  assert.deepEqual([...rows.times], [95, 96, 97, 98]);
  assert.deepEqual([...rows.min(4)!], [94, 95, 96, 97]);
  assert.deepEqual([...rows.max(4)!], [96, 97, 98, 99]);
  assert.equal(history.at(4, 96.5), 96);
  assert.ok(Number.isNaN(history.at(4, 3)));
});

test('ticks close together share a row, and a spike in one of them is kept', () => {
  const history = new History(100, 90);
  history.track([1]);
  history.push(tick(0, 0, 0, 0), [1]);
  history.push(tick(0.2, 0, 50, 1), [1]);
  history.push(tick(0.4, 2, 2, 2), [1]);
  assert.equal(history.rows, 1);
  assert.deepEqual([...history.view(0, 1).max(1)!], [50]);
  assert.equal(history.latest(1), 2);
  history.push(tick(1.5, 3, 3, 3), [1]);
  assert.equal(history.rows, 2);
});

test('rows before the first tick are filled with what the run kept', () => {
  const history = new History(100, 9);
  history.track([1]);
  history.push(tick(5, 7, 7, 7), [1]);
  assert.equal(history.rows, 51);
  const step = 0.05;
  const rows = 100;
  const line = Float32Array.from({ length: rows }, (_, i) => i * step);
  const window: Window = {
    id: 1,
    level: 1,
    rows,
    cyclesPerRow: 16,
    start: 0,
    step,
    min: [line],
    max: [line],
  };
  history.fill([1], window);
  for (const time of [1, 2, 3.3, 4.5]) {
    assert.ok(Math.abs(history.at(1, time) - time) < 0.11, `at ${time}: ${history.at(1, time)}`);
  }
  assert.equal(history.latest(1), 7);
});

test('nothing is later than where time went back to', () => {
  const history = new History(100, 9);
  history.track([1]);
  history.push(tick(8, 1, 1, 1), [1]);
  history.push(tick(2, 5, 5, 5), [1]);
  assert.equal(history.newest, 2);
  assert.equal(history.latest(1), 5);
  assert.ok(history.view(0, 9).times.every((time) => time <= 2));
});

test('the newest value needs no column', () => {
  const history = new History(100, 9);
  history.push(tick(1, 1, 3, 2), [7]);
  assert.equal(history.latest(7), 2);
  assert.ok(Number.isNaN(history.at(7, 1)));
  assert.ok(Number.isNaN(history.latest(8)));
});

test('a signal that is added later has no values before', () => {
  const history = new History(100, 1);
  history.track([1]);
  history.push(tick(0, 1, 1, 1), [1]);
  assert.deepEqual(history.track([1, 2]), [2]);
  history.push(tick(1, 1, 1, 1, 2, 2, 2), [1, 2]);
  assert.deepEqual([...history.view(0, 1).last(2)!], [Number.NaN, 2]);
  assert.deepEqual(history.track([2]), []);
  assert.equal(history.has(1), false);
});
