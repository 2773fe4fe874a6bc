import assert from 'node:assert/strict';
import { test } from 'node:test';
import { emulationWords } from '../src/emulation';
import { Catalog } from '../src/signals';

const words = (synced: number, all_enabled: number, slipped: number, stands = false) =>
  emulationWords((field) => ({ synced, all_enabled, slipped })[field], stands);

test('an emulation says whether a master leads it, and whether it keeps up', () => {
  assert.equal(words(1, 1, 0), 'A master sends SYNC. All axes are enabled.');
  assert.match(words(0, 0, 0), /^No SYNC: .* Not all axes are enabled\.$/);
  assert.match(words(1, 1, 0, true), /^Time stands until a master sends SYNC\./);
  assert.match(words(1, 1, 7), /7 steps were left out/);
});

test('a joint is shown as the run has it, else as boards and plant do', () => {
  const source = (name: string, first: number, field: string) => ({
    name,
    first,
    fields: [{ name: field, unit: '', doc: '', type: 'f64', elements: ['knee', 'hip'], count: 2 }],
  });
  const emulation = new Catalog(1, [
    source('truth', 0, 'position_rad'),
    source('boards', 2, 'current_A'),
  ]);
  assert.equal(emulation.ofJoint('position_rad', 'hip')?.name, 'truth.position_rad.hip');
  assert.equal(emulation.ofJoint('current_A', 'knee')?.id, 2);
  assert.equal(emulation.ofJoint('mode', 'knee'), undefined);
  const run = new Catalog(1, [
    source('state', 0, 'position_rad'),
    source('truth', 2, 'position_rad'),
  ]);
  assert.equal(run.ofJoint('position_rad', 'hip')?.name, 'state.position_rad.hip');
});
