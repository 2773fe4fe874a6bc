// The list of events, newest first, with a search.

import { eventWords } from './command';
import type { Data } from './data';
import { h, say } from './dom';
import { seconds } from './format';
import { signOf } from './marks';
import { isRequest, type RunEvent } from './protocol';

const kMostShown = 400;
const kLevels: Record<string, string> = { error: 'error', warn: 'warning', info: 'note' };

/** Events that have every word, in any order. */
export function filterEvents(events: RunEvent[], query: string): RunEvent[] {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  return events.filter((event) => {
    const text =
      `${event.level} ${kLevels[event.level] ?? ''} ${event.who} ${event.text} ${eventWords(event)}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

export class Events {
  private readonly body = h('tbody');
  private readonly count = h('span', { class: 'muted', role: 'status' });
  private readonly field = h('input', {
    type: 'search',
    class: 'search',
    placeholder: 'Search events: error knee',
    'aria-label': 'search events',
    oninput: () => this.show(),
  });
  readonly element: HTMLElement;

  constructor(private readonly data: Data) {
    this.element = h(
      'div',
      { class: 'events' },
      h('div', { class: 'toolbar' }, this.field, this.count),
      h(
        'div',
        { class: 'table-box', tabindex: '0', role: 'region', 'aria-label': 'events' },
        h(
          'table',
          { class: 'event-table' },
          h(
            'thead',
            {},
            h(
              'tr',
              {},
              ...['time', 'kind', 'who', 'what'].map((head) => h('th', { scope: 'col' }, head)),
            ),
          ),
          this.body,
        ),
      ),
    );
    data.whenEvents(() => this.show());
  }

  private show(): void {
    const found = filterEvents(this.data.events, this.field.value);
    const seen = found.slice(-kMostShown).reverse();
    say(
      this.count,
      `${found.length} of ${this.data.events.length} events${found.length > seen.length ? `, the newest ${seen.length} shown` : ''}`,
    );
    this.body.replaceChildren(...seen.map((event) => this.row(event)));
  }

  private row(event: RunEvent): HTMLElement {
    const level = kLevels[event.level] ?? event.level;
    return h(
      'tr',
      { class: `level-${level === 'error' || level === 'warning' ? level : 'note'}` },
      h(
        'td',
        { class: 'figure' },
        h(
          'button',
          {
            type: 'button',
            class: 'quiet',
            title: 'select this time in plots and 3D view',
            onclick: () => {
              const { time } = this.data;
              const { from, to } = time.span();
              const half = (to - from) / 2;
              if (event.time_s < from || event.time_s > to)
                time.freeze(Math.max(0, event.time_s - half), event.time_s + half);
              time.select(event.time_s);
            },
          },
          seconds(event.time_s),
        ),
      ),
      h('td', {}, `${signOf(event.level)} ${level}`),
      h('td', {}, event.who),
      h('td', { title: isRequest(event) ? event.text : null }, eventWords(event)),
    );
  }
}
