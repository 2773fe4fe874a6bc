// Controllers that run as shadows: how far what they want is from what is commanded, joint by joint,
// and the switch that waits until they agree.
import type { Actions } from './actions';
import type { Data } from './data';
import { append, h, say } from './dom';
import { number } from './format';
import type { Answer, Request } from './protocol';

interface Difference {
  name: string;
  unit: string;
  difference: number | null;
  largest: number | null;
  largest_step: number | null;
}
export interface ShadowJoint {
  joint: string;
  owner: string;
  mode: string;
  commanded_mode: string;
  interaction: string;
  commanded_interaction: string;
  references: Difference[];
}
interface Shadow {
  name: string;
  runs: boolean;
  calls: number;
  missed: number;
  ended: string | null;
  joints: ShadowJoint[];
}
interface Waiting {
  state: string;
  joint: string | null;
  difference: number | null;
  unit: string | null;
}

/** "position", of "position_rad". */
function reference(name: string): string {
  return name.split('_')[0];
}

/** Lines of the table: what leads in a joint's mode, and what else ever differed. */
export function lines(joints: ShadowJoint[]): [ShadowJoint, Difference][] {
  return joints.flatMap((joint) =>
    joint.references
      .filter((one, index) => index === 0 || one.largest !== 0)
      .map((one): [ShadowJoint, Difference] => [joint, one]),
  );
}

/** Joints that are commanded in another mode. */
export function otherModes(joints: ShadowJoint[]): string[] {
  return joints
    .filter(
      (one) => one.mode !== one.commanded_mode || one.interaction !== one.commanded_interaction,
    )
    .map(
      (one) =>
        `${one.joint}: ${one.interaction} ${one.mode} instead of ${one.commanded_interaction} ${one.commanded_mode}`,
    );
}

/** What became of the last switch that waited, in words. */
export function switchWords(last: Waiting | null): string {
  const apart =
    last?.joint == null
      ? ''
      : last.difference === null
        ? `another mode at ${last.joint}`
        : `${number(last.difference)} ${last.unit ?? ''} at ${last.joint}`;
  switch (last?.state) {
    case 'waits':
      return `The switch waits: ${apart}`;
    case 'done':
      return `Switched, with at most ${apart}`;
    case 'time out':
      return `Nothing has changed: no agreement in time, at last ${apart}`;
    case 'given up':
      return 'Nothing has changed: its shadow has ended';
    case 'refused':
      return 'Nothing has changed: another controller has a joint by now';
  }
  return '';
}

class Part {
  readonly element = h('div', { class: 'shadow', hidden: true });
  private readonly state = h('p', { class: 'muted' });
  private readonly modes = h('p', {});
  private readonly rows = h('tbody');
  private readonly waiting = h('p', { role: 'status' });
  private readonly units = h('span', { class: 'muted' });
  private readonly switching = h('div', { class: 'toolbar' });
  private readonly within: HTMLInputElement;
  private readonly timeout: HTMLInputElement;
  private joints: ShadowJoint[] = [];
  private shape = '';

  constructor(
    private readonly name: string,
    actions: Actions,
  ) {
    const field = (label: string, value: string) =>
      h('input', { type: 'text', inputmode: 'decimal', size: '6', 'aria-label': label, value });
    this.within = field(`bound of ${name}'s difference`, '0.01');
    this.timeout = field(`longest wait for ${name} in seconds`, '10');
    const heads = ['joint', 'led by', 'reference', 'now', 'largest', 'largest step', 'unit'];
    this.element.append(
      this.state,
      this.modes,
      h(
        'div',
        {
          class: 'table-box',
          tabindex: '0',
          role: 'region',
          'aria-label': `difference of ${name} from what is commanded`,
        },
        h(
          'table',
          { class: 'parameter-table shadow-table' },
          h(
            'thead',
            {},
            h(
              'tr',
              {},
              ...heads.map((head, column) =>
                h('th', { scope: 'col', class: column >= 3 && column < 6 ? 'figure' : null }, head),
              ),
            ),
          ),
          this.rows,
        ),
      ),
      this.switching,
      this.waiting,
    );
    append(this.switching, [
      actions.button('Switch when within', () => this.request(), {
        name: `switch when within, to ${name}`,
        title: 'In the first cycle after one in which every joint agrees, in the same mode.',
      }),
      this.within,
      this.units,
      this.timeout,
      h('span', { class: 'muted' }, 's'),
    ]);
  }

