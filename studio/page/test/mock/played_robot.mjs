// A robot that plays sine waves: its description, its signals, its events.
import { readFileSync } from 'node:fs';
import { kVersion } from '../../version.mjs';

export const kHostile = '<img src=x onerror="window.hacked=1">"\'&';

function attributes(text) {
  return Object.fromEntries([...text.matchAll(/([\w:]+)="([^"]*)"/g)].map((m) => [m[1], m[2]]));
}

function jointsOf(urdf) {
  const found = [];
  for (const [, head, body] of urdf.matchAll(/<joint\s([^>]*)>(.*?)<\/joint>/gs)) {
    const { name, type } = attributes(head);
    if (!['revolute', 'continuous', 'prismatic'].includes(type) || body.includes('<mimic'))
      continue;
    const limit = attributes(/<limit([^>]*)>/.exec(body)?.[1] ?? '');
    const number = (key) => (limit[key] === undefined ? null : Number(limit[key]));
    const free = type === 'continuous';
    found.push({
      name,
      type: free ? 'revolute' : type,
      unit: type === 'prismatic' ? 'm' : 'rad',
      lower: free ? null : number('lower'),
      upper: free ? null : number('upper'),
      velocity: number('velocity'),
      torque: number('effort'),
      passive: false,
    });
  }
  return found;
}

export class PlayedRobot {
  constructor({
    robot,
    config,
    hostile = false,
    passive = [],
    bus = false,
    protocol = 1,
    meshes = {},
  }) {
    this.urdf = readFileSync(`${config}/${robot}/${robot}.urdf`, 'utf8');
    this.meshes = Object.entries(meshes);
    // Each stands for the box of a link, from the first on.
    for (const [file] of this.meshes)
      this.urdf = this.urdf.replace(
        /<visual>(?:(?!<mesh)[\s\S])*?<\/visual>/,
        `<visual><geometry><mesh filename="${file}"/></geometry></visual>`,
      );
    this.hostile = hostile;
    this.bus = bus;
    this.protocol = protocol;
    this.name = hostile ? kHostile : robot;
    const all = jointsOf(this.urdf);
    this.joints = all.filter((joint) => !passive.includes(joint.name));
    this.passive = all.filter((joint) => passive.includes(joint.name)).map((joint) => joint.name);
    if (hostile) {
      const escaped = kHostile
        .replaceAll('&', '&amp;')
        .replaceAll('<', '&lt;')
        .replaceAll('>', '&gt;')
        .replaceAll('"', '&quot;');
      this.urdf = this.urdf.replaceAll(`"${this.joints[0].name}"`, `"${escaped}"`);
      this.joints[0].name = kHostile;
    }
    this.floating = this.urdf.includes('base_link"') && robot === 'coman';
    this.goal = new Map();
    this.gains = new Map();
    this.paused = false;
    this.rate = 1;
    this.time = 20;
    this.latched = 0;
    this.active = true;
    this.gain = 40;
    this.winding = 25;
    this.phase = 'running';
    this.input = 0;
    this.requests = [];
    this.table = this.makeTable();
  }

  get cycle() {
    return Math.round(this.time * 1000);
  }
  get free() {
    return !this.active;
  }

  position(j, t) {
    const goal = this.goal.get(this.joints[j].name);
    if (goal) {
      const part = Math.min(1, (t - goal.at) / Math.max(goal.for, 1e-3));
      return goal.from + (goal.to - goal.from) * part;
    }
    const { lower, upper } = this.joints[j];
    const middle = lower === null ? 0 : (Math.max(lower, -1) + Math.min(upper, 1)) / 2;
    const swing = lower === null ? 0.4 : Math.min(0.4, 0.3 * (upper - lower));
    return middle + (this.active ? swing * Math.sin(1.5 * t + 0.3 * j) : 0);
  }

  /** [name, fields, marks] of each source. */
  sources() {
    const names = this.joints.map((joint) => joint.name);
    const n = names.length;
    const f = (name, unit, doc, count, value, type = 'f64', elements = null) => ({
      name,
      unit,
      doc,
      type,
      elements,
      count,
      value,
    });
    const joint = (name, unit, doc, value, type) => f(name, unit, doc, n, value, type, names);
    const sole = (i) => [0, i < 3 ? 0.1 : -0.1, 0][i % 3];
    return [
      [
        'state',
        [
          f('cycle', '', "number of the loop's cycle", 1, (_, t) => Math.round(t * 1000), 'u64'),
          joint('position_rad', 'rad or m', "link side, positive about the joint's +axis", (j, t) =>
            this.position(j, t),
          ),
          joint(
            'velocity_rad_s',
            'rad/s or m/s',
            'link side',
            (j, t) => 0.6 * Math.cos(1.5 * t + 0.3 * j),
          ),
          joint(
            'torque_Nm',
            'Nm or N',
            'of the spring on the link',
            (j, t) =>
              12 * Math.sin(1.5 * t + 0.3 * j + 1) + (Math.round(t * 1000) % 3000 === 0 ? 25 : 0),
          ),
          joint('current_A', 'A', 'of the motor', (j, t) => 2 * Math.sin(1.5 * t + j)),
          joint(
            'temperature_C',
            'degC',
            'of the winding',
            (j, t) => this.winding + j * 0.5 + Math.sin(t / 9),
          ),
          joint(
            'fault',
            '',
            "0, or the drive's CiA 402 error code",
            (j) => (this.latched && j === 1 ? 0x8611 : 0),
            'u32',
          ),
          joint(
            'age_cycles',
            '',
            '0: fresh, k: the sample is k cycles old',
            (j, t) => (j === 2 && t % 4 > 3 ? 14 : 0),
            'u32',
          ),
          joint(
            'mode',
            '',
            'ControlMode in force, as the drive says',
            (j, t) => (j === 3 && t % 6 > 4 ? 3 : 1),
            'i8',
          ),
          joint('drive_state', '', 'DriveState', (j) => (this.latched && j === 1 ? 8 : 5), 'u8'),
        ],
      ],
      [
        'command',
        [
          joint('position_rad', 'rad or m', 'reference', (j, t) => this.position(j, t + 0.05)),
          joint('torque_Nm', 'Nm or N', 'feed-forward', (j, t) => 10 * Math.sin(1.5 * t + j)),
        ],
      ],
      [
        'truth',
        [
          f('base_position_m', 'm', 'base origin in W', 3, (i, t) =>
            this.floating ? [0, 0, 0.48 - 0.03 * (1 + Math.sin(1.5 * t))][i] : 0,
          ),
          f('base_quaternion', '', 'x y z w, base to W', 4, (i) => [0, 0, 0, 1][i]),
          f(
            'center_of_mass_m',
            'm',
            'in W',
            3,
            (i, t) => [0.02, 0, 0.45 + 0.03 * Math.sin(1.5 * t)][i],
          ),
          ...(this.floating
            ? [
                f('foot_position_m', 'm', "origin of each foot's site in W", 6, (i) => sole(i)),
                f(
                  'foot_force_N',
                  'N',
                  'of the ground on each foot, W axes',
                  6,
                  (i, t) => [4, 2, 150 + 20 * Math.sin(t)][i % 3],
                ),
              ]
            : []),
          ...(this.passive.length > 0
            ? [
                f(
                  'passive_position_rad',
                  'rad or m',
                  'of the joints without a motor',
                  this.passive.length,
                  (j, t) => Math.sin(t + j),
                  'f64',
                  this.passive,
                ),
              ]
            : []),
        ],
      ],
      [
        'controller/squat',
        [
          f(
            'depth',
            'm',
            this.hostile ? kHostile : 'how far the base is asked to be below its start',
            1,
            (_, t) => 0.05 * (1 - Math.cos(1.5 * t)),
          ),
        ],
      ],
      ['marks/squat', this.markFields(f), this.marks()],
    ];
  }

  makeTable() {
    let id = 0;
    this.values = [];
    return this.sources().map(([name, fields, marks]) => {
      const first = id;
      for (const field of fields) {
        for (let i = 0; i < field.count; ++i, ++id) {
          this.values.push((t) => Math.fround(field.value(i, t)));
        }
      }
      return { name, first, fields: fields.map(({ value, ...rest }) => rest), marks };
    });
  }

  marks() {
    const look = { link: 'odom', xyz: [0, 0, 0], rpy: [0, 0, 0], size_m: 0.02 };
    return [
      { ...look, name: 'push', shape: 'arrow', rgba: [0.9, 0.4, 0.1, 1] },
      { ...look, name: 'goal', shape: 'points', rgba: [0.1, 0.5, 0.9, 1], xyz: [0, 0, 0.1] },
      { ...look, name: 'edge', shape: 'polygon', rgba: [0.2, 0.6, 0.2, 1] },
      { ...look, name: 'words', shape: 'text', size_m: 0.06, rgba: [0.7, 0.1, 0.4, 1] },
      { ...look, name: 'lost', shape: 'line', link: 'no_such_link', rgba: [1, 0, 0, 1] },
    ];
  }
  markFields(f) {
    const text = new TextEncoder().encode(this.hostile ? kHostile : 'left foot');
    const square = [0.2, 0.2, 0.01, -0.2, 0.2, 0.01, -0.2, -0.2, 0.01, 0.2, -0.2, 0.01];
    const places = (name, list, shown) => [
      f(name, 'm', 'places in odom', list.length, (i) => list[i]),
      f(`${name}.shown`, '', 'places that are shown', 1, () => shown, 'u8'),
    ];
    return [
      ...places('push', [0.1, 0, 0.5, 0.4, 0, 0.6], 2),
      ...places('goal', [0.3, 0.3, 0.4, 9, 9, 9], 1),
      ...places('edge', square, 4),
      ...places('words', [0, 0.3, 0.7], 1),
      f('words.text', '', 'its bytes', 60, (i) => text[i] ?? 0, 'u8'),
      ...places('lost', [0, 0, 0, 1, 1, 1], 2),
    ];
  }

  hello() {
    return {
      op: 'hello',
      protocol: this.protocol,
      version: kVersion,
      robot: this.name,
      experiment: this.hostile ? kHostile : 'squat.toml',
      title: 'a mock',
      simulated: !this.bus,
      floating: this.floating,
      ground: this.ground ?? { height_m: 0 },
      period_s: 0.001,
      run: '12345678',
      history_s: [15, 120, 1900],
      joints: this.joints,
      passive: this.passive,
      feet: this.floating
        ? [{ name: 'l_sole', link: 'l_sole', xyz: [0, 0, 0], rpy: [0, 0, 0] }]
        : [],
      postures: ['home'],
      sites: [{ name: 'l_hand', link: 'LElb' }],
      meshes: this.meshes.map(([file, text], i) => ({
        file,
        path: text === null ? null : `/mesh/${i}`,
        why: text === null ? 'it is not there' : '',
      })),
      urdf: '/robot.urdf',
    };
  }

  events() {
    const text = this.hostile ? kHostile : 'phase running';
    return [
      { time_s: 1.2, cycle: 1200, level: 'info', who: '', text },
      { time_s: 15, cycle: 15000, level: 'warn', who: 'squat', text: 'depth is limited to 0.1 m' },
      {
        time_s: 18,
        cycle: 18000,
        level: 'error',
        who: this.joints[1]?.name ?? '',
        text: this.hostile ? kHostile : 'position error: following error too large',
      },
    ];
  }
}
