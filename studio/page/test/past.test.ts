// Time that goes back: what the page forgets, and when the run can be taken where.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Data } from '../src/data';
import { History } from '../src/history';
import { pastWords, remembered, whyNotTo } from '../src/past';
import type { Tick } from '../src/protocol';
import type { Listener, Source } from '../src/source';

function tick(time: number, value: number): Tick {
  return {
    paused: false,
    gap: false,
    revision: 1,
    lost: 0,
    cycle: Math.round(time * 1000),
    time,
    count: 1,
    values: Float32Array.from([value, value, value]),
  };
}

const kPast = { keeps: true, checkpoints: 3, bytes: 2.5e6, budget_bytes: 64e6, from_s: 2 };

test('rows after the moment go, those before it stay, and the new branch follows', () => {
  const history = new History(1000, 60);
  history.track([7]);
  for (let i = 0; i <= 50; ++i) history.push(tick(5 + i / 10, i), [7]);
  history.push(tick(8, -1), [7]);
  assert.equal(history.newest, 8);
  assert.ok(Math.abs(history.at(7, 7.95) - 29) <= 1);
  history.push(tick(8.5, -2), [7]);
  const rows = history.view(7.5, 20);
  assert.ok(
    [...rows.last(7)!].every((one) => one <= 30),
    'nothing of what was taken back',
  );
  assert.deepEqual([...rows.times].slice(-2), [8, 8.5]);
  assert.deepEqual([...rows.last(7)!].slice(-2), [-1, -2]);
});

test('events, the selected time and a picture that stands go back with the run', () => {
  const listeners: Partial<Listener>[] = [];
  const source = { live: true, on: (one: Partial<Listener>) => listeners.push(one) };
  const data = new Data(source as unknown as Source);
  const each = (call: (one: Partial<Listener>) => void) => listeners.forEach(call);
  const event = (time_s: number, text: string) => ({
    time_s,
    cycle: Math.round(1000 * time_s),
    level: 'info',
    who: '',
    text,
  });
  const asked = 'request {"do": "controller.set"}';
  each((one) =>
    one.events?.([event(1, 'early'), event(2, asked), event(3, 'at'), event(3, asked)]),
  );
  each((one) => one.events?.([event(4, 'late')]));
  each((one) => one.tick?.(tick(5, 0)));
  data.time.select(4.5);
  data.time.freeze(4, 5);
  let told = 0;
  data.whenBack(() => ++told);
  each((one) => one.back?.({ time_s: 3, cycle: 3000, from_s: 5 }));
  assert.deepEqual(
    data.events.map((one) => one.text),
    ['early', asked, 'at'],
    'what was asked for at that moment had not been done',
  );
  assert.equal(data.time.selected, null);
  assert.equal(data.time.frozen, null);
  assert.equal(data.time.now, 3);
  assert.equal(told, 1);
  data.time.select(2);
  each((one) => one.back?.({ time_s: 2.5, cycle: 2500, from_s: 3 }));
  assert.equal(data.time.selected, 2, 'it is still there');
});

test('the robot can be taken to what is kept, and to nothing else', () => {
  assert.equal(whyNotTo(3, kPast, 5), '');
  assert.match(whyNotTo(null, kPast, 5), /Select a time/);
  assert.match(whyNotTo(1, kPast, 5), /2\.000 s/);
  assert.match(whyNotTo(5, kPast, 5), /not been yet/);
  assert.match(whyNotTo(3, { ...kPast, from_s: null }, 5), /Nothing is kept/);
  assert.match(whyNotTo(3, null, 5), /Nothing is kept/);
  assert.equal(pastWords(kPast), 'Kept from 2.000 s on: 2.5 MB of 64 MB.');
});

test('conditions are remembered once each, the newest first', () => {
  assert.deepEqual(remembered(['a', 'b'], 'b'), ['b', 'a']);
  assert.equal(remembered(['1', '2', '3', '4', '5', '6', '7', '8'], '9').length, 8);
});
