// What several joints do at once: those of a limb, or those that the filter shows.
import type { Actions } from './actions';
import { claimsOf } from './claims';
import { commandLine, commandOfAll } from './command';
import { confirmed } from './confirm';
import { h, say } from './dom';
import type { Request } from './protocol';

const kShown = 'shown';
const kCareful_percent = 10;

interface Act {
  label: string;
  /** What it does with each joint. */
  each(joint: string): Request;
  title: string;
  /** The question before it, of what they do: where joints would move, or fall. */
  ask?: string;
}

const kActs: Act[] = [
  {
    label: 'Idle',
    each: (joint) => ({ do: 'joint.set', joint, mode: 'idle' }),
    title: 'No torque: they may fall.',
    ask: 'lose their torque, and may fall',
  },
  {
    label: 'Hold',
    each: (joint) => ({ do: 'joint.set', joint, mode: 'position' }),
    title: 'Position control where they are.',
  },
  {
    label: 'Home',
    each: (joint) => ({ do: 'joint.home', joint }),
    title: 'Their drives look for their places.',
    ask: 'move until their drives have found their places',
  },
];

export class GroupBar {
  private limbs = new Map<string, string[]>();
  private all: string[] = [];
  private readonly which = h('select', {
    'aria-label': 'group of joints',
    onchange: () => this.count(),
  });
  private readonly size = h('span', { class: 'muted', role: 'status' });
  private readonly posture = h('select', { 'aria-label': 'posture' });
  private readonly speed = h('input', {
    type: 'number',
    class: 'short',
    min: 1,
    max: 100,
    value: kCareful_percent,
    'aria-label': 'speed of the posture [% of the limits]',
  });
  private readonly way: HTMLElement;
  private readonly acts = h('fieldset');
  readonly element: HTMLFieldSetElement;

  /**
   * @param shown the joints that the filter leaves.
   * @param controllerOf who has a joint; empty: nobody.
   */
  constructor(
    private readonly actions: Actions,
    private readonly shown: () => string[],
    private readonly controllerOf: (joint: string) => string,
  ) {
    this.way = h(
      'span',
      { class: 'group-posture' },
      h('label', {}, 'posture ', this.posture),
      h('label', {}, 'at ', this.speed, ' %'),
      this.button('Go to posture', 'Each by its own path; all arrive together.', () => this.go()),
    );
    this.element = h(
      'fieldset',
      { class: 'toolbar group-bar asks-run', disabled: true },
      h('legend', {}, 'Several joints'),
      this.which,
      this.size,
      this.acts,
    );
    this.acts.append(
      ...kActs.map((act) => this.button(act.label, act.title, () => this.act(act))),
      this.way,
    );
  }

  /** Whose joints they are. */
  setRobot(all: string[], limbs: Map<string, string[]>, postures: string[]): void {
    this.all = all;
    this.limbs = limbs;
    const before = this.which.value;
    this.which.replaceChildren(
      h('option', { value: kShown }, 'all that are shown'),
      ...[...limbs.keys()].map((name) => h('option', { value: `limb ${name}` }, name)),
    );
    if (before !== '') this.which.value = before;
    if (this.which.selectedIndex < 0) this.which.value = kShown;
    this.posture.replaceChildren(...postures.map((name) => h('option', { value: name }, name)));
    this.way.hidden = postures.length === 0;
    this.count();
  }

  /** The filter shows others, or a controller came or went. What all are claimed of does nothing. */
  count(): void {
    const names = this.names();
    const claimed = names.length - claimsOf(names, this.controllerOf).free.length;
    const count = names.length === 1 ? '1 joint' : `${names.length} joints`;
    say(this.size, claimed === 0 ? count : `${count}, ${claimed} claimed by a controller`);
    this.acts.disabled = names.length > 0 && claimed === names.length;
  }

  private names(): string[] {
    const { value } = this.which;
    return value === kShown ? this.shown() : (this.limbs.get(value.slice('limb '.length)) ?? []);
  }

  /** Those that nobody has claimed, and words for the question about the others. */
  private askable(): { free: string[]; others: string } {
    const { free, words } = claimsOf(this.names(), this.controllerOf);
    return { free, others: words && ` ${words} These are not asked.` };
  }

  private button(label: string, title: string, press: () => Promise<void>): HTMLElement {
    return h(
      'button',
      {
        type: 'button',
        title,
        'aria-label': `${label}: these joints`,
        onclick: () => void press(),
      },
      label,
    );
  }

  private async act(act: Act): Promise<void> {
    const { free, others } = this.askable();
    const requests = free.map((name) => act.each(name));
    if (requests.length === 0) return;
    const words = `These joints ${act.ask}: ${free.join(', ')}.${others}`;
    if (act.ask && !(await confirmed(words, commandOfAll(requests), act.label))) return;
    await this.actions.runAll(requests);
  }

  private async go(): Promise<void> {
    const { free: joints, others } = this.askable();
    if (joints.length === 0) return;
    const percent = Math.min(100, Math.max(1, Number(this.speed.value) || kCareful_percent));
    const request: Request = { do: 'joint.posture', posture: this.posture.value };
    if (joints.length < this.all.length) request.joints = joints;
    request.speed = percent / 100;
    const words = `These joints move to the posture ${this.posture.value}, the slowest at ${percent} % of its limit: ${joints.join(', ')}.${others}`;
    if (await confirmed(words, commandLine(request), 'Go to posture')) {
      await this.actions.run(request);
    }
  }
}
