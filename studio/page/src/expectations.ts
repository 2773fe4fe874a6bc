// What the run must do ([[expect]]): whether it has so far, and by how much.
import type { Data } from './data';
import { h, say } from './dom';
import { plain, seconds } from './format';

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
  /** What may still come to one that has not passed while the run goes on; empty: nothing. */
  awaits: string;
  holds_so_far: boolean;
}

/** How an expectation stands: `sort` is its colour, `why` the reason, if there is one. */
export interface Standing {
  sort: 'good' | 'bad' | 'muted';
  word: string;
  why: string;
}

const kWords = { good: '✓ holds', bad: '✗ does not', muted: '… not yet' };
/** @param over nothing comes any more: what is not known by then has failed */
export function standingOf(one: Expected, over: boolean): Standing {
  const standing = (sort: Standing['sort'], why: string) => ({ sort, word: kWords[sort], why });
  if (one.passed) return standing('good', one.reason);
  if (over || one.awaits === '') return standing('bad', one.reason);
  return standing(one.holds_so_far ? 'good' : 'muted', one.awaits);
}

/** "3 of 4 hold so far, 1 not yet." */
export function expectedWords(all: Expected[], over = false): string {
  if (all.length === 0)
    return 'The experiment expects nothing: rows [[expect]] say what it must do.';
  const count = (sort: string) => all.filter((one) => standingOf(one, over).sort === sort).length;
  const [held, waiting] = [count('good'), count('muted')];
  if (held === all.length) return `All ${held} hold so far.`;
  return `${held} of ${all.length} hold so far${waiting > 0 ? `, ${waiting} not yet` : ''}.`;
}

/** "24.5 Nm", "–" */
export function marginWords(one: Expected): string {
  if (one.margin === null) return '–';
  return one.unit ? `${plain(one.margin)} ${one.unit}` : plain(one.margin);
}

const kHeads: [string, string][] = [
  ['expectation', ''],
  ['so far', ''],
  ['margin', 'figure'],
  ['at', 'figure'],
];

export class Expectations {
  private readonly words = h('p', { role: 'status' });
  private readonly body = h('tbody');
  private readonly table: HTMLElement;
  readonly element: HTMLElement;
  private all: Expected[] | null = null;
  private over = false;
  private shown = '';

  constructor(data: Data) {
    const heads = kHeads.map(([head, name]) => h('th', { scope: 'col', class: name }, head));
    this.table = h(
      'div',
      {
        class: 'table-box',
        tabindex: '0',
        role: 'region',
        'aria-label': 'expectations of the run',
        hidden: true,
      },
      h('table', { class: 'expect-table' }, h('thead', {}, h('tr', {}, ...heads)), this.body),
    );
    this.element = h('div', { class: 'expected' }, this.words, this.table);
    data.source.on({
      watched: (request, answer) => {
        if (request !== 'expect.show' || !answer.ok) return;
        this.all = (answer.expectations ?? []) as Expected[];
        this.show();
      },
      connection: (state) => {
        this.over = state === 'ended';
        this.show();
      },
    });
  }

  private show(): void {
    const { all, over } = this;
    const text = JSON.stringify([all, over]);
    if (!all || text === this.shown) return;
    this.shown = text;
    say(this.words, expectedWords(all, over));
    this.table.hidden = all.length === 0;
    this.body.replaceChildren(...all.map((one) => row(one, standingOf(one, over))));
  }
}

/** Its word says what its colour does. */
function row(one: Expected, { sort, word, why }: Standing): HTMLElement {
  return h(
    'tr',
    {},
    h('th', { scope: 'row' }, one.name, why !== '' && h('span', { class: 'doc' }, why)),
    h('td', { class: sort }, word),
    h('td', { class: 'figure' }, marginWords(one)),
    h('td', { class: 'figure' }, one.at_s === null ? '–' : seconds(one.at_s)),
  );
}
