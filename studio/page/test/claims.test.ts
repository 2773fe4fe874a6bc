// What a controller has claimed, of a group and before a site.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { claimsOf } from '../src/claims';
import { jointsBefore } from '../src/limbs';

const kOwners: Record<string, string> = { hip: 'walk', knee: 'walk', wrist: 'wave' };
const controllerOf = (joint: string) => kOwners[joint] ?? '';

test('of a group the claimed joints are named apart, with who has them', () => {
  assert.deepEqual(claimsOf(['hip', 'elbow', 'knee', 'wrist'], controllerOf), {
    free: ['elbow'],
    words: 'Claimed by walk, wave: hip, knee, wrist.',
  });
  assert.deepEqual(claimsOf(['elbow'], controllerOf), { free: ['elbow'], words: '' });
  assert.deepEqual(claimsOf([], controllerOf), { free: [], words: '' });
});

test('a link is led by the joints between it and the root, each once', () => {
  const joint = (name: string, parent: string, child: string) => ({ name, parent, child });
  const tree = [
    joint('hip', 'base', 'thigh'),
    joint('knee', 'thigh', 'shank'),
    joint('sole', 'shank', 'foot'),
    joint('shoulder', 'base', 'arm'),
  ];
  assert.deepEqual(jointsBefore('foot', tree), ['sole', 'knee', 'hip']);
  assert.deepEqual(jointsBefore('arm', tree), ['shoulder']);
  assert.deepEqual(jointsBefore('base', tree), []);
  assert.deepEqual(jointsBefore('nowhere', tree), []);
  const ring = [joint('a', 'one', 'two'), joint('b', 'two', 'one')];
  assert.deepEqual(jointsBefore('two', ring), ['a', 'b']);
});
