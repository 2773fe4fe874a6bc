// The table below a plot: series with their values, figures of what is seen, and tools.
import type { Data } from './data';
import { h, say } from './dom';
import { number } from './format';
import { type Curve, labelOf, type Series, signalsOf, unitOf } from './series';
import { statistics } from './statistics';
import { colourOf, prefixOf } from './twins';

export interface LegendOwner {
  readonly series: Series[];
  /** Whether statistics are seen. */
  figures(): boolean;
  isLane(series: Series): boolean;
  add(series: Series): void;
  drop(series: Series): void;
}

export const kPaletteSize = 8;

/** Of a report's figure, whose title says its name: the rest, and of several logs the letter. */
function shortLabel(series: Series, all: Series[]): string {
  const bare = labelOf(series).replace(/^([BC]\/)?report\/[^.]*\./, '');
  const several = all.some((one) => prefixOf(one) !== '');
  if (bare === labelOf(series) || !several) return bare;
  return `${bare}, ${prefixOf(series)[0] ?? 'A'}`;
}

export class Legend {
  readonly element = h('table', { class: 'legend' });
  private cells: { value: HTMLElement; figures: HTMLElement[] }[] = [];

  constructor(
    private readonly data: Data,
    private readonly owner: LegendOwner,
  ) {}

  /** @param curve null: a lane has no figures. */
  show(place: number, value: string, curve: Curve | null): void {
    const cell = this.cells[place];
    if (!cell) return;
    say(cell.value, value);
    if (!curve || cell.figures.length === 0) return;
    const found = statistics(curve.middle, curve.min, curve.max);
    const figures = [found.min, found.max, found.mean, found.rms, found.std];
    figures.forEach((one, k) => {
      say(cell.figures[k], number(one));
    });
  }

  list(): void {
    const withFigures = this.owner.figures();
    const heads = [
      '',
      'signal',
      'value',
      'unit',
      ...(withFigures ? ['min', 'max', 'mean', 'rms', 'std'] : []),
      '',
    ];
    this.cells = [];
    const rows = this.owner.series.map((series) => {
      const value = h('td', { class: 'figure' }, '–');
      const figures = withFigures
        ? [0, 1, 2, 3, 4].map(() => h('td', { class: 'figure' }, '–'))
        : [];
      this.cells.push({ value, figures });
      const known = signalsOf(series, this.data.catalog).length > 0;
      const doc = known
        ? (this.data.catalog.named(series.name)?.doc ?? '')
        : 'This run has no such signal.';
      return h(
        'tr',
        { class: known ? undefined : 'unknown' },
        h(
          'td',
          {},
          h('span', {
            class: 'swatch',
            style: `--c: var(--series-${colourOf(series, this.owner.series) % kPaletteSize})`,
            'data-log': prefixOf(series) || undefined,
          }),
        ),
        h(
          'th',
          { scope: 'row', title: doc },
          known ? shortLabel(series, this.owner.series) : `${labelOf(series)} (not in this run)`,
        ),
        value,
        h('td', {}, unitOf(series, this.data.catalog)),
        ...figures,
        h('td', { class: 'series-tools' }, ...this.tools(series)),
      );
    });
    this.element.replaceChildren(
      h(
        'thead',
        {},
        h('tr', {}, ...heads.map((head) => (head ? h('th', { scope: 'col' }, head) : h('td')))),
      ),
      h('tbody', {}, ...rows),
    );
    this.element.hidden = this.owner.series.length === 0;
  }

  private tools(series: Series): Node[] {
    const label = labelOf(series);
    const others = this.owner.series.filter(
      (one) => one.kind === 'signal' && one.name !== series.name && !this.owner.isLane(one),
    );
    const tools: Node[] = [];
    if (series.kind === 'signal' && !this.owner.isLane(series)) {
      tools.push(
        h(
          'button',
          {
            type: 'button',
            class: 'quiet',
            title: 'add its derivative',
            'aria-label': `d/dt of ${label}`,
            onclick: () => this.owner.add({ kind: 'derivative', name: series.name }),
          },
          'd/dt',
        ),
      );
      if (others.length > 0) {
        const choice = h(
          'select',
          {
            class: 'quiet',
            'aria-label': `difference of ${label} and another signal`,
            onchange: () => {
              if (choice.value)
                this.owner.add({ kind: 'difference', name: series.name, minus: choice.value });
            },
          },
          h('option', { value: '' }, '−'),
          ...others.map((one) => h('option', { value: one.name }, `− ${one.name}`)),
        );
        tools.push(choice);
      }
    }
    tools.push(
      h(
        'button',
        {
          type: 'button',
          class: 'quiet',
          'aria-label': `remove ${label}`,
          onclick: () => {
            this.owner.drop(series);
          },
        },
        '×',
      ),
    );
    return tools;
  }
}
