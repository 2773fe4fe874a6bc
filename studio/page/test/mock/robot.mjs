// The played robot with a registry, which answers as a run's does.
import { kHostile, PlayedRobot } from './played_robot.mjs';

export class MockRobot extends PlayedRobot {
  /** What expect.show tells. */
  expected = [
    {
      name: 'knee stays cool',
      passed: true,
      margin: 24.51,
      unit: 'Nm',
      at_s: 4.352,
      reason: '',
    },
    {
      name: 'settles',
      passed: false,
      margin: -0.2,
      unit: 's',
      at_s: 2.2,
      reason: 'it settled after 2.2 s',
    },
  ];
  /** Joints that a controller has besides, by name. */
  claimed = new Map();
  /** Ends a search: with its answer. Null: there is none. */
  found = null;

  clock() {
    return {
      ok: true,
      clock: this.bus ? 'bus' : 'simulated',
      phase: this.phase,
      time_s: this.time,
      cycles: this.cycle,
      paused: this.paused,
      standing: this.paused,
      pending_steps: 0,
      rate: this.rate,
      realtime_factor: this.paused ? null : this.rate * 0.98,
      ...(this.until ? { until: this.until } : {}),
      past: { keeps: true, checkpoints: 20, bytes: 1.2e6, budget_bytes: 64e6, from_s: 0 },
    };
  }
  status() {
    return {
      ok: true,
      phase: this.phase,
      paused: this.paused,
      cycles: this.cycle,
      running_cycles: this.cycle,
      total_cycles: 0,
      overruns: 0,
      dropped: 0,
      latched: this.latched,
      resets: 0,
      failed_resets: 0,
    };
  }
  controllers() {
    const one = (name, active) => ({
      name,
      plugin: `lib/${name}.so`,
      active,
      shadow: !active && this.shadow === name,
      finished: false,
      of_experiment: true,
      call_ns: active ? { p50: 4031, p99: 11007, p999: 110591, max: 202042 } : null,
      overruns: 0,
      claims: active
        ? this.joints.map((j) => ({ joint: j.name, mode: 'position', interaction: 'stiff' }))
        : [],
    });
    return [one(this.hostile ? kHostile : 'squat', this.active), one('rest', false)];
  }
  /** What "rest" wants as a shadow: the knee 0.02 rad away. */
  difference() {
    const reference = (name, unit, difference, largest) => ({
      name,
      unit,
      difference,
      largest,
      largest_step: largest / 100,
    });
    const joints = this.joints.slice(0, 4).map((joint, j) => ({
      joint: joint.name,
      owner: this.active ? 'squat' : '',
      mode: 'position',
      interaction: j === 3 ? 'compliant' : 'stiff',
      commanded_mode: 'position',
      commanded_interaction: 'stiff',
      references: [
        reference('position_rad', 'rad', j === 1 ? 0.02 : 0, j === 1 ? 0.35 : 0),
        reference('velocity_rad_s', 'rad/s', 0, 0),
        reference('torque_Nm', 'Nm', j === 1 ? -1.5 : 0, j === 1 ? 9 : 0),
      ],
    }));
    const shadows = this.shadow
      ? [{ name: this.shadow, runs: true, since: 1, calls: 5, missed: 0, ended: null, joints }]
      : [];
    const last = this.waits
      ? { state: 'waits', joint: this.joints[1].name, difference: 0.02, unit: 'rad' }
      : null;
    return { ok: true, shadows, switch: last };
  }
  parameters() {
    const base = {
      elements: [],
      choices: [],
      required: false,
      above_min: false,
      min: null,
      max: null,
    };
    return [
      {
        ...base,
        name: 'kp',
        type: 'number',
        unit: 'Nm/rad',
        min: 0,
        max: 100,
        default: 40,
        value: this.gain,
        live: true,
        doc: 'stiffness of the base',
      },
      {
        ...base,
        name: 'smooth',
        type: 'boolean',
        unit: '',
        default: true,
        value: true,
        live: true,
        doc: 'without steps',
      },
      {
        ...base,
        name: 'shape',
        type: 'choice',
        unit: '',
        choices: ['sine', 'step'],
        default: 'sine',
        value: 'sine',
        live: true,
        doc: 'of the motion',
      },
      {
        ...base,
        name: 'period_s',
        type: 'number',
        unit: 's',
        min: 0.1,
        max: 10,
        default: 2,
        value: 2,
        live: false,
        doc: 'of one squat',
      },
    ];
  }
  jointList() {
    return {
      ok: true,
      cycle: this.cycle,
      followers: {},
      joints: this.joints.map((joint, j) => ({
        joint: joint.name,
        slides: joint.type === 'prismatic',
        controller: this.active ? this.controllers()[0].name : (this.claimed.get(joint.name) ?? ''),
        mode: 'position',
        interaction: 'stiff',
        mode_in_force: 'position',
        commanded_position_rad: this.position(j, this.time),
        moving: this.moving(joint.name),
        position_rad: this.position(j, this.time),
        velocity_rad_s: 0,
        torque_Nm: 1,
        min_position_rad: joint.lower,
        max_position_rad: joint.upper,
        max_velocity_rad_s: joint.velocity,
        drive_state: 'operation enabled',
        fault: 0,
        fault_text: '',
        homing: 'none',
        homing_error: '',
        age_cycles: 0,
        feedback: 'fresh',
        stiffness_Nm_rad: 800,
        damping_Nms_rad: 46.7,
        gains: this.gainsOf(joint.name),
      })),
    };
  }
  gainsOf(name) {
    if (!this.gains.has(name)) {
      const loop = () => ({ kp: 40, ki: 2, kd: 1 });
      this.gains.set(name, {
        position: loop(),
        velocity: loop(),
        torque: loop(),
        current: loop(),
      });
    }
    return this.gains.get(name);
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
      case 'status':
        return this.status();
      case 'fault.show':
        return {
          ...this.status(),
          faults: this.latched
            ? [
                {
                  time_s: this.time,
                  joint: this.joints[1].name,
                  cause: 'estop',
                  text: 'emergency stop',
                  advice: 'tandem fault reset',
                },
              ]
            : [],
          lost: 0,
        };
      case 'expect.show':
        return {
          ok: true,
          expectations: this.expected,
        };
      case 'loop.show':
        return {
          ok: true,
          cycles: this.cycle ?? 0,
          period_ns: 1e6,
          overruns: 2,
          cycle_ns: { p50: 32767, p99: 75775, p999: 163839, max: 356442 },
          wakeup_ns: { p50: 81919, p99: 278527, p999: 1997695, max: 4838981 },
          bus_ns: null,
          histograms: {
            cycle_ns: [
              [24575, 900],
              [32767, 52000],
              [40959, 9000],
              [75775, 700],
              [163839, 60],
              [356442, 1],
            ],
            wakeup_ns: [
              [61439, 800],
              [81919, 60000],
              [278527, 600],
              [1997695, 60],
              [4838981, 2],
            ],
            bus_ns: [],
          },
          buses: [
            {
              interface: 'can0',
              bus: 'legs',
              status: '',
              load: 0.312,
              most_load: 0.55,
              planned_load: 0.401,
              max_load: 0.8,
              nodes: [
                {
                  node: 'hip_board',
                  id: 10,
                  missed: 0,
                  late: 0,
                  answer_ns: { p50: 180000, p99: 210000, p999: 250000, max: 301000 },
                },
                { node: 'foot', id: 40, missed: 3, late: 1, answer_ns: null },
              ],
            },
          ],
        };
      case 'clock.show':
        return this.clock();
      case 'controller.list':
        return { ok: true, controllers: this.controllers() };
      case 'controller.show':
        return {
          ok: true,
          controllers: this.controllers().map((one) => ({ ...one, parameters: this.parameters() })),
        };
      case 'joint.list':
        return this.jointList();
      case 'input.list':
        return {
          ok: true,
          inputs: [
            {
              input: 'rate',
              controller: 'squat',
              kind: 'numbers',
              doc: this.hostile ? kHostile : 'velocities',
              source: 'command',
              active: this.active,
              fresh: false,
              sequence: 1,
              cycle: 1,
              timeout_s: 1,
              after: 'zero',
              components: ['x', 'yaw'],
              units: ['m/s', 'rad/s'],
              arrived: 1,
              refused: 0,
              why: '',
              superseded: 0,
              timed_out: 0,
              values: { x: this.input, yaw: 0 },
            },
          ],
        };
      case 'estop':
        this.latched = 1;
        this.phase = 'faulted';
        this.found?.(no('a stop was asked for meanwhile', 'ask again'));
        return { ...done, category: 1, confirmed: true };
      case 'fault.reset':
        this.latched = 0;
        this.phase = 'held';
        this.active = false;
        return this.status();
      case 'controller.start':
        this.active = true;
        this.goal.clear();
        this.phase = 'running';
        return { ...done, active: ['squat'] };
      case 'controller.stop':
        this.active = false;
        return { ...done, active: [] };
      case 'controller.shadow':
        this.shadow = request.end ? '' : request.name;
        return { ...done, name: request.name };
      case 'controller.difference':
        return this.difference();
      case 'controller.switch':
        if (request.when_within !== undefined) {
          this.waits = true;
          return { ...done, waits: true, active: ['squat'] };
        }
        this.active = (request.start ?? []).length > 0;
        return { ...done, active: request.start };
      case 'controller.set': {
        const { kp } = request.parameters;
        if (kp > 100) return no('kp cannot be 101', 'it is from 0 to 100 Nm/rad');
        if (this.paused) {
          this.waiting = kp;
          return { ...done, done: false, note: "it will happen in the loop's next cycle" };
        }
        if (kp !== undefined) this.gain = kp;
        return { ...done, values: request.parameters };
      }
      case 'input.set':
        this.input = request.values.x ?? 0;
        return done;
      case 'clock.pause':
        this.paused = true;
        return this.clock();
      case 'clock.resume':
        this.paused = false;
        this.gain = this.waiting ?? this.gain;
        this.waiting = undefined;
        return this.clock();
      case 'clock.back-until':
        return new Promise((resolve) => {
          this.found = resolve;
        });
      case 'clock.until': {
        const before = this.until;
        this.until = request.cancel ? undefined : request.condition;
        const notes = [
          ...(request.condition?.startsWith('true')
            ? ['it holds now, so it has to end first']
            : []),
          ...(before ? [`it replaces one that waited: ${before}`] : []),
        ];
        return {
          ...this.clock(),
          ...(request.cancel ? {} : { waits: true }),
          ...(notes.length > 0 ? { note: notes.join('; ') } : {}),
        };
      }
      case 'clock.step':
        this.time += (request.cycles ?? 1) * 0.001;
        return this.clock();
      case 'clock.rate':
        this.rate = request.rate;
        return this.clock();
      case 'joint.set':
      case 'joint.home':
      case 'joint.reset':
      case 'joint.recover':
        return done;
      case 'joint.gains': {
        if (request.kp > 1000)
          return no(`${request.joint}: kp = ${request.kp} is beyond 1000`, 'give 0 to 1000');
        const { kp, ki, kd } = { ...this.gainsOf(request.joint)[request.loop], ...request };
        this.gainsOf(request.joint)[request.loop] = { kp, ki, kd };
        return { ...done, note: 'position loop: phase margin 54 deg at 30 rad/s' };
      }
      case 'joint.tuning':
        return { ok: true, toml: '[gains.soft]\n', changed: [] };
      case 'joint.posture':
      case 'site.move':
        return { ...done, joints: request.joints ?? [], duration_s: 1 };
      case 'joint.halt':
        for (const [name] of this.goal) this.stop(name);
        return { ok: true, done: true, joints: [...this.goal.keys()] };
      case 'joint.stop':
        this.stop(request.joint);
        return done;
      case 'joint.move': {
        if (this.active)
          return no(
            `${request.joint} is claimed by squat`,
            'stop it first: tandem controller stop squat',
          );
        const j = this.joints.findIndex((one) => one.name === request.joint);
        const from = this.position(j, this.time);
        this.goal.set(request.joint, {
          from,
          to: request.target_rad,
          at: this.time,
          for: Math.abs(request.target_rad - from) / (request.speed_rad_s ?? 0.5),
        });
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
