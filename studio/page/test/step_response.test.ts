// Figures of step responses, against the analytic ones of first- and second-order systems.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { type StepInput, spreadOf, stepFigures } from '../src/step_response';

const kStep_s = 0.001;
const near = (a: number, b: number, by: number, what = '') =>
  assert.ok(Math.abs(a - b) <= by, `${what} ${a}, not ${b}`);

/** Rows from before_s before a step to after_s after it. */
function rows(before_s: number, after_s: number, value: (t: number) => number): Float32Array {
  const before = Math.round(before_s / kStep_s);
  const count = before + Math.round(after_s / kStep_s) + 1;
  return Float32Array.from({ length: count }, (_, i) => value((i - before) * kStep_s));
}

/** Unit step of a second-order system; zeta < 1. */
function secondOrder(zeta: number, omega: number): (t: number) => number {
  const root = Math.sqrt(1 - zeta * zeta);
  return (t) =>
    t <= 0
      ? 0
      : 1 - (Math.exp(-zeta * omega * t) * Math.sin(omega * root * t + Math.acos(zeta))) / root;
}

/** The time since which a function stays within a band about 1, found by its values alone. */
function settled(y: (t: number) => number, band: number, until: number): number {
  let t = until;
  while (t > 0 && Math.abs(y(t) - 1) <= band) t -= 1e-6;
  return t;
}
/** The first time at which a function has a value. */
function reached(y: (t: number) => number, value: number): number {
  let [low, high] = [0, 0];
  while (y(high) < value) high += 1e-3;
  low = high - 1e-3;
  while (high - low > 1e-9) {
    const middle = (low + high) / 2;
    if (y(middle) < value) low = middle;
    else high = middle;
  }
  return high;
}

const kBefore_s = 0.1;
const kTrigger = 100;
const input = (response: Float32Array, reference: Float32Array | null = null): StepInput => ({
  step_s: kStep_s,
  trigger: kTrigger,
  response,
  reference,
});
/** Reproducible noise of about the normal distribution. */
function noise(sigma: number): () => number {
  let seed = 12345;
  const next = () => {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    return seed / 2 ** 32;
  };
  return () => {
    let sum = -6;
    for (let i = 0; i < 12; ++i) sum += next();
    return sigma * sum;
  };
}

for (const zeta of [0.2, 0.4, 0.6, 0.8]) {
  for (const [from, to] of [
    [0, 1],
    [0.5, -1.5],
  ]) {
    test(`second order, zeta ${zeta}, from ${from} to ${to}`, () => {
      const omega = 25;
      const y = secondOrder(zeta, omega);
      const after_s = 10 / (zeta * omega);
      const response = rows(kBefore_s, after_s, (t) => from + (to - from) * y(t));
      const reference = rows(kBefore_s, after_s, (t) => (t < 0 ? from : to + 0.25));
      for (const known of [null, reference]) {
        const found = stepFigures(input(response, known));
        const root = Math.sqrt(1 - zeta * zeta);
        assert.equal(found.words, '');
        near(found.change, to - from, 2e-3, 'change');
        near(found.overshoot, Math.exp((-Math.PI * zeta) / root), 2e-3, 'overshoot');
        near(found.peak_s, Math.PI / (omega * root), kStep_s, 'peak time');
        near(found.rise_s, reached(y, 0.9) - reached(y, 0.1), 1e-3 * kStep_s + 2e-4, 'rise time');
        near(found.settling2_s, settled(y, 0.02, after_s), 2e-3, 'settling to 2 %');
        near(found.settling5_s, settled(y, 0.05, after_s), 2e-3, 'settling to 5 %');
        if (known) near(found.error, 0.25, 2e-3, 'error');
        else assert.ok(Number.isNaN(found.error));
      }
    });
  }
}

test('first order: ln 9, ln 20 and ln 50 time constants, and no overshoot', () => {
  const tau = 0.05;
  const found = stepFigures(
    input(rows(kBefore_s, 10 * tau, (t) => (t < 0 ? 3 : 3 + 2 * (1 - Math.exp(-t / tau))))),
  );
  near(found.rise_s, tau * Math.log(9), 5e-4);
  near(found.settling5_s, tau * Math.log(20), 5e-4);
  near(found.settling2_s, tau * Math.log(50), 1e-3);
  assert.equal(found.overshoot, 0);
  assert.ok(Number.isNaN(found.peak_s));
});

test('noise changes the figures little, and makes no overshoot', () => {
  const some = noise(0.004);
  const y = secondOrder(0.4, 25);
  const found = stepFigures(input(rows(kBefore_s, 1, (t) => y(t) + some())));
  near(found.overshoot, Math.exp((-Math.PI * 0.4) / Math.sqrt(1 - 0.16)), 0.015);
  near(found.rise_s, reached(y, 0.9) - reached(y, 0.1), 3e-3);
  near(found.settling5_s, settled(y, 0.05, 1), 5e-3);
  const flat = stepFigures(
    input(rows(kBefore_s, 1, (t) => (t < 0 ? 0 : 1 - Math.exp(-t / 0.05)) + some())),
  );
  assert.equal(flat.overshoot, 0);
});

