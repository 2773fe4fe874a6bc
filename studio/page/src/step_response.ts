// Figures of a step response, by the definitions of control engineering: K. Ogata, Modern Control
// Engineering, 5th ed., section 5-3, about the change from the former value to the final one.
//   rise time: from 10 % to 90 % of the change;  peak time: from the step to the largest value;
//   overshoot: of the largest value beyond the final one, as a share of the change;
//   settling time: from the step until the value stays within 5 % (2 %) of the final one;
//   steady-state error: reference less final value.

export interface StepInput {
  /** Seconds of a row. */
  step_s: number;
  /** The row of the trigger: without a reference the step is there. */
  trigger: number;
  response: ArrayLike<number>;
  /** What the response has to follow; null: it is not known. */
  reference: ArrayLike<number> | null;
}

export interface StepFigures {
  /** Why there are no figures; empty: there are. */
  words: string;
  /** Change of the response. */
  change: number;
  rise_s: number;
  /** NaN: the response does not go beyond its final value. */
  peak_s: number;
  /** Share of the change: 0.1 is 10 %. */
  overshoot: number;
  /** NaN: it leaves the band again and again, or did so near the end. */
  settling5_s: number;
  settling2_s: number;
  /** NaN: there is no reference. */
  error: number;
}

/** Of the rows after the step: their mean is the final value. */
const kTailShare = 0.1;
/** More drift between the last two tails than this share of the change: it has not settled. */
const kDriftShare = 0.005;
/** A change of the reference that takes more than this share of what follows is no step. */
const kReferenceShare = 0.1;
const kFewestRows = 20;
/** Values this far from a mean, in standard deviations, are more than noise. */
const kSigmas = 4;
const kFloat32 = 1e-6;

const none = (words: string): StepFigures => ({
  words,
  change: Number.NaN,
  rise_s: Number.NaN,
  peak_s: Number.NaN,
  overshoot: Number.NaN,
  settling5_s: Number.NaN,
  settling2_s: Number.NaN,
  error: Number.NaN,
});

/** Rows of one step. */
interface Span {
  /** Where the response was before: rows from `rest` to `past`. */
  rest: number;
  past: number;
  /** Times count from here. */
  step: number;
  end: number;
  /** Reference after the step; NaN: not known. */
  wanted: number;
}

export function stepFigures(input: StepInput): StepFigures {
  const span = input.reference ? spanOf(input.reference, input.trigger) : plainSpan(input);
  if (typeof span === 'string') return none(span);
  const { rest, past, step, end, wanted } = span;
  const y = input.response;
  for (let i = rest; i < end; ++i) {
    if (!Number.isFinite(y[i])) return none('values are missing');
  }
  if (end - step < kFewestRows) return none('not settled: the record is too short');
  const tail = Math.max(2, Math.round(kTailShare * (end - step)));
  const noise = noiseOf(y, end - tail, end);
  const from = mean(y, rest, past);
  const to = mean(y, end - tail, end);
  const change = to - from;
  const size = Math.abs(change);
  const drift = Math.abs(to - mean(y, end - 2 * tail, end - tail));
  if (size <= Math.max(kSigmas * noise, kFloat32 * Math.max(Math.abs(from), Math.abs(to)))) {
    return none('no step');
  }
  if (drift > kDriftShare * size + kSigmas * noise * Math.sqrt(2 / tail)) {
    return none('not settled: the record is too short');
  }
  const part = (i: number) => (y[i] - from) / change;
  const peak = largest(part, step, end);
  const beyond = part(peak) - 1;
  const isPeak = beyond * size > kSigmas * noise && (peak < end - tail || beyond > 2 * kDriftShare);
  return {
    words: '',
    change,
    rise_s: input.step_s * riseOf(part, past - 1, end),
    peak_s: isPeak ? input.step_s * (peak - step) : Number.NaN,
    overshoot: isPeak ? beyond : 0,
    settling5_s: input.step_s * settlingOf(part, step, end, 0.05),
    settling2_s: input.step_s * settlingOf(part, step, end, 0.02),
    error: wanted - to,
  };
}

