// Names of signals, and the search in them.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { Field } from '../src/protocol';
import { Catalog, unitOf, wordsOf } from '../src/signals';

const field = (name: string, unit: string, doc: string, elements: string[] | null, type = 'f64') =>
  ({ name, unit, doc, type, elements, count: elements?.length ?? 1 }) satisfies Field;
const kJoints = ['LKneeSag', 'RKneeSag', 'LElbj'];
const catalog = new Catalog(3, [
  {
    name: 'state',
    first: 0,
    fields: [
      field('cycle', '', 'number of the cycle', null, 'u64'),
      field('position_rad', 'rad or m', 'link side', kJoints),
      field('torque_Nm', 'Nm or N', 'of the spring on the link', kJoints),
      field('mode', '', 'as the drive says', kJoints, 'i8'),
    ],
  },
  { name: 'controller/squat', first: 100, fields: [field('depth', 'm', 'below its start', null)] },
]);

test('ids count over the fields, names join source, field and element', () => {
  assert.equal(catalog.named('state.cycle')?.id, 0);
  assert.equal(catalog.named('state.torque_Nm.RKneeSag')?.id, 5);
  assert.equal(catalog.named('controller/squat.depth')?.id, 100);
  assert.equal(catalog.withId(7)?.name, 'state.mode.LKneeSag');
  assert.deepEqual(catalog.idsOf('state', 'position_rad'), [1, 2, 3]);
});

test('words in any order find a signal by its name', () => {
  const names = (query: string) => catalog.search(query).map((signal) => signal.name);
  assert.deepEqual(names('knee torque'), ['state.torque_Nm.LKneeSag', 'state.torque_Nm.RKneeSag']);
  assert.deepEqual(names('TORQUE lknee'), ['state.torque_Nm.LKneeSag']);
  assert.deepEqual(names('  '), []);
  assert.deepEqual(names('knee nothing'), []);
});

test('meaning and unit are searched, too, after names', () => {
  assert.equal(catalog.search('spring')[0].field, 'torque_Nm');
  assert.equal(catalog.search('depth')[0].name, 'controller/squat.depth');
  assert.deepEqual(
    catalog.search('below start').map((signal) => signal.name),
    ['controller/squat.depth'],
  );
  assert.equal(catalog.search('position')[0].field, 'position_rad');
});

test('words of names', () => {
  assert.deepEqual(wordsOf('state.torque_Nm.LKneeSag'), [
    'state',
    'torque',
    'nm',
    'l',
    'knee',
    'sag',
  ]);
  assert.deepEqual(wordsOf('l_shoulder_pitch'), ['l', 'shoulder', 'pitch']);
});

test('a name is found in capital and in small letters', () => {
  assert.equal(catalog.named('state.torque_nm.lkneesag')?.name, 'state.torque_Nm.LKneeSag');
  assert.deepEqual(catalog.idsOf('state', 'torque_nm'), [4, 5, 6]);
});

test('modes and states are lanes, numbers are not', () => {
  assert.equal(catalog.named('state.mode.LElbj')?.lane, true);
  assert.equal(catalog.named('state.position_rad.LElbj')?.lane, false);
});

test("a joint's numbers have the unit of its kind", () => {
  const joints = [
    { name: 'LKneeSag', unit: 'rad' },
    { name: 'RKneeSag', unit: 'm' },
  ];
  const state = {
    name: 'state',
    first: 0,
    fields: [
      field('position_rad', 'rad or m', '', ['LKneeSag', 'RKneeSag']),
      field('torque_Nm', 'Nm or N', '', ['LKneeSag', 'RKneeSag']),
      field('norm', 'Nm or N', 'of them all', null),
    ],
  };
  const units = (of: { name: string; unit: string }[]) =>
    new Catalog(1, [state], of).signals.map((signal) => signal.unit);
  assert.deepEqual(units(joints), ['rad', 'm', 'Nm', 'N', 'Nm or N']);
  assert.deepEqual(units([joints[0]]), ['rad', 'rad', 'Nm', 'Nm', 'Nm']);
  assert.deepEqual(units([]), ['rad or m', 'rad or m', 'Nm or N', 'Nm or N', 'Nm or N']);
  assert.equal(unitOf('rad/s2 or m/s2', 'RKneeSag', joints), 'm/s2');
  assert.equal(unitOf('V', 'RKneeSag', joints), 'V');
});