test('where noise is wider than the band it never settles, and the rest is there', () => {
  const some = noise(0.02);
  const y = secondOrder(0.4, 25);
  const found = stepFigures(input(rows(kBefore_s, 1, (t) => y(t) + some())));
  assert.equal(found.words, '');
  assert.ok(Number.isNaN(found.settling2_s));
  near(found.overshoot, 0.254, 0.06);
});

test('an oscillation that goes on does not settle', () => {
  const found = stepFigures(
    input(rows(kBefore_s, 1, (t) => (t < 0 ? 0 : 1 + 0.1 * Math.cos(2 * Math.PI * 50 * t)))),
  );
  assert.equal(found.words, '');
  assert.ok(Number.isNaN(found.settling5_s) && Number.isNaN(found.settling2_s));
});

test('a record that ends too soon says so', () => {
  for (const taus of [0.5, 1, 2, 3, 4]) {
    const found = stepFigures(
      input(rows(kBefore_s, 0.1 * taus, (t) => (t < 0 ? 0 : 1 - Math.exp(-t / 0.1)))),
    );
    assert.match(found.words, /^not settled/, `${taus} time constants`);
    assert.ok(Number.isNaN(found.rise_s));
  }
  assert.match(
    stepFigures(input(rows(kBefore_s, 0.01, (t) => Number(t > 0)))).words,
    /not settled/,
  );
});

test('a constant, and noise about one, is no step', () => {
  const some = noise(0.1);
  for (const value of [() => 0, () => 0.7, () => 1e6, () => 3 + some()]) {
    assert.equal(stepFigures(input(rows(kBefore_s, 1, value))).words, 'no step');
  }
});

test('a reference that stands, or is led slowly, makes no step', () => {
  const response = rows(kBefore_s, 1, secondOrder(0.4, 25));
  const still = rows(kBefore_s, 1, () => 1);
  assert.equal(stepFigures(input(response, still)).words, 'no step of the reference');
  const slow = rows(kBefore_s, 1, (t) => Math.max(0, Math.min(1, t)));
  assert.equal(stepFigures(input(response, slow)).words, 'the reference makes no step');
});

test('a reference that needs some cycles is a step from its begin', () => {
  const y = secondOrder(0.4, 25);
  const response = rows(kBefore_s, 1.5, y);
  const reference = rows(kBefore_s, 1.5, (t) => Math.max(0, Math.min(1, t / 0.02)));
  const found = stepFigures({ ...input(response, reference), trigger: kTrigger + 10 });
  near(found.peak_s, Math.PI / (25 * Math.sqrt(1 - 0.16)), 2 * kStep_s);
});

test('the next step of the reference ends the one before', () => {
  const y = secondOrder(0.6, 40);
  const wave = (of: (t: number) => number) => (t: number) => of(t) - of(t - 1);
  const response = rows(kBefore_s, 2, wave(y));
  const reference = rows(
    kBefore_s,
    2,
    wave((t) => Number(t > -1e-9)),
  );
  const both = [
    stepFigures(input(response, reference)),
    stepFigures({ ...input(response, reference), trigger: kTrigger + 1005 }),
  ];
  near(both[0].change, 1, 1e-3);
  near(both[1].change, -1, 1e-3);
  for (const found of both) {
    near(found.overshoot, Math.exp((-Math.PI * 0.6) / 0.8), 2e-3);
    near(found.error, 0, 1e-3);
  }
});

test('what was before the step begins after the step before', () => {
  const steps = (at: number[], tau: number) => (t: number) =>
    at.reduce(
      (sum, one, k) => sum + (t < one ? 0 : (-1) ** k * (1 - Math.exp(-(t - one) / tau))),
      0,
    );
  const response = rows(0.4, 1, steps([-0.1, 0], 0.004));
  const reference = rows(0.4, 1, steps([-0.1, 0], 1e-9));
  const found = stepFigures({ step_s: kStep_s, trigger: 401, response, reference });
  near(found.change, -1, 1e-3);
});

test('a step that the response itself triggered has its rise time', () => {
  const y = secondOrder(0.4, 25);
  const response = rows(0.2, 1, y);
  const trigger = response.findIndex((one) => one >= 0.5);
  const found = stepFigures({ step_s: kStep_s, trigger, response, reference: null });
  near(found.rise_s, reached(y, 0.9) - reached(y, 0.1), 5e-4);
  near(found.overshoot, 0.2538, 2e-3);
});

test('values that are missing are said', () => {
  const y = secondOrder(0.4, 25);
  const response = rows(kBefore_s, 1, (t) => (t > 0.1 && t < 0.12 ? Number.NaN : y(t)));
  assert.equal(stepFigures(input(response)).words, 'values are missing');
  assert.equal(stepFigures(input(new Float32Array(0))).words, 'the trigger is not in the record');
});

test('mean and spread of 2, 4, 4, 4, 5, 5, 7, 9', () => {
  const found = spreadOf([2, 4, 4, 4, Number.NaN, 5, 5, 7, 9]);
  assert.equal(found.count, 8);
  near(found.mean, 5, 1e-12);
  near(found.spread, Math.sqrt(32 / 7), 1e-12);
  assert.ok(Number.isNaN(spreadOf([1]).spread));
});
