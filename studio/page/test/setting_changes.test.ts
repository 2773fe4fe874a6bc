import assert from 'node:assert/strict';
import { test } from 'node:test';
import { groupsOf, settingChanges } from '../src/setting_changes';

const event = (time_s: number, text: string, level = 'info') => ({
  time_s,
  cycle: 0,
  level,
  who: '',
  text,
});

test('what changes settings is known from a run and from a log; what was refused is not', () => {
  const found = settingChanges([
    event(4, 'request {"do":"joint.gains","joint":"j1","loop":"position","kd":0.5}'),
    event(1, 'parameter set: squat.depth_m = 0.1'),
    event(2, 'request {"do":"joint.gains","joint":"j1","kd":-1}: kd is negative', 'warn'),
    event(3, 'request {"do":"clock.pause"}'),
    event(5, 'started'),
    event(6, 'gains set of j1'),
  ]);
  assert.deepEqual(
    found.map(({ time_s }) => time_s),
    [1, 4, 6],
  );
  assert.equal(found[1].text, 'j1: gains of its position loop: kd 0.5');
});

test('captures are apart where something was set between them; one with both settings is mixed', () => {
  const capture = (first: number) => ({ trigger: first + 10, first, count: 100, period_s: 0.01 });
  const [a, b, c, d] = [0, 200, 400, 600].map(capture);
  const changes = [{ time_s: 4.5, text: 'kd' }];
  const { groups, mixed } = groupsOf([d, c, b, a], changes);
  assert.deepEqual(
    groups.map((one) => [one.change?.text ?? '', one.captures]),
    [
      ['kd', [d, c]],
      ['', [b, a]],
    ],
  );
  assert.deepEqual([...mixed], [c], 'half of it is before the change');
  assert.equal(groupsOf([d, c, b, a], []).groups.length, 1);
  const atItsEnd = groupsOf([a], [{ time_s: 0.99, text: 'kd' }]);
  assert.equal(atItsEnd.groups[0].change, null, 'it counts from the next cycle on');
  assert.equal(groupsOf([a], [{ time_s: 0.5, text: 'kd' }]).mixed.size, 1);
});
