// Command lines that do the same as a request.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { commandLine, commandOfAll, requestWords, shellWord } from '../src/command';
import type { Request } from '../src/protocol';

test('requests become command lines', () => {
  const lines: [Parameters<typeof commandLine>[0], string][] = [
    [{ do: 'estop' }, 'tandem estop'],
    [{ do: 'clock.step', cycles: 10 }, 'tandem clock step 10'],
    [{ do: 'clock.rate', rate: 0.5 }, 'tandem clock rate 0.5'],
    [{ do: 'clock.rewind', by_s: 1 }, 'tandem clock rewind 1s'],
    [{ do: 'clock.goto', time_s: 3.125 }, 'tandem clock goto 3.125s'],
    [
      { do: 'clock.back-until', condition: 'torque(LKneeSag) > 40Nm' },
      "tandem clock back-until 'torque(LKneeSag) > 40Nm'",
    ],
    [{ do: 'controller.start' }, 'tandem controller start'],
    [
      { do: 'controller.shadow', name: 'squat2', end: true },
      'tandem controller shadow squat2 --end',
    ],
    [
      {
        do: 'controller.switch',
        stop: ['squat'],
        start: ['squat2'],
        when_within: 0.01,
        timeout_s: 10,
      },
      'tandem controller switch --stop squat --start squat2 --when-within=0.01 --timeout=10',
    ],
    [
      { do: 'controller.switch', stop: ['squat'], start: ['rest'] },
      'tandem controller switch --stop squat --start rest',
    ],
    [
      { do: 'controller.set', name: 'arm', parameters: { kp: [1, 2], on: true } },
      "tandem controller set arm 'kp=[1,2]' on=true",
    ],
    [{ do: 'input.set', name: 'rate', values: { joint2: 0.3 } }, 'tandem input rate joint2=0.3'],
    [
      { do: 'joint.move', joint: 'LElbj', target_rad: -0.5, speed_rad_s: 0.2 },
      'tandem joint move LElbj --to=-0.5 --speed=0.2',
    ],
    [{ do: 'joint.set', joint: 'LElbj', mode: 'idle' }, 'tandem joint set LElbj --mode=idle'],
    [
      { do: 'joint.posture', posture: 'ready', joints: ['a', 'b'], speed: 0.1 },
      'tandem joint posture ready --joints a b --speed=0.1',
    ],
    [
      { do: 'joint.gains', joint: 'a', loop: 'position', kp: 40, anyway: true },
      'tandem joint gains a position --kp=40 --anyway',
    ],
    [
      { do: 'site.move', site: 'hand', axis: 'z', by: -0.02, axes: 'site', speed: 0.05 },
      'tandem site move hand z --by=-0.02 --axes=site --speed=0.05',
    ],
    [{ do: 'joint.tuning' }, 'tandem joint tuning'],
    [{ do: 'run.stop' }, `tandem ask '{"do":"run.stop"}'`],
  ];
  for (const [request, line] of lines) assert.equal(commandLine(request), line);
});

test('names of any kind are one word for a shell', () => {
  assert.equal(shellWord("a'; rm -rf ~"), "'a'\\''; rm -rf ~'");
  assert.equal(
    commandLine({ do: 'joint.stop', joint: '$(reboot)' }),
    "tandem joint stop '$(reboot)'",
  );
});

test('several joints are a loop of a shell', () => {
  const idle = (joint: string): Request => ({ do: 'joint.set', joint, mode: 'idle' });
  assert.equal(
    commandOfAll([idle('a'), idle("b'c")]),
    `for j in a 'b'\\''c'; do tandem joint set "$j" --mode=idle; done`,
  );
  assert.equal(
    commandOfAll([idle('a'), { do: 'joint.home', joint: 'b' }]),
    'tandem joint set a --mode=idle; tandem joint home b',
  );
});

test('an event of a request is told in words', () => {
  const words: [string, string][] = [
    [
      '{"do":"joint.set","joint":"a","mode":"position","stiffness_Nm_rad":80}',
      'a: position, stiffness 80',
    ],
    ['{"do":"controller.set","name":"squat","parameters":{"depth_m":0.1}}', 'squat: depth_m 0.1'],
    ['{"do":"controller.switch","stop":["a"],"start":["b","c"]}', 'a stopped; b, c started'],
    ['{"do":"controller.start"}', 'controllers started'],
    ['{"do":"clock.pause"}', 'tandem clock pause'],
    ['{"do":"clock.until","cancel":true}', 'tandem clock until --cancel'],
    [
      '{"do":"joint.gains","joint":"a","loop":"position","kp":-1}: kp {is} negative',
      'a: gains of its position loop: kp -1: kp {is} negative',
    ],
    ['{"do":"joint.gains","joint":"cut off at its', '{"do":"joint.gains","joint":"cut off at its'],
    ['}}}', '}}}'],
  ];
  for (const [request, told] of words) assert.equal(requestWords(`request ${request}`), told);
});