  private request(): Request | null {
    const within = Number(this.within.value);
    const timeout = Number(this.timeout.value);
    const valid = this.within.value.trim() !== '' && within >= 0 && timeout >= 0;
    this.within.setAttribute('aria-invalid', String(!valid));
    if (!valid) {
      say(this.waiting, 'The bound and the time are numbers, 0 or more.');
      return null;
    }
    const owners = new Set(this.joints.map((one) => one.owner).filter(Boolean));
    return {
      do: 'controller.switch',
      stop: [...owners],
      start: [this.name],
      when_within: within,
      timeout_s: timeout,
    };
  }

  show(shadow: Shadow | undefined, last: Waiting | null): void {
    this.element.hidden = !shadow;
    if (!shadow) return;
    this.joints = shadow.joints;
    const missed = shadow.missed > 0 ? `; ${shadow.missed} cycles had no time left for it` : '';
    say(
      this.state,
      shadow.ended ?? `It commands nothing: what it wants less what is commanded${missed}.`,
    );
    this.switching.hidden = !shadow.runs;
    const units = shadow.joints.flatMap((one) => one.references[0]?.unit ?? []);
    say(this.units, `${[...new Set(units)].join(' or ')}, waiting at most`);
    const modes = otherModes(shadow.joints);
    this.modes.hidden = modes.length === 0;
    say(this.modes, `Other modes: ${modes.join('; ')}`);
    const all = lines(shadow.joints);
    const shape = all.map(([joint, one]) => `${joint.joint}.${one.name}`).join();
    if (shape !== this.shape) {
      this.shape = shape;
      this.rows.replaceChildren(
        ...all.map(([joint, one]) =>
          h(
            'tr',
            {},
            h('th', { scope: 'row' }, joint.joint),
            h('td', {}),
            h('td', {}, reference(one.name)),
            ...[0, 1, 2].map(() => h('td', { class: 'figure' })),
            h('td', {}, one.unit),
          ),
        ),
      );
    }
    all.forEach(([joint, one], row) => {
      const cells = this.rows.rows[row].cells;
      say(cells[1], joint.owner || 'nobody');
      [one.difference, one.largest, one.largest_step].forEach((value, column) => {
        say(cells[3 + column], number(value));
      });
    });
    say(this.waiting, shadow.runs || last?.state !== 'waits' ? switchWords(last) : '');
  }
}

/** A part for each controller's card. */
export class Shadows {
  private readonly parts = new Map<string, Part>();

  constructor(
    data: Data,
    private readonly actions: Actions,
  ) {
    data.source.on({ watched: (request, answer) => this.watched(request, answer) });
  }

  clear(): void {
    this.parts.clear();
  }

  part(name: string): HTMLElement {
    const part = new Part(name, this.actions);
    this.parts.set(name, part);
    return part.element;
  }

  /** The button that makes one a shadow, or ends that. */
  button(name: string, ends: boolean): HTMLElement {
    return this.actions.button(
      ends ? 'End shadow' : 'Shadow',
      () => ({ do: 'controller.shadow', name, ...(ends ? { end: true } : {}) }),
      {
        name: `${ends ? 'end shadow' : 'shadow'} ${name}`,
        title: ends ? '' : 'It runs beside the active ones, and commands nothing.',
      },
    );
  }

  private watched(request: string, answer: Answer): void {
    if (request !== 'controller.difference' || !answer.ok) return;
    const shadows = answer.shadows as Shadow[];
    const last = answer.switch as Waiting | null;
    for (const [name, part] of this.parts) {
      part.show(
        shadows.find((one) => one.name === name),
        last,
      );
    }
  }
}
