// Numbers as words.

/** With so many decimals; what rounds to zero has no sign. */
export function fixed(value: number, decimals: number): string {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace('-', '') : text;
}

/** At most so many digits, and no zeros behind them. */
export function digits(value: number, most: number): string {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size >= 1e6 || (size > 0 && size < 1e-5)) return value.toExponential(Math.min(2, most - 1));
  return String(Number(value.toPrecision(most)) || 0);
}

/** A time in the unit that suits it: "12.3 µs", "709 ms", "1.25 s". */
export function duration(seconds: number): string {
  if (!Number.isFinite(seconds)) return '–';
  const size = Math.abs(seconds);
  if (size >= 1 || size === 0) return `${digits(seconds, 4)} s`;
  return size < 1e-3 ? `${digits(1e6 * seconds, 3)} µs` : `${digits(1e3 * seconds, 4)} ms`;
}

/** About four digits, without the jitter of an exponent that comes and goes. */
export function number(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size === 0) return '0';
  if (size >= 1e6 || size < 1e-4) return value.toExponential(2);
  if (size >= 1e4) return value.toFixed(0);
  if (size >= 1000) return value.toFixed(1);
  if (size >= 100) return value.toFixed(2);
  if (size >= 1) return value.toFixed(3);
  return value.toFixed(4);
}

/** Three digits: for tables, where a column must not jump. */
export function short(value: number): string {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size >= 1e5) return value.toExponential(1);
  return fixed(value, size >= 100 ? 0 : size >= 10 ? 1 : 2);
}

/** At an axis: short, however large. */
export function tick(value: number): string {
  return Math.abs(value) >= 1e5
    ? value.toExponential(1)
    : String(Number(value.toPrecision(6)) || 0);
}

/** As a person writes it: "100", "0.1". */
export function plain(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  return String(Number(value.toPrecision(4)) || 0);
}

export function seconds(value: number): string {
  return Number.isFinite(value) ? `${fixed(value, 3)} s` : '–';
}

export function megabytes(bytes: number): string {
  return `${(bytes / 1e6).toPrecision(2)} MB`;
}

/** Nanoseconds as microseconds. */
export function micros(ns: number | null | undefined): string {
  return ns === null || ns === undefined ? '–' : `${(ns / 1000).toFixed(ns < 10000 ? 1 : 0)} µs`;
}

/** A short age: "0.3 s", "2 min". */
export function age(ms: number): string {
  if (ms < 60000) return `${(ms / 1000).toFixed(1)} s`;
  return `${Math.floor(ms / 60000)} min`;
}
