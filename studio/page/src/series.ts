// What a pane draws: signals, their derivatives and differences, computed of rows.
import type { Catalog, Signal } from './signals';

export type Series =
  | { kind: 'signal'; name: string }
  | { kind: 'derivative'; name: string }
  | { kind: 'difference'; name: string; minus: string };

export interface Curve {
  min: ArrayLike<number>;
  max: ArrayLike<number>;
  middle: ArrayLike<number>;
}

export function labelOf(series: Series): string {
  if (series.kind === 'derivative') return `d/dt ${series.name}`;
  if (series.kind === 'difference') return `${series.name} − ${series.minus}`;
  return series.name;
}

export function namesOf(series: Series): string[] {
  return series.kind === 'difference' ? [series.name, series.minus] : [series.name];
}

/** The signals that it needs; none when the run lacks one of them. */
export function signalsOf(series: Series, catalog: Catalog): Signal[] {
  const found = namesOf(series).map((name) => catalog.named(name));
  return found.every((one) => one !== undefined) ? (found as Signal[]) : [];
}

export function unitOf(series: Series, catalog: Catalog): string {
  const unit = catalog.named(series.name)?.unit ?? '';
  if (series.kind !== 'derivative') return unit;
  return unit === '' ? '1/s' : unit.split(' or ').map(perSecond).join(' or ');
}

function perSecond(unit: string): string {
  const power = /^(.*)\/s(\d*)$/.exec(unit);
  return power ? `${power[1]}/s${Number(power[2] || 1) + 1}` : `${unit}/s`;
}

/** Its curve over rows. @param rows gives a signal's rows. Null: a signal has none. */
export function evaluate(
  series: Series,
  times: ArrayLike<number>,
  rows: (name: string) => Curve | null,
): Curve | null {
  const one = rows(series.name);
  if (!one) return null;
  if (series.kind === 'signal') return one;
  if (series.kind === 'derivative') {
    const slope = derivative(times, one.middle);
    return { min: slope, max: slope, middle: slope };
  }
  const other = rows(series.minus);
  if (!other) return null;
  const minus = (a: ArrayLike<number>, b: ArrayLike<number>) =>
    Float64Array.from({ length: times.length }, (_, i) => a[i] - b[i]);
  return {
    min: minus(one.min, other.max),
    max: minus(one.max, other.min),
    middle: minus(one.middle, other.middle),
  };
}

/** Central differences; one-sided at the ends and beside rows without a value. */
export function derivative(times: ArrayLike<number>, values: ArrayLike<number>): Float64Array {
  const slope = new Float64Array(times.length).fill(Number.NaN);
  for (let i = 0; i < times.length; ++i) {
    if (!Number.isFinite(values[i])) continue;
    const before = i > 0 && Number.isFinite(values[i - 1]) ? i - 1 : i;
    const after = i + 1 < times.length && Number.isFinite(values[i + 1]) ? i + 1 : i;
    const span = times[after] - times[before];
    if (span > 0) slope[i] = (values[after] - values[before]) / span;
  }
  return slope;
}
