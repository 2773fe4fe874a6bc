// One pane of plots: lines with their bands, lanes of words, a legend with values and figures.
import uPlot from 'uplot';
import { listed, timeAxis, unitAxes } from './axes';
import type { Data } from './data';
import { h, theme } from './dom';
import { wordOf } from './enums';
import { number } from './format';
import { Lanes } from './lanes';
import { kPaletteSize, Legend, type LegendOwner } from './legend';
import { eventMarks } from './marks';
import type { Window } from './protocol';
import { type Curve, evaluate, labelOf, type Series, signalsOf, unitOf } from './series';
import { colourOf, dashOf } from './twins';

export interface PaneOwner {
  changed(pane: Pane): void;
  chosen(pane: Pane): void;
  remove(pane: Pane): void;
  statistics(): boolean;
  /** The series with the same of the other logs, where these are laid over it. */
  twins?(series: Series[]): Series[];
  /** Whether a pane has a second axis: all leave room for it, so that times are one below the other. */
  secondAxis(): boolean;
}

interface Drawn {
  series: Series;
  curve: Curve | null;
  lane: boolean;
}

const kHeight = 170;
const kAsk_ms = 120;
/** Of an axis with its label. */
const kAxis_px = 64;
const kSync = 'tandem-time';

export class Pane implements LegendOwner {
  readonly series: Series[];
  private readonly plotBox = h('div', { class: 'plot-box' });
  private readonly lanes = new Lanes();
  private readonly legend: Legend;
  private readonly none = h(
    'p',
    { class: 'empty' },
    'Empty: search a signal above, and press Enter.',
  );
  readonly element: HTMLElement;
  private plot: uPlot | null = null;
  private shape = '';
  private window: { key: string; ids: number[]; data: Window } | null = null;
  private asking: ReturnType<typeof setTimeout> | null = null;
  private drawn: Drawn[] = [];
  private times: ArrayLike<number> = [];

  constructor(
    private readonly data: Data,
    private readonly owner: PaneOwner,
    series: Series[],
  ) {
    this.series = [...series];
    this.legend = new Legend(data, this);
    this.element = h(
      'div',
      {
        class: 'pane',
        role: 'group',
        'aria-label': 'plot',
        onpointerdown: () => owner.chosen(this),
      },
      h(
        'div',
        { class: 'pane-head' },
        h(
          'button',
          { type: 'button', class: 'into', onclick: () => owner.chosen(this) },
          'add here',
        ),
        h(
          'button',
          {
            type: 'button',
            class: 'quiet',
            'aria-label': 'remove this pane',
            onclick: () => owner.remove(this),
          },
          '×',
        ),
      ),
      this.none,
      this.plotBox,
      this.lanes.canvas,
      h('div', { class: 'legend-box' }, this.legend.element),
    );
    this.listSeries();
  }

  add(series: Series): void {
    if (this.series.some((one) => labelOf(one) === labelOf(series)) || this.series.length >= 16)
      return;
    this.series.push(...(this.owner.twins?.([series]) ?? [series]));
    this.listSeries();
    this.owner.changed(this);
  }

  /** Ids of the signals that it draws. */
  ids(): number[] {
    return this.series.flatMap((one) => signalsOf(one, this.data.catalog).map((s) => s.id));
  }

  /** Units of its lines: each has an axis. */
  units(): Set<string> {
    const lines = this.series.filter((one) => !this.isLane(one));
    return new Set(lines.map((one) => unitOf(one, this.data.catalog)));
  }

  /** Draws the span of the time model, from the newest rows or from what the run kept. */
  update(): void {
    const { from, to } = this.data.time.span();
    this.collect(from, to);
    const curves = this.drawn.filter((one) => !one.lane);
    this.none.hidden = this.series.length > 0;
    this.plotBox.hidden = curves.length === 0 && this.drawn.length === 0;
    this.build(curves);
    if (this.plot) {
      const columns = curves.flatMap(({ curve }) =>
        curve
          ? [listed(curve.min), listed(curve.max), listed(curve.middle)]
          : [[], [], []].map(() => new Array(this.times.length).fill(null)),
      );
      const table = [Array.from(this.times), ...columns] as uPlot.AlignedData;
      this.plot.batch(() => {
        this.plot?.setData(table, false);
        this.plot?.setScale('x', { min: from, max: to });
      });
    }
    this.values();
  }

