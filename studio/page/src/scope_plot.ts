// The picture of the oscilloscope: captures one over the other, older ones paler, and a cursor.
import uPlot from 'uplot';
import { listed, timeAxis, unitAxes } from './axes';
import { h, theme } from './dom';
import type { Capture } from './scope_engine';
import type { Trigger } from './trigger';

export interface ScopePicture {
  /** Newest first. */
  captures: Capture[];
  channels: { name: string; unit: string; dashed: boolean }[];
  trigger: Trigger;
}

const kHeight = 280;
const kColours = 8;
/** Opacity of the older captures, from the second newest to the oldest. */
const kPale = [0.45, 0.15];

export class ScopePlot {
  readonly element = h('div', {
    class: 'plot-box scope-plot',
    tabindex: '0',
    role: 'group',
    'aria-label': 'captures, aligned at the trigger; arrow keys move the cursor, Escape shows all',
    onkeydown: (event: KeyboardEvent) => this.key(event),
  });
  /** Row of the newest capture below the cursor; null: none. */
  row: number | null = null;
  private picture: ScopePicture | null = null;
  private plot: uPlot | null = null;
  private shape = '';
  /** Cycle of the first column, counted from the trigger. */
  private first = 0;
  /** What is seen, when it is not all [s]. */
  private zoom: { min: number; max: number } | null = null;

  /** @param moved the cursor is elsewhere  @param chosen a time [s] of the run was clicked */
  constructor(
    private readonly moved: () => void,
    private readonly chosen: (time_s: number) => void,
  ) {
    new ResizeObserver(() => {
      const width = this.element.clientWidth;
      if (width === 0) return;
      if (this.plot) this.plot.setSize({ width, height: kHeight });
      else if (this.picture) this.draw(this.picture);
    }).observe(this.element);
  }

  draw(picture: ScopePicture): void {
    this.picture = picture;
    const { captures, channels } = picture;
    this.element.hidden = captures.length === 0;
    const width = this.element.clientWidth;
    if (captures.length === 0 || width === 0) return;
    const { period_s } = captures[0];
    const begin = Math.min(...captures.map((one) => one.first - one.trigger));
    const end = Math.max(...captures.map((one) => one.first + one.count - one.trigger));
    this.first = begin;
    const times = Array.from({ length: end - begin }, (_, i) => (begin + i) * period_s);
    const columns = [...captures].reverse().flatMap((capture) =>
      channels.map(({ name }) => {
        const column = new Array<number | null>(end - begin).fill(null);
        const values = listed(capture.channels.get(name) ?? []);
        const offset = capture.first - capture.trigger - begin;
        for (let i = 0; i < values.length; ++i) column[offset + i] = values[i];
        return column;
      }),
    );
    this.build(picture, width);
    this.plot?.batch(() => {
      this.plot?.setData([times, ...columns] as uPlot.AlignedData, false);
      this.plot?.setScale('x', this.zoom ?? { min: begin * period_s, max: (end - 1) * period_s });
    });
  }

  themeChanged(): void {
    this.shape = '';
    if (this.picture) this.draw(this.picture);
  }

  /** The picture has the whole records again. */
  private all(): void {
    this.zoom = null;
    if (this.picture) this.draw(this.picture);
  }

  private key(event: KeyboardEvent): void {
    if (event.key === 'Escape') this.all();
    const newest = this.picture?.captures[0];
    const by = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
    if (!newest || !this.plot || by === 0) return;
    event.preventDefault();
    const step = event.shiftKey ? Math.max(1, Math.round(newest.count / 50)) : 1;
    const at = this.row ?? newest.trigger - newest.first;
    this.row = Math.min(newest.count - 1, Math.max(0, at + by * step));
    const time = (newest.first + this.row - newest.trigger) * newest.period_s;
    this.plot.setCursor({ left: this.plot.valToPos(time, 'x'), top: 10 }, false);
    this.moved();
  }

