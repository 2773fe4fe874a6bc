// What one sets and presses at the oscilloscope.
import { attribute, h, say } from './dom';
import { number } from './format';
import {
  kBefore,
  kKinds,
  kLengths_s,
  kModes,
  kMostOverlay,
  type ScopeMode,
  type ScopeSettings,
} from './scope_settings';
import { kTriggerKinds, type Trigger, type TriggerKind } from './trigger';

export interface ScopeActions {
  change(part: Partial<ScopeSettings>): void;
  arm(): void;
  stop(): void;
  force(): void;
  find(forward: boolean): void;
  clear(): void;
  save(): void;
  /** A joint that is to be tuned. */
  joint(name: string): void;
}

const kModeWords: Record<ScopeMode, string> = {
  auto: 'auto: also without a trigger',
  normal: 'normal: again and again',
  single: 'single: once',
};
const kindWords = (kind: TriggerKind) =>
  kind === 'either' ? 'crosses' : kTriggerKinds[kind].words;
const levelsOf = (kind: TriggerKind) => (kind === 'either' ? 1 : kTriggerKinds[kind].levels);

type Choice = HTMLSelectElement;

/** A choice whose options stand for values of any type. */
function choice<T>(label: string, options: [T, string][], chosen: (value: T) => void): Choice {
  const select = h(
    'select',
    {
      'aria-label': label,
      onchange: () => chosen(options[select.selectedIndex][0]),
    },
    ...options.map(([value, words]) => h('option', { value }, words)),
  );
  return select;
}

export class ScopeControls {
  readonly joints = h('select', {
    'aria-label': 'joint to tune',
    title: 'its position, reference and torque; triggers when the reference changes',
    onchange: () => {
      if (this.joints.value) this.actions.joint(this.joints.value);
      this.joints.value = '';
    },
  });
  readonly trigger: HTMLElement;
  readonly record: HTMLElement;
  readonly responses: HTMLElement;
  private settings: ScopeSettings | null = null;
  private readonly signal = this.ofChannels('signal that triggers', (signal) =>
    this.set({ signal }),
  );
  private readonly kind: Choice;
  private readonly level = this.field('level', (level) => this.set({ level }));
  private readonly upper = this.field('upper end of the band', (upper) => this.set({ upper }));
  private readonly hysteresis = this.field('hysteresis', (value) =>
    this.set({ hysteresis: Math.abs(value) }),
  );
  private readonly to = h('span', { class: 'key' }, 'to');
  private readonly value = h('span', { class: 'key' });
  private readonly length: Choice;
  private readonly before: Choice;
  private readonly mode: Choice;
  private readonly overlay = h('input', {
    type: 'number',
    class: 'short',
    min: '1',
    max: String(kMostOverlay),
    'aria-label': 'captures that are drawn',
    onchange: () => {
      const wanted = Math.round(Number(this.overlay.value)) || 1;
      this.actions.change({ overlay: Math.min(kMostOverlay, Math.max(1, wanted)) });
    },
  });
  private readonly response = this.ofChannels('response', (response) =>
    this.actions.change({ response }),
  );
  private readonly reference = this.ofChannels('its reference', (reference) =>
    this.actions.change({ reference }),
  );
  private readonly arm = this.button('Arm', 'waits for the trigger', () => this.actions.arm());
  private readonly stop = this.button('Stop', 'waits no longer', () => this.actions.stop());
  private readonly seeks: HTMLButtonElement[];