  resize(): void {
    const width = this.plotBox.clientWidth;
    if (this.plot && width > 0) this.plot.setSize({ width, height: this.height() });
  }

  destroy(): void {
    this.plot?.destroy();
    this.plot = null;
    this.shape = '';
  }

  /** Values at the shown time, and the figures of the visible part. */
  values(): void {
    const time = this.data.time.shown();
    const at = Math.max(0, rowAt(this.times, time));
    this.drawn.forEach(({ series, curve, lane }, i) => {
      const value = curve && this.times.length > 0 ? curve.middle[at] : Number.NaN;
      const field = this.data.catalog.named(series.name)?.field ?? '';
      this.legend.show(i, lane ? wordOf(field, value) : number(value), lane ? null : curve);
    });
    const { from, to } = this.data.time.span();
    const left = this.plot ? this.plot.bbox.left / uPlot.pxRatio : 64;
    const width = this.plot
      ? this.plot.bbox.width / uPlot.pxRatio
      : this.element.clientWidth - left - 32;
    const lanes = this.drawn.flatMap(({ series, curve, lane }) =>
      lane && curve
        ? [
            {
              label: series.name.split('.').slice(1).join('.'),
              field: this.data.catalog.named(series.name)?.field ?? '',
              times: this.times,
              min: curve.min,
              max: curve.max,
            },
          ]
        : [],
    );
    this.lanes.draw(lanes, from, to, left, width, this.data.time.hover ?? this.data.time.selected);
  }

  listSeries(): void {
    this.legend.list();
    this.shape = '';
  }

  figures(): boolean {
    return this.owner.statistics();
  }
  drop(series: Series): void {
    this.series.splice(this.series.indexOf(series), 1);
    this.listSeries();
    this.owner.changed(this);
  }

  isLane(series: Series): boolean {
    return series.kind === 'signal' && this.data.catalog.named(series.name)?.lane === true;
  }

  private collect(from: number, to: number): void {
    const { catalog, history, time } = this.data;
    let rows: (name: string) => Curve | null;
    if (time.frozen) this.ask(from, to);
    if (time.frozen && this.window && this.window.data.rows > 0) {
      const { ids, data } = this.window;
      this.times = Float64Array.from({ length: data.rows }, (_, i) => data.start + i * data.step);
      const middle = ids.map((_, s) =>
        data.min[s] === data.max[s]
          ? data.min[s]
          : Float32Array.from(data.min[s], (low, i) => (low + data.max[s][i]) / 2),
      );
      rows = (name) => {
        const s = ids.indexOf(catalog.named(name)?.id ?? -1);
        return s < 0 ? null : { min: data.min[s], max: data.max[s], middle: middle[s] };
      };
    } else {
      const view = history.view(from, to);
      this.times = view.times;
      rows = (name) => {
        const id = catalog.named(name)?.id ?? -1;
        const [min, max, middle] = [view.min(id), view.max(id), view.last(id)];
        return min && max && middle ? { min, max, middle } : null;
      };
    }
    if (!time.frozen) this.window = null;
    this.drawn = this.series.map((series) => ({
      series,
      lane: this.isLane(series),
      curve: evaluate(series, this.times, rows),
    }));
  }

  /** What was asked for may not have happened. */
  forget(): void {
    this.window = null;
  }

