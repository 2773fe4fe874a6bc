// Parts of the panels that need no browser: goals, jogging, layouts, lanes, parameters, events.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { colourOf, placesOf, textOf } from '../src/controller_marks';
import { parsed } from '../src/controllers';
import { isLane, wordOf } from '../src/enums';
import { filterEvents } from '../src/events';
import { Jog } from '../src/jog';
import { parseGoal, parseSpeed } from '../src/joint_drive';
import { gainOf, unitOf } from '../src/joint_tuning';
import { stretches } from '../src/lanes';
import { kPresets, readLayout } from '../src/layout';
import type { Answer, Hello, JointInfo, Request } from '../src/protocol';
import { Catalog } from '../src/signals';
import { TimeModel } from '../src/time';

test('a speed that is not understood is none, and no other one', () => {
  assert.equal(parseSpeed('0.05', 'rad'), 0.05);
  assert.ok(Math.abs(parseSpeed('2deg', 'rad') - Math.PI / 90) < 1e-12);
  assert.ok(Math.abs(parseSpeed('20 mm/s', 'm') - 0.02) < 1e-12);
  for (const text of ['0,05', '-1', '0', '', 'fast', '2rad/min', 'NaN', 'Infinity']) {
    assert.ok(Number.isNaN(parseSpeed(text, 'rad')), text);
  }
});

test('goals are numbers with or without a unit', () => {
  assert.equal(parseGoal('0.5', 'rad'), 0.5);
  assert.ok(Math.abs(parseGoal('-30deg', 'rad') + Math.PI / 6) < 1e-12);
  assert.ok(Math.abs(parseGoal(' 20 mm ', 'm') - 0.02) < 1e-12);
  for (const text of ['', 'x', '0.5 mm', '1e999', '--1', '1 2']) {
    assert.ok(!Number.isFinite(parseGoal(text, 'rad')), text);
  }
});

/** A run that answers when it is told to. */
function slowRun() {
  const asked: Request[] = [];
  const answers: ((answer: Answer) => void)[] = [];
  const ask = (request: Request) => {
    asked.push(request);
    return new Promise<Answer>((resolve) => answers.push(resolve));
  };
  const settle = async (answer: Answer) => {
    answers.shift()?.(answer);
    await new Promise((resolve) => setTimeout(resolve, 0));
  };
  return { asked, ask, settle };
}

const kJoint = { name: 'LElbj', lower: -1, upper: 1, position: () => 0.9, speed: () => 0.4 };

test('a jog has goals a little ahead, within the limits', () => {
  const jog = new Jog(slowRun().ask, kJoint);
  assert.deepEqual(jog.goal(1), {
    do: 'joint.move',
    joint: 'LElbj',
    target_rad: 1,
    speed_rad_s: 0.4,
  });
  assert.equal(jog.goal(-1)?.target_rad, 0.9 - 0.2);
  const unsaid = new Jog(slowRun().ask, { ...kJoint, speed: () => Number.NaN });
  assert.equal(unsaid.goal(1), null, 'nobody has said how fast');
});

test('a goal that was under way at the release is followed by another stop', async () => {
  const run = slowRun();
  const jog = new Jog(run.ask, kJoint);
  jog.start(1);
  jog.stop();
  assert.deepEqual(
    run.asked.map((one) => one.do),
    ['joint.move', 'joint.stop'],
  );
  await run.settle({ ok: true });
  assert.deepEqual(
    run.asked.map((one) => one.do),
    ['joint.move', 'joint.stop', 'joint.stop'],
  );
});

test('a jog that was refused asks no more', async () => {
  const run = slowRun();
  const jog = new Jog(run.ask, kJoint);
  jog.start(1);
  await run.settle({ ok: false, error: 'claimed' });
  assert.equal(jog.moving, false);
  jog.stop();
  assert.equal(run.asked.length, 1);
});

test('values of parameters are read by their type', () => {
  assert.equal(parsed({ type: 'number' }, '0.5'), 0.5);
  assert.equal(parsed({ type: 'number' }, ''), undefined);
  assert.equal(parsed({ type: 'integer' }, '1.5'), undefined);
  assert.equal(parsed({ type: 'boolean' }, 'true'), true);
  assert.deepEqual(parsed({ type: 'numbers' }, '[1, 2,3]'), [1, 2, 3]);
  assert.equal(parsed({ type: 'numbers' }, '40'), 40);
  assert.equal(parsed({ type: 'numbers' }, '1, x'), undefined);
});

