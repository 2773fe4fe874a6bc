// All panes: search, time of the picture, layouts.
import { eventWords } from './command';
import { saveFile } from './csv';
import type { Data } from './data';
import { attribute, h, say } from './dom';
import { seconds } from './format';
import { keepLayout, keptLayout, kPresets, type Layout, readLayout } from './layout';
import { eventNear, signOf } from './marks';
import { Pane, type PaneOwner } from './pane';
import type { ScopeSettings } from './scope_settings';
import { signalSearch } from './search';
import type { Series } from './series';
import { kWidths } from './time';
import { prefixOf, withTwins } from './twins';

const kMostPanes = 12;
/** Pictures a second: a plot costs more than a number. */
const kEvery_ms = 50;

export class Plots implements PaneOwner {
  /** Whose settings are part of the layout. */
  scope: { settings: ScopeSettings; apply(settings: ScopeSettings): void } | null = null;
  private panes: Pane[] = [];
  private active: Pane | null = null;
  private figures = false;
  private overlay = true;
  private dirty = true;
  private pointed = false;
  private last = 0;
  private readonly box = h('div', { class: 'panes' });
  private readonly words = h('p', { class: 'at', role: 'status' });
  private readonly live = h('button', {
    type: 'button',
    class: 'live',
    onclick: () => this.toggleLive(),
  });
  private readonly width = h('select', { 'aria-label': 'seconds that are seen' });
  private readonly now = h(
    'button',
    { type: 'button', onclick: () => this.data.time.select(null) },
    'Back to now',
  );
  private readonly file = h('input', {
    type: 'file',
    accept: '.json,application/json',
    hidden: true,
    'aria-label': 'layout file',
  });
  readonly element: HTMLElement;

  constructor(
    private readonly data: Data,
    private readonly tell: (words: string, bad?: boolean) => void,
  ) {
    const time = data.time;
    for (const width of kWidths) this.width.append(h('option', { value: width }, `${width} s`));
    this.width.value = String(time.width);
    this.width.addEventListener('change', () => {
      time.follow(Number(this.width.value));
      this.keep();
    });
    this.file.addEventListener('change', () => void this.import());
    this.element = h(
      'div',
      { class: 'plots' },
      h(
        'div',
        { class: 'toolbar' },
        signalSearch(data, (signal) => this.target().add({ kind: 'signal', name: signal.name })),
        this.button('New pane', () => this.chosen(this.push([]))),
      ),
      h(
        'div',
        { class: 'toolbar', role: 'group', 'aria-label': 'time of the picture' },
        this.live,
        this.width,
        this.button('−', () => time.zoom(2), 'zoom out'),
        this.button('+', () => time.zoom(0.5), 'zoom in'),
        this.button('◀', () => time.pan(-0.4), 'earlier'),
        this.button('▶', () => time.pan(0.4), 'later'),
        this.data.source.live
          ? this.now
          : this.button('Whole log', () => time.follow(), 'shows all of it'),
        this.statisticsToggle(),
        this.overlayToggle(),
        this.presets(),
        this.button('Save layout', () => this.export(), 'saves the layout as a file'),
        this.button('Open layout', () => this.file.click(), 'opens a layout file'),
        this.file,
      ),
      this.words,
      this.box,
    );
    this.element.addEventListener('keydown', (event) => this.key(event));
    time.on(() => {
      this.dirty = true;
    });
    data.whenEvents(() => {
      this.dirty = true;
    });
    data.whenBack(() => {
      for (const pane of this.panes) pane.forget();
    });
    data.whenCatalog(() => this.load());
    new ResizeObserver(() => {
      for (const pane of this.panes) pane.resize();
      this.dirty = true;
    }).observe(this.box);
    this.box.addEventListener('pointerleave', () => time.point(null));
    this.element.dataset.panes = '0';
  }

  statistics(): boolean {
    return this.figures;
  }
  twins(series: Series[]): Series[] {
    return this.overlay && !this.data.source.live ? withTwins(series, this.data.catalog) : series;
  }
  secondAxis(): boolean {
    return this.panes.some((pane) => pane.units().size > 1);
  }
  chosen(pane: Pane): void {
    this.active = pane;
    for (const one of this.panes) one.element.classList.toggle('active', one === pane);
  }
  changed(): void {
    this.want();
    this.keep();
    this.dirty = true;
  }
  remove(pane: Pane): void {
    this.panes = this.panes.filter((one) => one !== pane);
    pane.destroy();
    pane.element.remove();
    if (this.active === pane) this.active = null;
    this.changed();
  }
  themeChanged(): void {
    for (const pane of this.panes) pane.destroy();
    this.dirty = true;
  }

  /** At each animation frame while the panel is seen. */
  update(now: number): void {
    const { time } = this.data;
    const cycle = this.data.lastTick?.cycle ?? 0;
    if (!time.frozen && this.box.dataset.cycle !== String(cycle)) this.dirty = true;
    if (!this.dirty || now - this.last < kEvery_ms) return;
    this.last = now;
    this.dirty = false;
    this.box.dataset.cycle = String(cycle);
    for (const pane of this.panes) pane.update();
    say(this.live, time.frozen ? 'Follow again' : 'Pause picture');
    this.live.title = time.frozen
      ? 'The picture follows the run again.'
      : 'The picture stands; the robot goes on.';
    attribute(this.live, 'aria-pressed', String(time.frozen !== null));
    // It keeps its place: the buttons beside it do not jump.
    this.now.disabled = time.selected === null;
    this.now.title = time.selected === null ? 'No time is selected: values are those of now.' : '';
    const span = time.span();
    this.element.dataset.from = String(span.from);
    this.element.dataset.to = String(span.to);
    this.element.dataset.selected = time.selected === null ? '' : String(time.selected);
    this.at();
  }

