// Where a signal triggers: an edge through a level, or a condition that begins.

export interface Trigger {
  /** Name of the signal; empty: none is chosen. */
  signal: string;
  kind: TriggerKind;
  /** The level; of a band its lower end. */
  level: number;
  /** Upper end of a band. */
  upper: number;
  /** How far a value has to come back before the next trigger; of a change how much is none. */
  hysteresis: number;
}

interface Kind {
  /** As it stands between a signal's name and a level. */
  words: string;
  levels: 0 | 1 | 2;
  /** It also triggers where it is already so when the scope is armed. */
  atOnce: boolean;
  on(value: number, before: number, trigger: Trigger): boolean;
  off(value: number, before: number, trigger: Trigger): boolean;
}

const above = (value: number, _: number, { level, hysteresis }: Trigger) =>
  value >= level + hysteresis;
const below = (value: number, _: number, { level, hysteresis }: Trigger) =>
  value <= level - hysteresis;
const changed = (value: number, before: number, { hysteresis }: Trigger) =>
  Math.abs(value - before) > hysteresis;

export const kTriggerKinds = {
  rising: {
    words: 'rises through',
    levels: 1,
    atOnce: false,
    on: (value, _, { level }) => value >= level,
    off: below,
  },
  falling: {
    words: 'falls through',
    levels: 1,
    atOnce: false,
    on: (value, _, { level }) => value <= level,
    off: above,
  },
  above: {
    words: 'is above',
    levels: 1,
    atOnce: true,
    on: (value, _, { level }) => value > level,
    off: below,
  },
  below: {
    words: 'is below',
    levels: 1,
    atOnce: true,
    on: (value, _, { level }) => value < level,
    off: above,
  },
  outside: {
    words: 'is outside',
    levels: 2,
    atOnce: true,
    on: (value, _, { level, upper }) => value < level || value > upper,
    off: (value, _, { level, upper, hysteresis }) =>
      value >= level + hysteresis && value <= upper - hysteresis,
  },
  changes: {
    words: 'changes',
    levels: 0,
    atOnce: false,
    on: changed,
    off: (value, before, trigger) => !changed(value, before, trigger),
  },
} satisfies Record<string, Kind>;

/** Kinds by name, and `either`: a rising or a falling edge. */
export type TriggerKind = keyof typeof kTriggerKinds | 'either';

/** What a trigger waits for, in words. */
export function triggerWords(trigger: Trigger, unit: string): string {
  const { kind, level, upper } = trigger;
  const { words, levels } =
    kind === 'either' ? { words: 'crosses', levels: 1 } : kTriggerKinds[kind];
  const values = [[], [level], [level, 'to', upper]][levels].join(' ');
  return [trigger.signal, words, values, levels > 0 ? unit : ''].filter((one) => one).join(' ');
}

/**
 * Takes the values cycle by cycle. A row without a value changes nothing: a crossing behind a gap is
 * found at the first value after it. What holds on triggers once, where it begins.
 */
export class TriggerDetector {
  private readonly states: { kind: Kind; on: boolean | null }[];
  private before = Number.NaN;

  constructor(private readonly trigger: Trigger) {
    const names = trigger.kind === 'either' ? (['rising', 'falling'] as const) : [trigger.kind];
    this.states = names.map((name) => ({ kind: kTriggerKinds[name], on: null }));
  }

  /** The next cycle's value. @return whether it triggers there */
  take(value: number): boolean {
    if (!Number.isFinite(value)) return false;
    let fires = false;
    for (const state of this.states) {
      const on = state.kind.on(value, this.before, this.trigger);
      if (on) fires ||= state.on === false || (state.on === null && state.kind.atOnce);
      if (on) state.on = true;
      else if (state.on === null || state.kind.off(value, this.before, this.trigger))
        state.on = false;
    }
    this.before = value;
    return fires;
  }
}