  /** A new plot when its lines are others than before. */
  private build({ captures, channels }: ScopePicture, width: number): void {
    const shape = `${captures.length} ${JSON.stringify(channels)}`;
    if (this.plot && shape === this.shape) return;
    this.shape = shape;
    this.plot?.destroy();
    const units = [...new Set(channels.map((one) => one.unit))];
    const lines = captures.flatMap((_, k) =>
      channels.map(({ unit, dashed }, c): uPlot.Series => {
        const age = captures.length - 1 - k;
        return {
          scale: `y ${unit}`,
          stroke: () => `${theme(`--series-${c % kColours}`)}${paleness(age, captures.length)}`,
          width: age === 0 ? 1.8 : 1.2,
          dash: dashed ? [6, 4] : undefined,
          points: { show: false },
        };
      }),
    );
    this.plot = new uPlot(
      {
        width,
        height: kHeight,
        padding: [8, units.length < 2 ? 22 : 0, 0, 0],
        series: [{}, ...lines],
        legend: { show: false },
        scales: { x: { time: false } },
        axes: [timeAxis((one) => `${Number((1e3 * one).toFixed(3))} ms`), ...unitAxes(units)],
        cursor: {
          y: false,
          points: { show: false },
          drag: { x: true, y: false, setScale: false, dist: 6 },
          bind: {
            dblclick: () => () => {
              this.all();
              return null;
            },
          },
        },
        hooks: {
          setCursor: [(u) => this.point(u)],
          setSelect: [(u) => this.select(u)],
          draw: [(u) => this.marks(u)],
        },
      },
      [[], ...lines.map(() => [])] as uPlot.AlignedData,
      this.element,
    );
    this.plot.over.addEventListener('click', () => {
      const newest = this.picture?.captures[0];
      if (newest && this.row !== null) this.chosen((newest.first + this.row) * newest.period_s);
    });
  }

  private point(plot: uPlot): void {
    const newest = this.picture?.captures[0];
    const column = plot.cursor.idx;
    if (!newest || !plot.cursor.event || column === null || column === undefined) return;
    const row = this.first + column - (newest.first - newest.trigger);
    this.row = row >= 0 && row < newest.count ? row : null;
    this.moved();
  }

  private select(plot: uPlot): void {
    const { left, width } = plot.select;
    if (width <= 5) return;
    this.zoom = { min: plot.posToVal(left, 'x'), max: plot.posToVal(left + width, 'x') };
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    plot.setScale('x', this.zoom);
  }

  /** The trigger's time, and its level where its signal is drawn. */
  private marks(plot: uPlot): void {
    if (!this.picture) return;
    const { trigger, channels } = this.picture;
    const { left, top, width, height } = plot.bbox;
    const context = plot.ctx;
    const line = (x0: number, y0: number, x1: number, y1: number) => {
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
      context.stroke();
    };
    context.save();
    context.beginPath();
    context.rect(left, top, width, height);
    context.clip();
    context.strokeStyle = theme('--accent');
    context.lineWidth = devicePixelRatio;
    context.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
    const x = Math.round(plot.valToPos(0, 'x', true)) + 0.5;
    line(x, top, x, top + height);
    const channel = channels.find((one) => one.name === trigger.signal);
    const levels = { changes: [], outside: [trigger.level, trigger.upper] }[trigger.kind as string];
    for (const level of channel ? (levels ?? [trigger.level]) : []) {
      const y = Math.round(plot.valToPos(level, `y ${channel?.unit}`, true)) + 0.5;
      line(left, y, left + width, y);
    }
    context.restore();
  }
}

/** Two digits of opacity for a capture of some age. */
function paleness(age: number, count: number): string {
  if (age === 0) return '';
  const share = count > 2 ? (age - 1) / (count - 2) : 0;
  const opacity = kPale[0] + share * (kPale[1] - kPale[0]);
  return Math.round(255 * opacity)
    .toString(16)
    .padStart(2, '0');
}
