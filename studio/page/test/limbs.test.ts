// Which limb a joint belongs to: names of real robots, and trees without telling names.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { limbByName, limbsOf } from '../src/limbs';

test('names of COMAN, iCub, ANYmal and Walk-Man', () => {
  const expected: Record<string, string> = {
    LKneeSag: 'left leg',
    RAnkLat: 'right leg',
    LHipYaw: 'left leg',
    WaistYaw: 'waist',
    RShSag: 'right arm',
    LElbj: 'left arm',
    RForearmPlate: 'right arm',
    LWrj2: 'left arm',
    NeckYawj: 'neck',
    l_shoulder_pitch: 'left arm',
    r_wrist_prosup: 'right arm',
    torso_roll: 'waist',
    neck_pitch: 'neck',
    l_ankle_roll: 'left leg',
    LF_HAA: 'left front leg',
    RH_KFE: 'right hind leg',
    panda_joint1: '',
    panda_finger_joint1: 'hand',
    crank: '',
    elbow_joint: 'arm',
  };
  for (const [name, limb] of Object.entries(expected)) assert.equal(limbByName(name), limb, name);
});

const link = (name: string, parent: string, child: string) => ({ name, parent, child });

test('a chain without telling names is one group', () => {
  const tree = [link('a', '0', '1'), link('b', '1', '2'), link('c', '2', '3')];
  assert.deepEqual(limbsOf(['a', 'b', 'c'], tree), [{ name: 'joints', joints: ['a', 'b', 'c'] }]);
});

test('branches are groups, through joints that do not move', () => {
  const tree = [
    link('m1', 'base', 'p'),
    link('fixed', 'p', 'q'),
    link('m2', 'q', 'r'),
    link('m3', 'base', 's'),
  ];
  assert.deepEqual(limbsOf(['m1', 'm2', 'm3'], tree), [
    { name: 'from m1', joints: ['m1', 'm2'] },
    { name: 'from m3', joints: ['m3'] },
  ]);
});

test('a joint without a telling name belongs to the limb that it hangs on', () => {
  const tree = [link('LWrj1', 'a', 'b'), link('x7', 'b', 'c')];
  assert.deepEqual(limbsOf(['LWrj1', 'x7'], tree), [{ name: 'left arm', joints: ['LWrj1', 'x7'] }]);
});

test('a tree that is a ring ends', () => {
  const tree = [link('a', '2', '1'), link('b', '1', '2')];
  const joints = limbsOf(['a', 'b'], tree).flatMap((limb) => limb.joints);
  assert.deepEqual(joints.sort(), ['a', 'b']);
});
