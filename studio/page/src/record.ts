// Every cycle of some signals: asked for piece by piece, so that no answer is a coarser grain.
import type { Source } from './source';

/** Rows of cycles, one after the other; NaN: a gap. */
export interface Rows {
  /** Number of the first cycle: its time is first × period. */
  first: number;
  count: number;
  values: Float32Array[];
}

/** Numbers of one answer, well below what a run gives at most. */
const kMostNumbers = 200_000;

/** How many cycles one answer has at most. */
export function pieceOf(signals: number): number {
  return Math.floor(kMostNumbers / Math.max(1, signals));
}

/**
 * The cycles from `first` to `last` that are kept; no rows: none, or no connection. Null: the oldest
 * of them are kept at a coarser grain only.
 */
export async function rowsOf(
  source: Pick<Source, 'window'>,
  signals: number[],
  first: number,
  last: number,
  period_s: number,
): Promise<Rows | null> {
  const pieces: Rows[] = [];
  const most = pieceOf(signals.length);
  for (let begin = Math.max(0, first); begin <= last; begin += most) {
    const end = Math.min(last, begin + most - 1);
    const window = await source.window(
      signals,
      Math.max(0, (begin - 0.5) * period_s),
      (end + 0.5) * period_s,
      Math.ceil((end - begin + 2) / 4), // it gives four times as many rows
    );
    if (window.rows === 0) continue;
    if (window.cyclesPerRow !== 1) return null;
    const own = Math.round(window.start / period_s);
    const from = Math.max(begin, own);
    const past = Math.min(end + 1, own + window.rows);
    if (past <= from) continue;
    pieces.push({
      first: from,
      count: past - from,
      values: window.min.map((values) => values.slice(from - own, past - own)),
    });
  }
  return joined(pieces, signals.length);
}

function joined(pieces: Rows[], signals: number): Rows {
  if (pieces.length === 1) return pieces[0];
  const first = pieces[0]?.first ?? 0;
  const end = pieces[pieces.length - 1];
  const count = end ? end.first + end.count - first : 0;
  const values = Array.from({ length: signals }, (_, s) => {
    const all = new Float32Array(count).fill(Number.NaN);
    for (const piece of pieces) all.set(piece.values[s], piece.first - first);
    return all;
  });
  return { first, count, values };
}
