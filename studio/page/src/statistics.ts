// Figures of a piece of a signal.

export interface Statistics {
  min: number;
  max: number;
  mean: number;
  rms: number;
  /** Standard deviation about the mean, of all values. */
  std: number;
  count: number;
}

/**
 * Minimum and maximum are of every value. Mean, rms and standard deviation take a row as its middle:
 * they are exact where a row is one cycle. Rows without a value do not count.
 */
export function statistics(middle: ArrayLike<number>, min = middle, max = middle): Statistics {
  let least = Number.POSITIVE_INFINITY;
  let most = Number.NEGATIVE_INFINITY;
  let count = 0;
  let mean = 0;
  let spread = 0;
  let squares = 0;
  for (let i = 0; i < middle.length; ++i) {
    const value = middle[i];
    if (!Number.isFinite(value)) continue;
    least = Math.min(least, Number.isFinite(min[i]) ? min[i] : value);
    most = Math.max(most, Number.isFinite(max[i]) ? max[i] : value);
    ++count;
    const away = value - mean;
    mean += away / count;
    spread += away * (value - mean);
    squares += value * value;
  }
  if (count === 0) {
    const none = Number.NaN;
    return { min: none, max: none, mean: none, rms: none, std: none, count };
  }
  return {
    min: least,
    max: most,
    mean,
    rms: Math.sqrt(squares / count),
    std: Math.sqrt(spread / count),
    count,
  };
}
