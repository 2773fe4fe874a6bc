// Settings of the oscilloscope, as a layout keeps them.
import { kTriggerKinds, type Trigger, type TriggerKind } from './trigger';

export type ScopeMode = 'auto' | 'normal' | 'single';

export interface ScopeSettings {
  /** Names of signals. */
  channels: string[];
  trigger: Trigger;
  /** Of the record. */
  length_s: number;
  /** Share of the record before the trigger, 0 to 1. */
  before: number;
  mode: ScopeMode;
  /** So many captures are drawn, one over the other. */
  overlay: number;
  /** Channels of the step response; empty: none. */
  response: string;
  reference: string;
}

export const kMostChannels = 8;
export const kMostOverlay = 20;
export const kLengths_s = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5];
export const kBefore = [0, 0.1, 0.25, 0.5, 0.75, 0.9, 1];
export const kModes: ScopeMode[] = ['auto', 'normal', 'single'];
export const kKinds = [...Object.keys(kTriggerKinds), 'either'] as TriggerKind[];

export function firstSettings(): ScopeSettings {
  return {
    channels: [],
    trigger: { signal: '', kind: 'rising', level: 0, upper: 0, hysteresis: 0 },
    length_s: 0.5,
    before: 0.1,
    mode: 'normal',
    overlay: 5,
    response: '',
    reference: '',
  };
}

/** Settings of a part of a layout; what is none there is as at first. */
export function readScope(value: unknown): ScopeSettings {
  const first = firstSettings();
  const given = (value ?? {}) as Record<string, unknown>;
  const trigger = (given.trigger ?? {}) as Record<string, unknown>;
  const channels = Array.isArray(given.channels) ? given.channels : [];
  return {
    channels: channels.filter((one) => typeof one === 'string').slice(0, kMostChannels),
    trigger: {
      signal: text(trigger.signal),
      kind: oneOf(kKinds, trigger.kind, first.trigger.kind),
      level: finite(trigger.level, 0),
      upper: finite(trigger.upper, 0),
      hysteresis: Math.max(0, finite(trigger.hysteresis, 0)),
    },
    length_s: oneOf(kLengths_s, given.length_s, first.length_s),
    before: oneOf(kBefore, given.before, first.before),
    mode: oneOf(kModes, given.mode, first.mode),
    overlay: Math.min(kMostOverlay, Math.max(1, Math.round(finite(given.overlay, first.overlay)))),
    response: text(given.response),
    reference: text(given.reference),
  };
}

function text(value: unknown): string {
  return typeof value === 'string' ? value : '';
}
function finite(value: unknown, otherwise: number): number {
  return typeof value === 'number' && Number.isFinite(value) ? value : otherwise;
}
function oneOf<T>(choices: readonly T[], value: unknown, otherwise: T): T {
  return choices.includes(value as T) ? (value as T) : otherwise;
}
