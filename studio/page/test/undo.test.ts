// A value that is set, told by the run, and taken back.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { toldAs } from '../src/controllers';
import { Setting } from '../src/undo';

test('a value that came from elsewhere, as after a rewind, is not undone into', () => {
  const setting = new Setting('12');
  setting.set('5', true);
  assert.equal(setting.former, '12');
  setting.tell('12');
  assert.equal(setting.wanted, '12');
  assert.equal(setting.former, undefined, 'time went back to before it was set');
  setting.set('5', true);
  setting.set('8', true);
  setting.tell('5');
  assert.equal(setting.former, '12', 'only what came after it was taken back');
  setting.tell('7');
  assert.equal(setting.former, undefined, 'somebody else set it');
});

test('what is asked for while time stands is not yet in force', () => {
  const setting = new Setting('12');
  setting.set('5', false);
  setting.tell('12');
  assert.deepEqual([setting.wanted, setting.inForce, setting.former], ['5', '12', '12']);
  setting.tell('5');
  assert.deepEqual([setting.asked, setting.inForce, setting.former], [null, '5', '12']);
  setting.undone('12', false);
  assert.deepEqual([setting.asked, setting.inForce, setting.former], ['12', '5', undefined]);
  setting.tell('3');
  assert.deepEqual([setting.wanted, setting.inForce], ['3', '3']);
});

test('a text is told as its value', () => {
  assert.equal(toldAs({ type: 'number', elements: [] }, '0.50'), '0.5');
  assert.equal(toldAs({ type: 'numbers', elements: ['a', 'b', 'c'] }, '40'), '40, 40, 40');
  assert.equal(toldAs({ type: 'numbers', elements: ['a', 'b'] }, '[1,2.0]'), '1, 2');
  assert.equal(toldAs({ type: 'choice', elements: [] }, 'sine'), 'sine');
});
