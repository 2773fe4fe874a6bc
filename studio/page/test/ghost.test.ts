// Ghosts beside the robot: whose signals they take, and where a prediction ends.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { postureIds } from '../src/ghost';
import { foreseen } from '../src/prediction';
import type { SourceTable } from '../src/protocol';
import { Catalog } from '../src/signals';

const field = (name: string, count: number, elements: string[] | null = null) => ({
  name,
  unit: '',
  doc: '',
  type: 'f64',
  elements,
  count,
});
const kRobot = { joints: ['hip', 'knee'], passive: ['bar'], floating: true };
const kRun = [{ state: 'parallel', base: ['parallel'] }];
const kLog = [{ state: 'B/state', base: ['B/truth', 'B/estimate'] }];

const catalogOf = (...sources: [string, ReturnType<typeof field>[]][]) => {
  const tables: SourceTable[] = [];
  let first = 0;
  for (const [name, fields] of sources) {
    tables.push({ name, first, fields });
    first += fields.reduce((sum, one) => sum + one.count, 0);
  }
  return new Catalog(1, tables);
};

test('a ghost takes joints by name, passive joints and the base of one source', () => {
  const catalog = catalogOf(
    ['state', [field('position_rad', 2, ['hip', 'knee'])]],
    [
      'parallel',
      [
        field('position_rad', 2, ['knee', 'hip']),
        field('passive_position_rad', 1),
        field('base_position_m', 3),
        field('base_quaternion', 4),
      ],
    ],
  );
  assert.deepEqual(postureIds(catalog, kRun, kRobot), {
    names: ['hip', 'knee', 'bar'],
    joints: [3, 2, 4],
    base: [5, 6, 7, 8, 9, 10, 11],
  });
  assert.deepEqual(postureIds(catalog, kRun, { ...kRobot, floating: false })?.base, []);
  assert.equal(postureIds(catalog, kLog, kRobot), null, 'no second log');
});

test('without a truth the base is that of the estimate, or nowhere', () => {
  const state: [string, ReturnType<typeof field>[]] = [
    'B/state',
    [field('position_rad', 1, ['knee'])],
  ];
  const base = [field('base_position_m', 3), field('base_quaternion', 4)];
  const estimated = postureIds(catalogOf(state, ['B/estimate', base]), kLog, kRobot);
  assert.deepEqual(estimated?.joints, [-1, 0, -1]);
  assert.deepEqual(estimated?.base, [1, 2, 3, 4, 5, 6, 7]);
  assert.deepEqual(postureIds(catalogOf(state), kLog, kRobot)?.base, []);
});

test('a prediction ends in its last row', () => {
  const joints = { knee: { slides: false, position_rad: [0.1, 0.4] } };
  const answer = { ok: true, from_s: 2, cycles: 1001, period_ns: 1e6, end: 'diverged', joints };
  const base = {
    position_m: [
      [0, 0, 1],
      [0, 0, 0.9],
    ],
    quaternion: [
      [0, 0, 0, 1],
      [0, 1, 0, 0],
    ],
  };
  const end = foreseen({ ...answer, base });
  assert.equal(end.time_s, 3);
  assert.equal(end.remark, 'diverged');
  assert.deepEqual([...end.joints], [['knee', 0.4]]);
  assert.deepEqual(end.base, [0, 0, 0.9, 0, 1, 0, 0]);
  const whole = { ...answer, end: 'horizon', base: null };
  assert.deepEqual(foreseen(whole).base, []);
  assert.equal(foreseen(whole).remark, '');
  assert.equal(
    foreseen({ ...whole, unarchived_controllers: ['a', 'b'] }).remark,
    'a, b began anew',
  );
});
