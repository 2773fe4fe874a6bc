import assert from 'node:assert/strict';
import { test } from 'node:test';
import { digits, duration, fixed, number, plain, seconds, short, tick } from '../src/format';
import { figure } from '../src/joints';

test('what rounds to zero has no sign', () => {
  assert.equal(fixed(-0.0004, 3), '0.000');
  assert.equal(fixed(-0.0006, 3), '-0.001');
  assert.equal(figure(-0.001, 'Nm'), '0.00 Nm');
  for (const text of [
    short(-0.001),
    seconds(-1e-5),
    plain(-0),
    tick(-0),
    number(-0),
    digits(-0, 5),
  ])
    assert.doesNotMatch(text, /-/);
});

test('figures have so many digits at most, and no more', () => {
  assert.equal(digits(123.456789, 5), '123.46');
  assert.equal(digits(0.5, 5), '0.5');
  assert.equal(digits(0.00123456, 4), '0.001235');
  assert.equal(digits(1234567, 5), '1.23e+6');
  assert.equal(digits(Number.NaN, 5), '–');
  assert.ok(number(123456.7).replace(/\D/g, '').length <= 6);
});

test('a time has the unit that suits it', () => {
  assert.equal(duration(0.709), '709 ms');
  assert.equal(duration(0.0123456), '12.35 ms');
  assert.equal(duration(1.25), '1.25 s');
  assert.equal(duration(3.2e-5), '32 µs');
  assert.equal(duration(0), '0 s');
});
