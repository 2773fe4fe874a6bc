// The report's tab: facts and tables as the file has them, its figures as plots of signals.
import type { Data } from './data';
import { h } from './dom';
import { Pane, type PaneOwner } from './pane';
import type { Recording } from './recorded';
import { withTwins } from './twins';

export class Report implements PaneOwner {
  private readonly panes: Pane[] = [];
  private readonly box = h('div', { class: 'figures plots-of-report' });
  private dirty = true;
  readonly element: HTMLElement;

  /** @param article of the page: facts, tables, pictures. It is taken from where it stands. */
  constructor(
    private readonly data: Data,
    private readonly recording: Recording,
    article: HTMLElement,
  ) {
    article.querySelector('.figures')?.before(this.box);
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

  /** At each animation frame while the tab is seen. */
  update(): void {
    if (!this.dirty) return;
    this.dirty = false;
    for (const pane of this.panes) pane.update();
  }

  resize(): void {
    for (const pane of this.panes) pane.resize();
    this.dirty = true;
  }

  private build(): void {
    this.box.replaceChildren();
    for (const figure of this.recording.figures) {
      const own = figure.series.map((name) => ({ kind: 'signal' as const, name }));
      const series = withTwins(own, this.data.catalog).slice(0, 16);
      const pane = new Pane(this.data, this, series);
      this.panes.push(pane);
      this.box.append(
        h('figure', { class: 'card' }, h('figcaption', {}, figure.title), pane.element),
      );
    }
    this.dirty = true;
  }
}
