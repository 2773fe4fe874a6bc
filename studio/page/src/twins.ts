// Signals of several logs: those of the first have plain names, the others' begin with B/ and C/.
import { labelOf, namesOf, type Series } from './series';
import type { Catalog } from './signals';

export const kOthers = ['B/', 'C/'];
/** Dashes of a line, by log. */
const kDashes: Record<string, number[]> = { 'B/': [6, 3], 'C/': [2, 3] };

export function prefixOf(series: Series): string {
  return kOthers.find((prefix) => series.name.startsWith(prefix)) ?? '';
}
export function dashOf(series: Series): number[] | undefined {
  return kDashes[prefixOf(series)];
}

function withPrefix(series: Series, prefix: string): Series {
  return series.kind === 'difference'
    ? { ...series, name: prefix + series.name, minus: prefix + series.minus }
    : { ...series, name: prefix + series.name };
}

/** The series of the first log, each followed by the same of the others, as far as they have it. */
export function withTwins(list: Series[], catalog: Catalog): Series[] {
  return list
    .filter((one) => prefixOf(one) === '')
    .flatMap((one) => [
      one,
      ...kOthers
        .map((prefix) => withPrefix(one, prefix))
        .filter((twin) => namesOf(twin).every((name) => catalog.named(name))),
    ]);
}

/** The place of its colour: one for a signal and its twins. */
export function colourOf(series: Series, list: Series[]): number {
  const prefix = prefixOf(series);
  const bare = labelOf(series)
    .split(prefix || '\n')
    .join('');
  const names = [
    ...new Set(
      list.map((one) =>
        labelOf(one)
          .split(prefixOf(one) || '\n')
          .join(''),
      ),
    ),
  ];
  return names.indexOf(bare);
}