test('a gain is a number, its unit that of the joint', () => {
  assert.equal(gainOf(' 4e3 '), 4000);
  assert.equal(gainOf(''), undefined);
  assert.equal(gainOf('4k'), undefined);
  assert.equal(unitOf('Nm/(rad s)', false), 'Nm/(rad s)');
  assert.equal(unitOf('Nm/(rad s)', true), 'N/(m s)');
  assert.equal(unitOf('V/(Nm s)', true), 'V/(N s)');
  assert.equal(unitOf('Nms²/rad', true), 'Ns²/m');
});

test('marks are places that are shown, and texts up to their end', () => {
  const values = [1, 2, 3, 4, 5, 6];
  assert.deepEqual(
    placesOf(values, 1).map((one) => one.toArray()),
    [[1, 2, 3]],
  );
  assert.equal(placesOf(values, 9).length, 2);
  assert.equal(placesOf(values, Number.NaN).length, 0);
  assert.equal(textOf([0xc3, 0xa4, 0x62, 0, 0x63]), 'äb');
  assert.equal(textOf([]), '');
  const look = { name: '', shape: '', link: '', xyz: [], rpy: [], size_m: 0 };
  assert.equal(colourOf({ ...look, rgba: [1, 0.5, -1, 1] }), 'rgb(255 128 0)');
});

test('events are found by words in any order', () => {
  const event = (level: string, who: string, text: string) => ({
    time_s: 1,
    cycle: 1,
    level,
    who,
    text,
  });
  const events = [event('error', 'LKneeSag', 'too hot'), event('info', '', 'phase running')];
  assert.equal(filterEvents(events, 'hot knee').length, 1);
  assert.equal(filterEvents(events, 'error').length, 1);
  assert.equal(filterEvents(events, '').length, 2);
  assert.equal(filterEvents(events, 'cold').length, 0);
});

test('lanes join rows of one value, and say where there are several', () => {
  const found = stretches({
    times: [0, 1, 2, 3, 4],
    min: [1, 1, 1, Number.NaN, 3],
    max: [1, 1, 3, Number.NaN, 3],
  });
  assert.deepEqual(found, [
    { from: 0, to: 2, value: 1 },
    { from: 2, to: 3, value: Number.NaN },
    { from: 4, to: 4, value: 3 },
  ]);
});

test('numbers that stand for something have words', () => {
  assert.equal(wordOf('mode', 1), 'position');
  assert.equal(wordOf('drive_state', 5), 'operation enabled');
  assert.equal(wordOf('fault', 0x8611), '0x8611');
  assert.equal(wordOf('mode', 99), '99');
  assert.equal(isLane({ name: 'position_rad', type: 'f64' }), false);
});

test('layouts of files are read with care', () => {
  const layout = readLayout(
    '{"version":1,"width_s":30,"panes":[{"series":[{"kind":"signal","name":"a"},{"kind":"difference","name":"a","minus":"b"},{"kind":"x"},null]},7]}',
  );
  assert.equal(layout.width_s, 30);
  assert.deepEqual(layout.panes[0].series, [
    { kind: 'signal', name: 'a' },
    { kind: 'difference', name: 'a', minus: 'b' },
  ]);
  assert.deepEqual(layout.panes[1].series, []);
  for (const text of ['', 'null', '{"version":2,"panes":[]}', '{"version":1}']) {
    assert.throws(() => readLayout(text), /JSON|layout/, text);
  }
});

test('presets are made of what the robot has', () => {
  const joint = (name: string) => ({ name, type: 'revolute' }) as JointInfo;
  const hello = { joints: [joint('LKneeSag'), joint('RKneeSag'), joint('NeckYawj')] } as Hello;
  const field = (name: string) => ({
    name,
    unit: '',
    doc: '',
    type: 'f64',
    elements: ['LKneeSag', 'RKneeSag', 'NeckYawj'],
    count: 3,
  });
  const catalog = new Catalog(1, [{ name: 'state', first: 0, fields: [field('torque_Nm')] }]);
  const names = (preset: string) =>
    kPresets[preset](hello, catalog).panes.map((pane) => pane.series.map((one) => one.name));
  assert.deepEqual(names('legs torque'), [
    ['state.torque_Nm.LKneeSag'],
    ['state.torque_Nm.RKneeSag'],
  ]);
  assert.deepEqual(names('overview'), [['state.torque_Nm.LKneeSag']]);
});

test('the picture follows, stands, and follows again at its right end', () => {
  const time = new TimeModel();
  time.now = 100;
  assert.deepEqual(time.span(), { from: 90, to: 100 });
  time.freeze();
  time.now = 101;
  assert.deepEqual(time.span(), { from: 90, to: 100 });
  time.pan(-0.5);
  assert.deepEqual(time.span(), { from: 85, to: 95 });
  time.pan(1);
  assert.equal(time.frozen, null);
  assert.deepEqual(time.span(), { from: 91, to: 101 });
});
