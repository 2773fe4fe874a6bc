// A robot that plays sine waves, and a registry that answers as a run's does.
import { readFileSync } from 'node:fs';

const kHostile = '<img src=x onerror="window.hacked=1">"\'&';

function attributes(text) {
  return Object.fromEntries([...text.matchAll(/([\w:]+)="([^"]*)"/g)].map((m) => [m[1], m[2]]));
}

function jointsOf(urdf) {
  const found = [];
  for (const [, head, body] of urdf.matchAll(/<joint\s([^>]*)>(.*?)<\/joint>/gs)) {
    const { name, type } = attributes(head);
    if (!['revolute', 'continuous', 'prismatic'].includes(type) || body.includes('<mimic')) continue;
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

export class MockRobot {
  constructor({ robot, config, hostile = false, passive = [], bus = false }) {
    this.urdf = readFileSync(`${config}/${robot}/${robot}.urdf`, 'utf8');
    this.hostile = hostile;
    this.bus = bus;
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
    this.paused = false;
    this.rate = 1;
    this.time = 20;
    this.latched = 0;
    this.active = true;
    this.gain = 40;
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

  makeTable() {
    const names = this.joints.map((joint) => joint.name);
    const n = names.length;
    const f = (name, unit, doc, count, value, type = 'f64', elements = null) => ({
      name, unit, doc, type, elements, count, value,
    });
    const joint = (name, unit, doc, value, type) => f(name, unit, doc, n, value, type, names);
    const sole = (i) => [0, i < 3 ? 0.1 : -0.1, 0][i % 3];
    const sources = [
      ['state', [
        f('cycle', '', "number of the loop's cycle", 1, (_, t) => Math.round(t * 1000), 'u64'),
        joint('position_rad', 'rad or m', "link side, positive about the joint's +axis", (j, t) => this.position(j, t)),
        joint('velocity_rad_s', 'rad/s or m/s', 'link side', (j, t) => 0.6 * Math.cos(1.5 * t + 0.3 * j)),
        joint('torque_Nm', 'Nm or N', 'of the spring on the link', (j, t) => 12 * Math.sin(1.5 * t + 0.3 * j + 1) + (Math.round(t * 1000) % 3000 === 0 ? 25 : 0)),
        joint('current_A', 'A', 'of the motor', (j, t) => 2 * Math.sin(1.5 * t + j)),
        joint('temperature_C', 'degC', 'of the winding', (j, t) => 25 + j * 0.5 + Math.sin(t / 9)),
        joint('fault', '', "0, or the drive's CiA 402 error code", (j) => (this.latched && j === 1 ? 0x8611 : 0), 'u32'),
        joint('age_cycles', '', '0: fresh, k: the sample is k cycles old', (j, t) => (j === 2 && t % 4 > 3 ? 14 : 0), 'u32'),
        joint('mode', '', 'ControlMode in force, as the drive says', (j, t) => (j === 3 && t % 6 > 4 ? 3 : 1), 'i8'),
        joint('drive_state', '', 'DriveState', (j) => (this.latched && j === 1 ? 8 : 5), 'u8'),
      ]],
      ['command', [
        joint('position_rad', 'rad or m', 'reference', (j, t) => this.position(j, t + 0.05)),
        joint('torque_Nm', 'Nm or N', 'feed-forward', (j, t) => 10 * Math.sin(1.5 * t + j)),
      ]],
      ['truth', [
        f('base_position_m', 'm', 'base origin in W', 3, (i, t) => (this.floating ? [0, 0, 0.48 - 0.03 * (1 + Math.sin(1.5 * t))][i] : 0)),
        f('base_quaternion', '', 'x y z w, base to W', 4, (i) => [0, 0, 0, 1][i]),
        f('center_of_mass_m', 'm', 'in W', 3, (i, t) => [0.02, 0, 0.45 + 0.03 * Math.sin(1.5 * t)][i]),
        ...(this.floating
          ? [
              f('foot_position_m', 'm', "origin of each foot's site in W", 6, (i) => sole(i)),
              f('foot_force_N', 'N', 'of the ground on each foot, W axes', 6, (i, t) => [4, 2, 150 + 20 * Math.sin(t)][i % 3]),
            ]
          : []),
        ...(this.passive.length > 0
          ? [f('passive_position_rad', 'rad or m', 'of the joints without a motor', this.passive.length, (j, t) => Math.sin(t + j), 'f64', this.passive)]
          : []),
      ]],
      ['controller/squat', [
        f('depth', 'm', this.hostile ? kHostile : 'how far the base is asked to be below its start', 1, (_, t) => 0.05 * (1 - Math.cos(1.5 * t))),
      ]],
    ];
    let id = 0;
    this.values = [];
    return sources.map(([name, fields]) => {
      const first = id;
      for (const field of fields) {
        for (let i = 0; i < field.count; ++i, ++id) {
          this.values.push((t) => Math.fround(field.value(i, t)));
        }
      }
      return { name, first, fields: fields.map(({ value, ...rest }) => rest) };
    });
  }

  hello() {
    return {
      op: 'hello', protocol: 1, version: 'mock', robot: this.name,
      experiment: this.hostile ? kHostile : 'squat.toml', title: 'a mock', simulated: !this.bus,
      floating: this.floating, ground: { height_m: 0 }, period_s: 0.001, run: '12345678',
      history_s: [15, 120, 1900], joints: this.joints, passive: this.passive,
      feet: this.floating ? [{ name: 'l_sole', link: 'l_sole', xyz: [0, 0, 0], rpy: [0, 0, 0] }] : [],
      postures: ['home'], urdf: '/robot.urdf',
    };
  }

  events() {
    const text = this.hostile ? kHostile : 'phase running';
    return [
      { time_s: 1.2, cycle: 1200, level: 'info', who: '', text },
      { time_s: 15, cycle: 15000, level: 'warn', who: 'squat', text: 'depth is limited to 0.1 m' },
      { time_s: 18, cycle: 18000, level: 'error', who: this.joints[1]?.name ?? '', text: this.hostile ? kHostile : 'position error: following error too large' },
    ];
  }

  clock() {
    return {
      ok: true, clock: this.bus ? 'bus' : 'simulated', phase: this.phase, time_s: this.time,
      cycles: this.cycle, paused: this.paused, standing: this.paused, pending_steps: 0,
      rate: this.rate, realtime_factor: this.paused ? null : this.rate * 0.98,
    };
  }
  status() {
    return {
      ok: true, phase: this.phase, paused: this.paused, cycles: this.cycle,
      running_cycles: this.cycle, total_cycles: 0, overruns: 0, dropped: 0,
      latched: this.latched, resets: 0, failed_resets: 0,
    };
  }
  controllers() {
    const one = (name, active) => ({
      name, plugin: `lib/${name}.so`, active, finished: false, of_experiment: true,
      call_ns: active ? { p50: 4031, p99: 11007, p999: 110591, max: 202042 } : null, overruns: 0,
      claims: active ? this.joints.map((j) => ({ joint: j.name, mode: 'position', interaction: 'stiff' })) : [],
    });
    return [one(this.hostile ? kHostile : 'squat', this.active), one('rest', false)];
  }
  parameters() {
    const base = { elements: [], choices: [], required: false, above_min: false, min: null, max: null };
    return [
      { ...base, name: 'kp', type: 'number', unit: 'Nm/rad', min: 0, max: 100, default: 40, value: this.gain, live: true, doc: 'stiffness of the base' },
      { ...base, name: 'smooth', type: 'boolean', unit: '', default: true, value: true, live: true, doc: 'without steps' },
      { ...base, name: 'shape', type: 'choice', unit: '', choices: ['sine', 'step'], default: 'sine', value: 'sine', live: true, doc: 'of the motion' },
      { ...base, name: 'period_s', type: 'number', unit: 's', min: 0.1, max: 10, default: 2, value: 2, live: false, doc: 'of one squat' },
    ];
  }
  jointList() {
    return {
      ok: true, cycle: this.cycle, followers: {},
      joints: this.joints.map((joint, j) => ({
        joint: joint.name, slides: joint.type === 'prismatic',
        controller: this.active ? this.controllers()[0].name : '',
        mode: 'position', interaction: 'stiff', mode_in_force: 'position',
        commanded_position_rad: this.position(j, this.time), moving: this.moving(joint.name),
        position_rad: this.position(j, this.time), velocity_rad_s: 0, torque_Nm: 1,
        min_position_rad: joint.lower, max_position_rad: joint.upper,
        max_velocity_rad_s: joint.velocity, drive_state: 'operation enabled',
        fault: 0, fault_text: '', homing: 'none', homing_error: '', age_cycles: 0, feedback: 'fresh',
      })),
    };
  }
  moving(name) {
    const goal = this.goal.get(name);
    return goal !== undefined && this.time < goal.at + goal.for;
  }

  ask(request) {
    this.requests.push(request);
    const done = { ok: true, done: true, cycle: this.cycle };
    const no = (error, hint) => ({ ok: false, error, hint });
    switch (request.do) {
      case 'status': return this.status();
      case 'fault.show': return { ...this.status(), faults: this.latched ? [{ time_s: this.time, joint: this.joints[1].name, cause: 'estop', text: 'emergency stop', advice: 'tandem fault reset' }] : [], lost: 0 };
      case 'clock.show': return this.clock();
      case 'controller.list': return { ok: true, controllers: this.controllers() };
      case 'controller.show': return { ok: true, controllers: this.controllers().map((one) => ({ ...one, parameters: this.parameters() })) };
      case 'joint.list': return this.jointList();
      case 'input.list': return { ok: true, inputs: [{ input: 'rate', controller: 'squat', kind: 'numbers', doc: this.hostile ? kHostile : 'velocities', source: 'command', active: this.active, fresh: false, sequence: 1, cycle: 1, timeout_s: 1, after: 'zero', components: ['x', 'yaw'], units: ['m/s', 'rad/s'], arrived: 1, refused: 0, why: '', superseded: 0, timed_out: 0, values: { x: this.input, yaw: 0 } }] };
      case 'estop': this.latched = 1; this.phase = 'faulted'; return { ...done, category: 1, confirmed: true };
      case 'fault.reset': this.latched = 0; this.phase = 'held'; this.active = false; return this.status();
      case 'controller.start': this.active = true; this.goal.clear(); this.phase = 'running'; return { ...done, active: ['squat'] };
      case 'controller.stop': this.active = false; return { ...done, active: [] };
      case 'controller.switch': this.active = (request.start ?? []).length > 0; return { ...done, active: request.start };
      case 'controller.set': {
        const { kp } = request.parameters;
        if (kp > 100) return no('kp cannot be 101', 'it is from 0 to 100 Nm/rad');
        if (kp !== undefined) this.gain = kp;
        return { ...done, values: request.parameters };
      }
      case 'input.set': this.input = request.values.x ?? 0; return done;
      case 'clock.pause': this.paused = true; return this.clock();
      case 'clock.resume': this.paused = false; return this.clock();
      case 'clock.step': this.time += (request.cycles ?? 1) * 0.001; return this.clock();
      case 'clock.rate': this.rate = request.rate; return this.clock();
      case 'joint.set': case 'joint.home': case 'joint.reset': case 'joint.recover': return done;
      case 'joint.halt': for (const [name] of this.goal) this.stop(name); return { ok: true, done: true, joints: [...this.goal.keys()] };
      case 'joint.stop': this.stop(request.joint); return done;
      case 'joint.move': {
        if (this.active) return no(`${request.joint} is claimed by squat`, 'stop it first: tandem controller stop squat');
        const j = this.joints.findIndex((one) => one.name === request.joint);
        const from = this.position(j, this.time);
        this.goal.set(request.joint, { from, to: request.target_rad, at: this.time, for: Math.abs(request.target_rad - from) / (request.speed_rad_s ?? 0.5) });
        return { ...done, joint: {}, target_rad: request.target_rad };
      }
    }
    return no(`unknown command "${request.do}"`, 'help lists them');
  }
  stop(name) {
    const j = this.joints.findIndex((one) => one.name === name);
    const at = this.position(j, this.time);
    this.goal.set(name, { from: at, to: at, at: this.time, for: 0 });
  }
}
