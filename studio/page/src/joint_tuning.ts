// Stiffness, damping and gains of a joint's drive: each with its unit, Set and Undo.
import type { Actions } from './actions';
import { h } from './dom';
import type { JointInfo, Request } from './protocol';
import { type Undoable, undoable } from './undo';

/** Of each loop the units of kp, ki and kd of a joint that turns: docs/configuration.md. */
const kLoops: Record<string, [string, string, string]> = {
  position: ['Nm/rad', 'Nm/(rad s)', 'Nms/rad'],
  velocity: ['Nms/rad', 'Nm/rad', 'Nms²/rad'],
  torque: ['V/Nm', 'V/(Nm s)', 'Vs/Nm'],
  current: ['V/A', 'V/(A s)', 'Vs/A'],
};
const kGains = ['kp', 'ki', 'kd'] as const;
const kImpedance: [string, string, string][] = [
  ['stiffness', 'stiffness_Nm_rad', 'Nm/rad'],
  ['damping', 'damping_Nms_rad', 'Nms/rad'],
];

/** The unit of a slide where `unit` is that of a joint that turns. */
export function unitOf(unit: string, slides: boolean): string {
  return slides ? unit.replace('Nm', 'N').replace('rad', 'm') : unit;
}

/** What was typed, as a number that may be set; undefined: it is none. */
export function gainOf(text: string): number | undefined {
  const value = text.trim() === '' ? Number.NaN : Number(text);
  return Number.isFinite(value) ? value : undefined;
}

/** As a person reads it: without the noise of the last digits. */
function shown(value: unknown): string {
  return typeof value === 'number' ? String(Number(value.toPrecision(7))) : '';
}

type Told = Record<string, unknown>;
type Gains = Record<string, Record<string, number>>;

export class JointTuning {
  private readonly values: { of(joint: Told): unknown; value: Undoable }[] = [];
  readonly element: HTMLElement;

  /** @param told the joint as the run told it last: one of `joint.list`. */
  constructor(
    joint: JointInfo,
    private readonly actions: Actions,
    told: Told,
  ) {
    const slides = joint.unit === 'm';
    const impedance = kImpedance.map(([label, key, unit]) =>
      this.cell(
        `${label} of ${joint.name}`,
        unitOf(unit, slides),
        (of) => of[key],
        (value) => ({ do: 'joint.set', joint: joint.name, [key]: value }),
        told,
        label,
      ),
    );
    const loops = Object.entries(kLoops).map(([loop, units]) =>
      h(
        'div',
        { class: 'drive-row', role: 'group', 'aria-label': `${loop} loop of ${joint.name}` },
        h('span', { class: 'loop muted' }, loop),
        ...kGains.map((gain, i) =>
          this.cell(
            `${gain} of the ${loop} loop of ${joint.name}`,
            unitOf(units[i], slides),
            (of) => (of.gains as Gains | undefined)?.[loop]?.[gain],
            (value) => ({ do: 'joint.gains', joint: joint.name, loop, [gain]: value }),
            told,
            gain,
          ),
        ),
      ),
    );
    this.element = h(
      'details',
      { class: 'tuning' },
      h('summary', {}, 'Stiffness, damping and gains'),
      h('div', { class: 'drive-row' }, h('span', { class: 'loop muted' }, 'spring'), ...impedance),
      ...loops,
    );
  }

  /** The joint as the run tells it now. */
  tell(joint: Told): void {
    for (const { of, value } of this.values) {
      const now = of(joint);
      if (typeof now === 'number') value.tell(shown(now));
    }
  }

  private cell(
    name: string,
    unit: string,
    of: (joint: Told) => unknown,
    request: (value: number) => Request,
    told: Told,
    label: string,
  ): HTMLElement {
    const field = h('input', {
      type: 'text',
      inputmode: 'decimal',
      class: 'short',
      'aria-label': `${name} [${unit}]`,
    });
    const value = undoable(
      this.actions,
      {
        name,
        field,
        type: 'number',
        bare: true,
        request: (text) => {
          const number = gainOf(text);
          return number === undefined ? null : request(number);
        },
        told: (text) => shown(gainOf(text)),
      },
      shown(of(told)),
    );
    this.values.push({ of, value });
    return h(
      'span',
      { class: 'gain' },
      h('span', { class: 'gain-name' }, label),
      field,
      h('span', { class: 'unit muted' }, unit),
      value.set,
      value.undo,
    );
  }
}
