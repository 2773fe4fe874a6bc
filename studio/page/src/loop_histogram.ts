// How often each of the loop's times was how long: both axes logarithmic, the period a line.
import { h } from './dom';
import { micros } from './format';

/** Upper end of a bucket [ns], and how many cycles it has. */
export type Bin = [number, number];
export interface Series {
  label: string;
  bins: Bin[];
}

const kPerDecade = 16;
const kHeight = 220;
const kMargin = { left: 46, right: 10, top: 10, bottom: 34 };

/** Counts by column, [place of its left end in decades of ns, count]: buckets of 3 % are too fine. */
export function columnsOf(bins: Bin[]): [number, number][] {
  const columns = new Map<number, number>();
  for (const [upper_ns, count] of bins) {
    const column = Math.floor(Math.log10(Math.max(upper_ns, 1)) * kPerDecade);
    columns.set(column, (columns.get(column) ?? 0) + count);
  }
  return [...columns].sort((a, b) => a[0] - b[0]).map(([at, count]) => [at / kPerDecade, count]);
}

/** Whole decades that hold every bucket and the period. */
export function decadesOf(all: Bin[][], period_ns: number): [number, number] {
  const ends = all.flatMap((bins) => bins.map(([upper_ns]) => Math.max(upper_ns, 1)));
  const low = Math.min(period_ns / 10, ...ends);
  const high = Math.max(period_ns * 1.01, ...ends);
  return [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
}

/** What the picture shows, in words. */
export function histogramWords(series: Series[], period_ns: number): string {
  const parts = series.map(({ label, bins }) => {
    const all = bins.reduce((sum, [, count]) => sum + count, 0);
    let half = 0;
    const middle = bins.find(([, count]) => {
      half += count;
      return 2 * half >= all;
    });
    const above = bins.reduce((sum, [ns, count]) => sum + (ns > period_ns ? count : 0), 0);
    const most = bins[bins.length - 1][0];
    return `${label}: ${all} cycles, half up to ${micros(middle?.[0])}, the longest up to ${micros(most)}, ${above} beyond the period`;
  });
  return `How often each time was how long. ${parts.join('; ')}.`;
}

/** A power of ten: "0.1", "1000", "1e5". */
const power = (decade: number) =>
  decade > 4 || decade < -2 ? `1e${decade}` : String(Number((10 ** decade).toPrecision(1)));

function s(tag: string, attributes: Record<string, string | number>, text = ''): SVGElement {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  if (text) made.textContent = text;
  return made;
}

/** @param all in the order of their colours; one without buckets is left out */
export function drawHistogram(box: HTMLElement, all: Series[], period_ns: number): void {
  const series = all.filter((one) => one.bins.length > 0);
  box.hidden = series.length === 0;
  if (box.hidden) return;
  const width = Math.max(260, box.clientWidth);
  const [low, high] = decadesOf(
    series.map((one) => one.bins),
    period_ns,
  );
  const columns = series.map((one) => columnsOf(one.bins));
  const most = Math.max(...columns.flat().map(([, count]) => count));
  const top = Math.max(1, Math.ceil(Math.log10(most)));
  const right = width - kMargin.right;
  const bottom = kHeight - kMargin.bottom;
  const x = (decade: number) =>
    kMargin.left + ((decade - low) / (high - low)) * (right - kMargin.left);
  // A count of 1 stands a little above the axis.
  const y = (count: number) =>
    bottom - ((Math.log10(count) + 0.3) / (top + 0.3)) * (bottom - kMargin.top);
  const svg = s('svg', {
    viewBox: `0 0 ${width} ${kHeight}`,
    width,
    height: kHeight,
    role: 'img',
    'aria-label': histogramWords(series, period_ns),
  });
  for (let decade = low; decade <= high; ++decade) {
    svg.append(
      s('line', { class: 'hist-grid', x1: x(decade), x2: x(decade), y1: kMargin.top, y2: bottom }),
      s(
        'text',
        { x: x(decade), y: bottom + 14, 'text-anchor': decade === high ? 'end' : 'middle' },
        power(decade - 3),
      ),
    );
  }
  svg.append(
    s('text', { x: right, y: bottom + 28, 'text-anchor': 'end' }, 'time [µs]'),
    s('text', { x: kMargin.left, y: bottom + 28 }, 'cycles, upwards'),
  );
  for (let decade = 0; decade <= top; ++decade) {
    const at = y(10 ** decade);
    svg.append(
      s('line', { class: 'hist-grid', x1: kMargin.left, x2: right, y1: at, y2: at }),
      s('text', { x: kMargin.left - 6, y: at + 4, 'text-anchor': 'end' }, power(decade)),
    );
  }
  series.forEach((one, i) => {
    let path = '';
    columns[i].forEach(([at, count], k) => {
      const follows = k > 0 && Math.abs(columns[i][k - 1][0] + 1 / kPerDecade - at) < 1e-9;
      const from = x(at).toFixed(1);
      const to = x(at + 1 / kPerDecade).toFixed(1);
      path += follows
        ? `L${from} ${y(count).toFixed(1)}`
        : `M${from} ${bottom}L${from} ${y(count).toFixed(1)}`;
      path += `L${to} ${y(count).toFixed(1)}`;
      const next = columns[i][k + 1]?.[0];
      if (next === undefined || Math.abs(next - at - 1 / kPerDecade) > 1e-9)
        path += `L${to} ${bottom}`;
    });
    svg.append(s('path', { class: `hist-${all.indexOf(one)}`, d: path }));
  });
  const period = x(Math.log10(period_ns));
  svg.append(
    s('line', { class: 'hist-period', x1: period, x2: period, y1: kMargin.top, y2: bottom }),
    s('text', { x: period - 4, y: kMargin.top + 10, 'text-anchor': 'end' }, 'period'),
  );
  const keys = series.map((one) =>
    h('span', { class: `hist-key hist-key-${all.indexOf(one)}` }, one.label),
  );
  box.replaceChildren(svg, h('p', { class: 'hist-keys' }, ...keys));
}