  /** @param live triggers are waited for, too */
  constructor(
    live: boolean,
    private readonly actions: ScopeActions,
  ) {
    this.kind = choice(
      'what triggers',
      kKinds.map((kind) => [kind, kindWords(kind)]),
      (kind) => this.set({ kind }),
    );
    this.length = choice(
      'length of a record',
      kLengths_s.map((s) => [s, s < 1 ? `${1e3 * s} ms` : `${s} s`]),
      (length_s) => actions.change({ length_s }),
    );
    this.before = choice(
      'share of a record before the trigger',
      kBefore.map((share) => [share, `${100 * share} % before`]),
      (before) => actions.change({ before }),
    );
    this.mode = choice(
      'mode',
      kModes.map((mode) => [mode, kModeWords[mode]]),
      (mode) => actions.change({ mode }),
    );
    const previous = this.button(
      '◀ Previous',
      'the last trigger before the selected time, as far as it is kept',
      () => actions.find(false),
    );
    const next = this.button('Next ▶', 'the next trigger after the selected time', () =>
      actions.find(true),
    );
    const force = this.button(
      live ? 'Force' : 'Capture here',
      'takes a record without a trigger: about the selected time, else the newest',
      () => actions.force(),
    );
    this.seeks = live ? [this.arm, force, this.stop, previous, next] : [previous, next, force];
    this.trigger = this.group('Trigger', [
      this.signal,
      this.kind,
      this.level,
      this.to,
      this.upper,
      h('label', { class: 'toggle key' }, 'hysteresis', this.hysteresis),
      this.value,
    ]);
    this.record = this.group('Record', [
      this.length,
      this.before,
      live ? this.mode : null,
      ...this.seeks,
      h('label', { class: 'toggle key' }, 'overlay', this.overlay),
      this.button('Clear', 'forgets the captures', () => actions.clear()),
      this.button('Save CSV', 'saves the newest capture as a file', () => actions.save()),
    ]);
    this.responses = this.group('Step response', [
      h('label', { class: 'toggle key' }, 'of', this.response),
      h('label', { class: 'toggle key' }, 'reference', this.reference),
    ]);
  }

  /** @param joints names of those that one may want to tune */
  show(settings: ScopeSettings, joints: string[]): void {
    this.settings = settings;
    const { channels, trigger } = settings;
    this.joints.replaceChildren(
      h('option', { value: '' }, 'Tune joint…'),
      ...joints.map((name) => h('option', { value: name }, name)),
    );
    const triggers = channels.includes(trigger.signal) ? channels : [trigger.signal, ...channels];
    fill(this.signal, triggers.filter(Boolean), trigger.signal, 'choose a signal');
    fill(this.response, channels, settings.response, 'none');
    fill(this.reference, channels, settings.reference, 'none');
    this.kind.value = trigger.kind;
    const levels = levelsOf(trigger.kind);
    this.level.hidden = levels === 0;
    this.to.hidden = levels < 2;
    this.upper.hidden = levels < 2;
    this.level.value = String(trigger.level);
    this.upper.value = String(trigger.upper);
    this.hysteresis.value = String(trigger.hysteresis);
    this.length.value = String(settings.length_s);
    this.before.value = String(settings.before);
    this.mode.value = settings.mode;
    this.overlay.value = String(settings.overlay);
  }

  /** The trigger signal's value of now; whether the scope is armed; whether it can be. */
  now(value: number, armed: boolean, able: boolean): void {
    say(this.value, Number.isFinite(value) ? `now ${number(value)}` : '');
    attribute(this.arm, 'aria-pressed', String(armed));
    for (const button of this.seeks) button.disabled = !able;
    this.stop.disabled = !armed;
  }

  private set(part: Partial<Trigger>): void {
    if (this.settings) this.actions.change({ trigger: { ...this.settings.trigger, ...part } });
  }

  private group(name: string, content: (Node | null)[]): HTMLElement {
    return h('fieldset', { class: 'toolbar scope-row' }, h('legend', {}, name), ...content);
  }
  private button(words: string, title: string, act: () => void): HTMLButtonElement {
    return h('button', { type: 'button', title, onclick: act }, words);
  }
  private ofChannels(label: string, chosen: (name: string) => void): Choice {
    const select: Choice = h('select', {
      class: 'scope-signal',
      'aria-label': label,
      onchange: () => chosen(select.value),
    });
    return select;
  }
  private field(label: string, chosen: (value: number) => void): HTMLInputElement {
    const input: HTMLInputElement = h('input', {
      type: 'number',
      step: 'any',
      class: 'short',
      'aria-label': label,
      onchange: () => {
        const value = input.valueAsNumber;
        if (Number.isFinite(value)) chosen(value);
        else if (this.settings) this.show(this.settings, this.jointNames());
      },
    });
    return input;
  }
  private jointNames(): string[] {
    return [...this.joints.options].slice(1).map((one) => one.value);
  }
}

function fill(select: Choice, names: string[], chosen: string, none: string): void {
  select.replaceChildren(
    h('option', { value: '' }, none),
    ...names.map((name) => h('option', { value: name }, name)),
  );
  select.value = chosen;
}
