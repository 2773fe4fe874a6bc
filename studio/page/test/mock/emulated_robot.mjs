// An emulation that is played: the robot's truth and its boards, and nobody to ask.
import { readFileSync } from 'node:fs';
import { PlayedRobot } from './played_robot.mjs';

/** Lines of a table of fields, as hal/boards_fields.inc: C++ type, name, count, words. */
const kField = /^TANDEM_FIELD\((?:std::)?(\w+), (\w+), ([\w* ]+), "(?:\[([^\]]*)\] )?(.*)"\)$/gm;
const kTypes = { double: 'f64' };

export class EmulatedRobot extends PlayedRobot {
  constructor({ emulated, ...options }) {
    super(options);
    this.emulated = emulated;
  }

  /** The fields that an emulation has, from the tables that make its images. */
  fieldsOf(image, values) {
    const names = this.joints.map((joint) => joint.name);
    const counts = { joints: names.length, buses: 1, feet: 2, '3 * feet': 6, loops: 0, passive: 0 };
    const table = readFileSync(
      new URL(`../../../../hal/${image}_fields.inc`, import.meta.url),
      'utf8',
    );
    return [...table.matchAll(kField)].map(([, type, name, count, unit = '', doc]) => ({
      name,
      unit,
      doc,
      type: kTypes[type] ?? type.replace('uint', 'u').replace('int', 'i').replace('_t', ''),
      elements: count === 'joints' ? names : null,
      count: counts[count] ?? Number(count),
      value: values[name] ?? (() => 0),
    }));
  }

  sources() {
    const played = super.sources().flatMap(([, fields]) => fields);
    const as = (name) => played.find((field) => field.name === name)?.value;
    const truth = Object.fromEntries(played.map((field) => [field.name, as(field.name)]));
    return [
      ['truth', this.fieldsOf('truth', { ...truth, foot_moment_Nm: () => 0 })],
      [
        'boards',
        this.fieldsOf('boards', {
          current_A: as('current_A'),
          temperature_C: as('temperature_C'),
          mode: () => 1,
          drive_state: () => 5,
          wire_load: () => Number.NaN,
          synced: () => 1,
          all_enabled: () => 1,
        }),
      ],
    ];
  }

  hello() {
    return { ...super.hello(), emulated: this.emulated, experiment: 'squat_ethercat.toml' };
  }

  events() {
    const at = { time_s: 1.2, cycle: 1200, who: '' };
    return [
      { ...at, level: 'info', text: 'SYNC comes' },
      { ...at, level: 'warn', text: 'injected link_down' },
    ];
  }

  ask(request) {
    this.requests.push(request);
    return {
      ok: false,
      error: 'an emulation is led from the other side of its wire',
      hint: 'tandem run … --studio',
    };
  }
}
