// The report's tab: facts and tables as the file has them, its figures as plots of signals.
import type { Data } from './data';
import { h, say } from './dom';
import { seconds } from './format';
import { eventNear, signOf } from './marks';
import { Pane, type PaneOwner } from './pane';
import type { RunEvent } from './protocol';
import type { Recording } from './recorded';
import type { Series } from './series';
import type { Catalog } from './signals';
import { withTwins } from './twins';

const kHint = 'Dotted lines are events: point at one for its words. A click selects a time.';

/** Each signal with the same of the other logs; then what these alone have. */
export function seriesOf(own: Series[], catalog: Catalog): Series[] {
  const series = withTwins(own, catalog);
  const there = new Set(series.map(({ name }) => name));
  return [...series, ...own.filter(({ name }) => !there.has(name))];
}

function textOf({ who, text }: RunEvent): string {
  return who ? `${who}: ${text}` : text;
}

export class Report implements PaneOwner {
  private readonly panes: Pane[] = [];
  private readonly box = h('div', { class: 'figures plots-of-report' });
  private readonly words = h('p', { class: 'at', role: 'status' });
  private dirty = true;
  readonly element: HTMLElement;

  /** @param article of the page: facts, tables, pictures. It is taken from where it stands. */
  constructor(
    private readonly data: Data,
    private readonly recording: Recording,
    article: HTMLElement,
  ) {
    article.querySelector('.figures')?.before(this.box, this.words);
    this.element = article;
    article.tabIndex = 0;
    data.whenCatalog(() => this.build());
    data.time.on(() => {
      this.dirty = true;
    });
    new ResizeObserver(() => this.resize()).observe(this.box);
  }

  statistics(): boolean {
    return false;
  }
  secondAxis(): boolean {
    return false;
  }
  chosen(): void {}
  changed(): void {}
  remove(): void {}

  themeChanged(): void {
    for (const pane of this.panes) pane.destroy();
    this.dirty = true;
  }

  /** At once, with the colours and the width of now: a printer waits for no animation frame. */
  drawAnew(): void {
    this.themeChanged();
    this.update();
  }

  /** At each animation frame while the tab is seen. */
  update(): void {
    if (!this.dirty) return;
    this.dirty = false;
    for (const pane of this.panes) pane.update();
    this.say();
  }

  resize(): void {
    for (const pane of this.panes) pane.resize();
    this.dirty = true;
  }

  /** The event beside the pointer, or the selected time. */
  private say(): void {
    const event = eventNear(this.data, this.box.clientWidth);
    say(
      this.words,
      event ? `${signOf(event.level)} ${seconds(event.time_s)} ${textOf(event)}` : kHint,
    );
  }

  private build(): void {
    this.box.replaceChildren();
    for (const figure of this.recording.figures) {
      const own = figure.series.map((name) => ({ kind: 'signal' as const, name }));
      const series = seriesOf(own, this.data.catalog).slice(0, 16);
      const pane = new Pane(this.data, this, series);
      this.panes.push(pane);
      this.box.append(
        h('figure', { class: 'card' }, h('figcaption', {}, figure.title), pane.element),
      );
    }
    this.dirty = true;
  }
}
