// The loop: how long its cycles take, how late it wakes up, and how its buses are.
import type { Data } from './data';
import { h, say } from './dom';
import { micros } from './format';
import { type BusState, BusTable } from './loop_buses';
import { type Bin, drawHistogram } from './loop_histogram';
import type { Answer } from './protocol';

interface Spread {
  p50: number;
  p99: number;
  p999: number;
  max: number;
}

/** What is measured in each cycle: a row is a line of the table. */
const kRows: { key: string; label: string; title: string }[] = [
  { key: 'cycle_ns', label: 'work', title: 'of a cycle itself, without waiting' },
  { key: 'wakeup_ns', label: 'late', title: 'how long after its time a cycle began' },
  { key: 'bus_ns', label: 'bus', title: 'waiting for the answers of the boards' },
];
const kParts: { key: keyof Spread; label: string }[] = [
  { key: 'p50', label: 'p50' },
  { key: 'p99', label: 'p99' },
  { key: 'p999', label: 'p99.9' },
  { key: 'max', label: 'most' },
];
/** The bar reaches from a thousandth of the period to ten periods. */
const kDecades = { low: -3, high: 1 };

/** Place on the bar, 0 to 1: its scale is logarithmic. */
export function placeOf(time_ns: number, period_ns: number): number {
  const decade = Math.log10(Math.max(time_ns, 1) / period_ns);
  const place = (decade - kDecades.low) / (kDecades.high - kDecades.low);
  return Math.min(1, Math.max(0, place));
}

/** "3 of 120000 cycles overran; the period is 1000 µs." */
export function overrunWords(overruns: number, cycles: number, period_ns: number): string {
  if (cycles === 0) return 'no cycle yet';
  const which = overruns === 0 ? 'None' : String(overruns);
  return `${which} of ${cycles} cycles overran; the period is ${micros(period_ns)}.`;
}

export class LoopPanel {
  private readonly words = h('p', { role: 'status' });
  private readonly body = h('tbody');
  private readonly histogram = h('div', { class: 'loop-histogram', hidden: true });
  private readonly buses = new BusTable();
  readonly element: HTMLElement;

  constructor(data: Data) {
    const heads = ['time', ...kParts.map((part) => part.label), 'share of the period'];
    this.element = h(
      'div',
      { class: 'loop' },
      this.words,
      h(
        'div',
        { class: 'table-box', tabindex: '0', role: 'region', 'aria-label': 'times of the loop' },
        h(
          'table',
          { class: 'loop-table' },
          h('thead', {}, h('tr', {}, ...heads.map((head) => h('th', { scope: 'col' }, head)))),
          this.body,
        ),
      ),
      h(
        'p',
        { class: 'muted' },
        'A bar is logarithmic, from a thousandth of the period to ten of them; the line is the period. Dark to p50, lighter to p99 and p99.9, the mark is the most.',
      ),
      this.histogram,
      h('h2', {}, 'Buses'),
      this.buses.element,
    );
    data.source.on({ watched: (request, answer) => this.watched(request, answer) });
  }

  private watched(request: string, answer: Answer): void {
    if (request !== 'loop.show' || !answer.ok) return;
    const period_ns = Number(answer.period_ns);
    say(this.words, overrunWords(Number(answer.overruns), Number(answer.cycles), period_ns));
    this.body.replaceChildren(
      ...kRows.map(({ key, label, title }) =>
        line(label, title, (answer[key] ?? null) as Spread | null, period_ns),
      ),
    );
    const bins = (answer.histograms ?? {}) as Record<string, Bin[]>;
    drawHistogram(
      this.histogram,
      kRows.map(({ key, label }) => ({ label, bins: bins[key] ?? [] })),
      period_ns,
    );
    this.buses.show((answer.buses ?? []) as BusState[]);
  }
}

function line(label: string, title: string, spread: Spread | null, period_ns: number): HTMLElement {
  const head = h('th', { scope: 'row', title }, label);
  if (!spread) {
    return h('tr', {}, head, h('td', { colspan: String(kParts.length + 1), class: 'muted' }, '–'));
  }
  return h(
    'tr',
    {},
    head,
    ...kParts.map(({ key }) => h('td', { class: 'figure' }, micros(spread[key]))),
    h('td', {}, bar(spread, period_ns)),
  );
}

function bar(spread: Spread, period_ns: number): HTMLElement {
  const share = (part: keyof Spread) => placeOf(spread[part], period_ns);
  const percent = (place: number) => `${(100 * place).toFixed(1)}%`;
  const box = h('div', { class: 'loop-bar', 'aria-hidden': 'true' });
  for (const part of ['p999', 'p99', 'p50'] as const) {
    const piece = h('span', { class: `loop-${part}` });
    piece.style.width = percent(share(part));
    box.append(piece);
  }
  for (const [kind, place] of [
    ['loop-period', placeOf(period_ns, period_ns)],
    ['loop-most', share('max')],
  ] as const) {
    const mark = h('span', { class: kind });
    mark.style.left = percent(place);
    box.append(mark);
  }
  return box;
}