/**
 * The step is at the trigger. Its first half before that is the rest: when the response itself
 * triggers, it is under way already.
 */
function plainSpan({ response, trigger }: StepInput): Span | string {
  if (trigger < 0 || trigger >= response.length) return 'the trigger is not in the record';
  const past = Math.max(1, trigger >> 1);
  return { rest: 0, past, step: trigger, end: response.length, wanted: Number.NaN };
}

/** The change of the reference nearest to the trigger: the last one before it, else the next. */
function spanOf(reference: ArrayLike<number>, trigger: number): Span | string {
  // Runs of rows in which it changes, each from its first changed row to its last.
  const runs: { first: number; last: number }[] = [];
  let before = -1;
  for (let i = 0; i < reference.length; ++i) {
    if (!Number.isFinite(reference[i])) continue;
    const last = runs[runs.length - 1];
    if (before >= 0 && reference[i] !== reference[before]) {
      if (last && last.last === before) last.last = i;
      else runs.push({ first: i, last: i });
    }
    before = i;
  }
  if (runs.length === 0) return 'no step of the reference';
  const next = runs.findIndex((run) => run.first > trigger);
  const at = next < 0 ? runs.length - 1 : Math.max(0, next - 1);
  const { first, last } = runs[at];
  const end = runs[at + 1]?.first ?? reference.length;
  if (last - first > kReferenceShare * (end - first)) return 'the reference makes no step';
  const begin = at > 0 ? runs[at - 1].last : 0;
  const rest = begin + ((first - begin) >> 1);
  return { rest, past: first, step: first, end, wanted: reference[last] };
}

function mean(values: ArrayLike<number>, from: number, past: number): number {
  let sum = 0;
  for (let i = from; i < past; ++i) sum += values[i];
  return sum / (past - from);
}

/** Standard deviation from row to row: a slow motion is no noise. */
function noiseOf(values: ArrayLike<number>, from: number, past: number): number {
  let squares = 0;
  for (let i = from + 1; i < past; ++i) squares += (values[i] - values[i - 1]) ** 2;
  return Math.sqrt(squares / (2 * Math.max(1, past - from - 1)));
}

type Part = (row: number) => number;

function largest(part: Part, from: number, past: number): number {
  let best = from;
  for (let i = from; i < past; ++i) if (part(i) > part(best)) best = i;
  return best;
}

/** The place between two rows at which a line through them has a value. */
function between(part: Part, row: number, value: number): number {
  const before = part(row - 1);
  return row - 1 + (value - before) / (part(row) - before);
}

/** Rows from 10 % to 90 %: the first time at 90 %, and the last time at 10 % before. */
function riseOf(part: Part, from: number, past: number): number {
  let high = from;
  while (high < past && !(part(high) >= 0.9)) ++high;
  if (high === past) return Number.NaN;
  if (high === from) return 0;
  let low = high;
  while (low > from && part(low - 1) >= 0.1) --low;
  return between(part, high, 0.9) - (low > from ? between(part, low, 0.1) : from);
}

/** Rows from the step to the one since which it is in the band about the final value. */
function settlingOf(part: Part, step: number, past: number, band: number): number {
  const away = (i: number) => Math.abs(part(i) - 1);
  let row = past;
  while (row > step && away(row - 1) <= band) --row;
  if (row === step) return 0;
  if (past - row < (kTailShare / 2) * (past - step)) return Number.NaN;
  const edge = part(row - 1) > 1 ? 1 + band : 1 - band;
  return between(part, row, edge) - step;
}

export interface Spread {
  count: number;
  mean: number;
  /** Standard deviation of the sample; NaN: fewer than two. */
  spread: number;
}

/** Mean and spread of those that are numbers. */
export function spreadOf(values: number[]): Spread {
  const known = values.filter(Number.isFinite);
  const middle = known.reduce((sum, one) => sum + one, 0) / known.length;
  const squares = known.reduce((sum, one) => sum + (one - middle) ** 2, 0);
  return {
    count: known.length,
    mean: middle,
    spread: known.length > 1 ? Math.sqrt(squares / (known.length - 1)) : Number.NaN,
  };
}