  /** Asks for a span once it stands still. */
  private ask(from: number, to: number): void {
    const ids = [...new Set(this.ids())];
    const key = `${from} ${to} ${ids.join()}`;
    if (this.window?.key === key || ids.length === 0) return;
    const had = this.window?.data;
    const empty: Window = {
      id: 0,
      level: 0,
      rows: 0,
      cyclesPerRow: 1,
      start: 0,
      step: 0,
      min: [],
      max: [],
    };
    this.window = { key, ids: this.window?.ids ?? ids, data: had ?? empty };
    if (this.asking) clearTimeout(this.asking);
    this.asking = setTimeout(async () => {
      const points = Math.max(200, Math.round(this.plotBox.clientWidth || 600));
      const data = await this.data.source.window(ids, from, to, points);
      if (this.window?.key !== key) return;
      this.window = { key, ids, data };
      this.element.dataset.rows = String(data.rows);
      this.element.dataset.cyclesPerRow = String(data.cyclesPerRow);
      this.update();
    }, kAsk_ms);
  }

  private height(): number {
    return this.drawn.length > 0 && this.drawn.every((one) => one.lane) ? 60 : kHeight;
  }

  /** A new plot when its lines are others than before. */
  private build(curves: Drawn[]): void {
    const second = this.owner.secondAxis();
    const shape = `${second} ${this.series.map(labelOf).join('|')}`;
    if (shape === this.shape && (this.plot || this.drawn.length === 0)) return;
    const width = this.plotBox.clientWidth;
    if (width === 0) return;
    this.destroy();
    this.shape = shape;
    if (this.drawn.length === 0) return;
    const units = [...new Set(curves.map((one) => unitOf(one.series, this.data.catalog)))];
    const time = this.data.time;
    const lines: uPlot.Series[] = [{}];
    const bands: uPlot.Band[] = [];
    for (const { series } of curves) {
      const place = colourOf(series, this.series);
      const colour = () => theme(`--series-${place % kPaletteSize}`);
      const scale = `y ${unitOf(series, this.data.catalog)}`;
      const first = lines.length;
      lines.push({ scale, points: { show: false } }, { scale, points: { show: false } });
      lines.push({
        scale,
        stroke: colour,
        width: 1.4,
        points: { show: false },
        dash: dashOf(series) ?? (series.kind === 'signal' ? undefined : [5, 3]),
      });
      bands.push({
        series: [first + 1, first],
        fill: () => `${theme(`--series-${place % kPaletteSize}`)}44`,
      });
    }
    this.plot = new uPlot(
      {
        width,
        height: this.height(),
        padding: [
          8,
          20 + (second && units.length < 2 ? kAxis_px : 0),
          0,
          units.length === 0 ? kAxis_px : 0,
        ],
        series: lines,
        bands,
        legend: { show: false },
        scales: { x: { time: false } },
        axes: [timeAxis((one) => `${Number(one.toFixed(6))} s`), ...unitAxes(units)],
        cursor: {
          y: false,
          points: { show: false },
          drag: { x: true, y: false, setScale: false, dist: 6 },
          sync: { key: kSync, setSeries: false },
          bind: {
            dblclick: () => () => {
              time.follow();
              return null;
            },
          },
        },
        hooks: {
          setCursor: [
            (u) => {
              const left = u.cursor.left ?? -1;
              if (u.cursor.event) time.point(left < 0 ? null : u.posToVal(left, 'x'));
            },
          ],
          setSelect: [
            (u) => {
              if (u.select.width > 5)
                time.freeze(
                  u.posToVal(u.select.left, 'x'),
                  u.posToVal(u.select.left + u.select.width, 'x'),
                );
              u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            },
          ],
          draw: [(u) => eventMarks(u, this.data)],
        },
      },
      [[], ...lines.slice(1).map(() => [])] as uPlot.AlignedData,
      this.plotBox,
    );
    this.plot.over.addEventListener('click', () => {
      const left = this.plot?.cursor.left ?? -1;
      if (this.plot && left >= 0) time.select(this.plot.posToVal(left, 'x'));
    });
  }
}

/** The last row that is not after a time. */
function rowAt(times: ArrayLike<number>, time: number): number {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
