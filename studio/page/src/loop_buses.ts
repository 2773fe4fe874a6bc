// The buses of the loop: how much of their time they are busy, and how each node answers.
import { h } from './dom';
import { micros } from './format';

/** One of `buses` of loop.show: docs/json.md. Older runs tell interface and status alone. */
export interface BusState {
  interface: string;
  /** Empty: it is well. */
  status: string;
  bus?: string;
  /** Shares; null: not measured. */
  load?: number | null;
  most_load?: number | null;
  planned_load?: number | null;
  max_load?: number;
  nodes?: NodeState[];
}
interface NodeState {
  node: string;
  id: number;
  missed: number;
  late: number;
  answer_ns: { p50: number; p99: number; p999: number; max: number } | null;
}

const percent = (share: number | null | undefined) =>
  share === null || share === undefined ? '–' : `${(100 * share).toFixed(1)} %`;

/** "load 31.2 %, most of a cycle 55.0 %; planned 40.1 % of at most 80.0 %" */
export function loadWords(bus: BusState): string {
  if (bus.planned_load === undefined) return '';
  const measured =
    bus.load === null || bus.load === undefined
      ? 'load not measured'
      : `load ${percent(bus.load)}, most of a cycle ${percent(bus.most_load)}`;
  return `${measured}; planned ${percent(bus.planned_load)} of at most ${percent(bus.max_load)}`;
}

const kHeads: [string, string][] = [
  ['node', ''],
  ['missed', 'cycles without its whole answer'],
  ['late', 'answers to commands that came a cycle late or more'],
  ['answers p50', 'from SYNC to its whole sample'],
  ['p99', ''],
  ['p99.9', ''],
  ['most', ''],
];

export class BusTable {
  readonly element = h('div', { class: 'buses' });
  private shown = '';

  show(buses: BusState[]): void {
    const text = JSON.stringify(buses);
    if (text === this.shown) return;
    this.shown = text;
    this.element.replaceChildren(...buses.map((bus) => section(bus)));
    if (buses.length === 0) this.element.append(h('p', { class: 'muted' }, 'none'));
  }
}

function section(bus: BusState): HTMLElement {
  const nodes = bus.nodes ?? [];
  const load = loadWords(bus);
  const name =
    bus.bus && bus.bus !== bus.interface ? `${bus.bus} (${bus.interface})` : bus.interface;
  return h(
    'section',
    { 'aria-label': `bus ${name}` },
    h('p', { class: bus.status ? 'bad' : '' }, `${name}: ${bus.status || 'well'}`),
    load !== '' && h('p', { class: 'muted' }, load),
    nodes.length > 0 &&
      h(
        'div',
        { class: 'table-box', tabindex: '0', role: 'region', 'aria-label': `nodes of ${name}` },
        h(
          'table',
          { class: 'node-table' },
          h(
            'thead',
            {},
            h('tr', {}, ...kHeads.map(([head, title]) => h('th', { scope: 'col', title }, head))),
          ),
          h('tbody', {}, ...nodes.map(row)),
        ),
      ),
  );
}

function row(node: NodeState): HTMLElement {
  const bad = (count: number) =>
    h('td', { class: count > 0 ? 'figure bad' : 'figure' }, `${count}`);
  const spread = node.answer_ns;
  return h(
    'tr',
    {},
    h('th', { scope: 'row' }, `${node.node} (${node.id})`),
    bad(node.missed),
    bad(node.late),
    ...(['p50', 'p99', 'p999', 'max'] as const).map((part) =>
      h('td', { class: 'figure' }, micros(spread?.[part])),
    ),
  );
}