  private at(): void {
    const { time } = this.data;
    const event = eventNear(this.data, this.box.clientWidth);
    let words = time.frozen && !time.whole ? 'The picture stands. ' : '';
    if (time.hover !== null) words += `Values at ${seconds(time.hover)}.`;
    else if (time.selected !== null)
      words += `Values at the selected time, ${seconds(time.selected)}.`;
    else words += 'Values of now. Click selects a time, dragging a span; arrow keys move.';
    if (event)
      words += ` ${signOf(event.level)} ${event.who ? `${event.who}: ` : ''}${eventWords(event)}`;
    say(this.words, words);
    if (time.hover !== null) this.pointed = true;
    else if (this.pointed) {
      this.pointed = false;
      this.dirty = true;
    }
  }

  private button(label: string, act: () => void, name = ''): HTMLElement {
    return h(
      'button',
      {
        type: 'button',
        onclick: act,
        'aria-label': /\w/.test(label) ? undefined : name,
        title: name || undefined,
      },
      label,
    );
  }

  private toggleLive(): void {
    if (this.data.time.frozen) this.data.time.follow();
    else this.data.time.freeze();
  }

  private statisticsToggle(): HTMLElement {
    const box = h('input', {
      type: 'checkbox',
      onchange: () => {
        this.figures = box.checked;
        for (const pane of this.panes) pane.listSeries();
        this.dirty = true;
      },
    });
    return h(
      'label',
      { class: 'toggle', title: 'min, max, mean, rms and standard deviation of what is seen' },
      box,
      'statistics',
    );
  }

  /** Of several logs: the same signals of all. */
  private overlayToggle(): HTMLElement {
    const box = h('input', {
      type: 'checkbox',
      checked: true,
      onchange: () => {
        this.overlay = box.checked;
        for (const pane of this.panes) {
          const own = pane.series.filter((one) => prefixOf(one) === '');
          pane.series.splice(0, pane.series.length, ...this.twins(own));
          pane.listSeries();
        }
        this.changed();
      },
    });
    const label = h('label', { class: 'toggle', hidden: true }, box, 'all logs');
    label.title = 'each signal of all logs: those of B and C are dashed';
    this.data.whenCatalog(() => {
      label.hidden = !this.data.catalog.signals.some((one) => one.source.startsWith('B/'));
    });
    return label;
  }

  private presets(): HTMLElement {
    const choice = h(
      'select',
      {
        'aria-label': 'preset layout',
        onchange: () => {
          const make = kPresets[choice.value];
          if (make && this.data.hello) this.set(make(this.data.hello, this.data.catalog));
          choice.value = '';
          this.changed();
        },
      },
      h('option', { value: '' }, 'Preset…'),
      ...Object.keys(kPresets).map((name) => h('option', { value: name }, name)),
    );
    return choice;
  }

  private key(event: KeyboardEvent): void {
    const from = event.target as HTMLElement;
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(from.tagName)) return;
    const { time } = this.data;
    const span = time.span();
    const step = (span.to - span.from) / (event.shiftKey ? 20 : 200);
    const at = time.selected ?? time.now;
    if (event.key === 'ArrowLeft') time.select(at - step);
    else if (event.key === 'ArrowRight') time.select(at + step);
    else if (event.key === 'Escape') {
      time.select(null);
      time.follow();
    } else return;
    event.preventDefault();
  }

  private target(): Pane {
    if (!this.active) this.chosen(this.panes[0] ?? this.push([]));
    return this.active as Pane;
  }

  private push(series: Layout['panes'][number]['series']): Pane {
    if (this.panes.length >= kMostPanes) {
      this.tell(`There are ${kMostPanes} panes: remove one first.`, true);
      return this.panes[this.panes.length - 1];
    }
    const pane = new Pane(this.data, this, series);
    this.panes.push(pane);
    this.box.append(pane.element);
    this.dirty = true;
    return pane;
  }

  private load(): void {
    if (!this.data.hello) return;
    if (this.panes.length > 0) {
      for (const pane of this.panes) pane.listSeries();
    } else {
      this.set(
        keptLayout(this.data.hello.robot) ?? kPresets.overview(this.data.hello, this.data.catalog),
      );
    }
    this.want();
  }

  private set(layout: Layout): void {
    for (const pane of [...this.panes]) {
      pane.destroy();
      pane.element.remove();
    }
    this.panes = [];
    this.active = null;
    const width = kWidths.find((one) => one >= layout.width_s) ?? 10;
    this.width.value = String(width);
    this.data.time.follow(width);
    for (const pane of layout.panes) this.push(this.twins(pane.series));
    if (layout.scope) this.scope?.apply(layout.scope);
    this.want();
  }

  private layout(): Layout {
    return {
      version: 1,
      width_s: this.data.time.width,
      panes: this.panes.map((pane) => ({ series: pane.series })),
      scope: this.scope?.settings,
    };
  }

  private want(): void {
    this.element.dataset.panes = String(this.panes.length);
    this.data.want('plots', [...new Set(this.panes.flatMap((pane) => pane.ids()))], true);
  }
  /** The browser remembers what is shown. */
  keep(): void {
    if (this.data.hello) keepLayout(this.data.hello.robot, this.layout());
  }

  private export(): void {
    const text = JSON.stringify(this.layout(), null, 2);
    saveFile('tandem-layout.json', 'application/json', text);
  }

  private async import(): Promise<void> {
    const file = this.file.files?.[0];
    this.file.value = '';
    if (!file) return;
    try {
      this.set(readLayout(await file.text()));
      this.changed();
      this.tell(`The layout of ${file.name} is shown.`);
    } catch (error) {
      this.tell(`${file.name}: ${error instanceof Error ? error.message : error}`, true);
    }
  }
}
