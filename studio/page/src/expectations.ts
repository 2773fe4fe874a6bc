// What the run must do ([[expect]]): whether it has so far, and by how much.
import type { Data } from './data';
import { h, say } from './dom';
import { plain, seconds } from './format';
import type { Answer } from './protocol';

/** One of `expectations` of expect.show: docs/json.md. */
export interface Expected {
  name: string;
  passed: boolean;
  /** Signed distance to failing, in `unit`; null: there is none. */
  margin: number | null;
  unit: string;
  at_s: number | null;
  /** Why it has not passed. */
  reason: string;
}

/** "3 of 4 hold so far." */
export function expectedWords(all: Expected[]): string {
  if (all.length === 0)
    return 'The experiment expects nothing: rows [[expect]] say what it must do.';
  const held = all.filter((one) => one.passed).length;
  return held === all.length ? `All ${held} hold so far.` : `${held} of ${all.length} hold so far.`;
}

/** "24.5 Nm", "–" */
export function marginWords(one: Expected): string {
  if (one.margin === null) return '–';
  return one.unit ? `${plain(one.margin)} ${one.unit}` : plain(one.margin);
}

const kHeads = ['expectation', 'so far', 'margin', 'at', 'why'];

export class Expectations {
  private readonly words = h('p', { role: 'status' });
  private readonly body = h('tbody');
  private readonly table: HTMLElement;
  readonly element: HTMLElement;
  private shown = '';

  constructor(data: Data) {
    this.table = h(
      'div',
      {
        class: 'table-box',
        tabindex: '0',
        role: 'region',
        'aria-label': 'expectations of the run',
        hidden: true,
      },
      h(
        'table',
        { class: 'loop-table' },
        h('thead', {}, h('tr', {}, ...kHeads.map((head) => h('th', { scope: 'col' }, head)))),
        this.body,
      ),
    );
    this.element = h('div', { class: 'loop' }, this.words, this.table);
    data.source.on({ watched: (request, answer) => this.watched(request, answer) });
  }

  private watched(request: string, answer: Answer): void {
    if (request !== 'expect.show' || !answer.ok) return;
    const all = (answer.expectations ?? []) as Expected[];
    const text = JSON.stringify(all);
    if (text === this.shown) return;
    this.shown = text;
    say(this.words, expectedWords(all));
    this.table.hidden = all.length === 0;
    this.body.replaceChildren(...all.map(row));
  }
}

/** Its word says what its colour does. */
function row(one: Expected): HTMLElement {
  return h(
    'tr',
    {},
    h('th', { scope: 'row' }, one.name),
    h('td', { class: one.passed ? '' : 'bad' }, one.passed ? '✓ holds' : '✗ does not'),
    h('td', { class: 'figure' }, marginWords(one)),
    h('td', { class: 'figure' }, one.at_s === null ? '–' : seconds(one.at_s)),
    h('td', {}, one.reason),
  );
}
