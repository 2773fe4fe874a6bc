import assert from 'node:assert/strict';
import { test } from 'node:test';
import { lines, otherModes, type ShadowJoint, switchWords } from '../src/shadows';

const reference = (name: string, largest: number | null) => ({
  name,
  unit: 'rad',
  difference: largest,
  largest,
  largest_step: 0,
});
const joint = (name: string, more: Partial<ShadowJoint> = {}): ShadowJoint => ({
  joint: name,
  owner: 'squat',
  mode: 'position',
  commanded_mode: 'position',
  interaction: 'stiff',
  commanded_interaction: 'stiff',
  references: [reference('position_rad', 0), reference('torque_Nm', 0)],
  ...more,
});

test('a joint has a line for the reference that leads, and for others that ever differed', () => {
  const knee = joint('knee', {
    references: [
      reference('position_rad', 0),
      reference('velocity_rad_s', 0),
      reference('torque_Nm', null),
    ],
  });
  const names = lines([joint('hip'), knee]).map(([of, one]) => `${of.joint} ${one.name}`);
  assert.deepEqual(names, ['hip position_rad', 'knee position_rad', 'knee torque_Nm']);
});

test('another mode is said, and what became of a switch', () => {
  assert.deepEqual(otherModes([joint('hip'), joint('knee', { mode: 'torque' })]), [
    'knee: stiff torque instead of stiff position',
  ]);
  const last = { state: 'time out', joint: 'knee', difference: 0.25, unit: 'rad' };
  assert.equal(
    switchWords(last),
    'Nothing has changed: no agreement in time, at last 0.2500 rad at knee',
  );
  assert.equal(
    switchWords({ ...last, state: 'waits', difference: null }),
    'The switch waits: another mode at knee',
  );
  assert.equal(switchWords(null), '');
});
