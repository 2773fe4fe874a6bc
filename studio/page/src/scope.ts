// The oscilloscope's panel: channels, trigger, captures one over the other, step responses.
import { csv, float32, saveFile } from './csv';
import type { Data } from './data';
import { h, say } from './dom';
import { wordOf } from './enums';
import { digits, duration, seconds } from './format';
import { ScopeControls } from './scope_controls';
import { type Capture, ScopeEngine } from './scope_engine';
import { ScopePlot } from './scope_plot';
import { firstSettings, kMostChannels, type ScopeSettings } from './scope_settings';
import { signalSearch } from './search';
import { settingChanges } from './setting_changes';
import type { Connection } from './source';
import { stepTable } from './step_table';
import { triggerWords } from './trigger';

/** Pictures a second: many captures cost more than numbers. */
const kEvery_ms = 80;
/** Settings that say how captures are shown, not which are taken. */
const kOfThePicture = ['overlay', 'response', 'reference'];

export class Scope {
  settings: ScopeSettings = firstSettings();
  readonly element: HTMLElement;
  private readonly engine: ScopeEngine;
  private readonly controls: ScopeControls;
  private readonly plot: ScopePlot;
  private readonly words = h('p', { class: 'scope-state', role: 'status' });
  private readonly channels = h('tbody');
  private readonly at = h('caption', { class: 'at' });
  private readonly steps = h('div', {
    class: 'table-box',
    tabindex: '0',
    role: 'region',
    'aria-label': 'step responses',
  });
  private values: HTMLElement[] = [];
  private dirty = true;
  /** Whose picture is seen; `anew`: with other settings. */
  private drawn: Capture[] = [];
  private anew = true;
  private last = 0;
  private found = '';
  private link: Connection = 'connecting';

  /** @param kept the settings are others than before: they belong into the layout */
  constructor(
    private readonly data: Data,
    private readonly tell: (words: string, bad?: boolean) => void,
    private readonly kept: () => void,
  ) {
    const run = {
      period_s: () => data.hello?.period_s ?? 0.001,
      newest: () =>
        Math.round((data.time.whole?.to ?? data.time.now) / (data.hello?.period_s ?? 0.001)),
      reach_s: () =>
        data.source.live ? (data.hello?.history_s[0] ?? 1) : Number.POSITIVE_INFINITY,
      idOf: (name: string) => data.catalog.named(name)?.id,
    };
    this.engine = new ScopeEngine(data.source, run, this.settings, () => {
      this.dirty = true;
    });
    this.plot = new ScopePlot(
      () => this.showValues(),
      (time) => data.time.select(time),
    );
    this.controls = new ScopeControls(data.source.live, {
      change: (part) => this.change(part),
      arm: () => this.engine.arm(),
      stop: () => this.engine.stop(),
      force: () => void this.force(),
      find: (forward) => void this.find(forward),
      clear: () => this.engine.clear(),
      save: () => this.save(),
      joint: (name) => this.tuneJoint(name),
    });
    this.element = h(
      'div',
      { class: 'scope' },
      h(
        'div',
        { class: 'toolbar' },
        signalSearch(data, (signal) => this.add(signal.name), 'scope-found'),
        this.controls.joints,
      ),
      this.controls.trigger,
      this.controls.record,
      this.words,
      this.plot.element,
      h(
        'div',
        { class: 'table-box', tabindex: '0', role: 'region', 'aria-label': 'channels' },
        h('table', { class: 'legend' }, this.at, this.channels),
      ),
      this.controls.responses,
      this.steps,
    );
    data.whenTick(() => this.engine.tick());
    data.source.on({
      connection: (state) => {
        this.link = state;
        if (state === 'ended') this.engine.stop();
      },
    });
    data.whenCatalog(() => this.list());
    // What was set parts the captures that are there.
    data.whenEvents(() => {
      this.dirty = true;
      this.anew = true;
    });
    this.list();
  }

  /** Takes the settings of a layout. */
  apply(settings: ScopeSettings): void {
    this.settings = settings;
    this.engine.set(settings);
    this.list();
  }

  themeChanged(): void {
    this.plot.themeChanged();
  }

  /** At each animation frame while the panel is seen. */
  update(now: number): void {
    this.state();
    if (!this.dirty || now - this.last < kEvery_ms) return;
    this.last = now;
    this.dirty = false;
    if (this.engine.captures === this.drawn && !this.anew) return;
    this.drawn = this.engine.captures;
    this.anew = false;
    const captures = this.shown();
    this.plot.draw({
      captures,
      channels: this.settings.channels.map((name) => ({
        name,
        unit: this.unitOf(name),
        dashed: name === this.settings.reference,
      })),
      trigger: this.settings.trigger,
    });
    this.showValues();
    const { response, reference } = this.settings;
    this.steps.hidden = captures.length === 0 || response === '';
    if (!this.steps.hidden) {
      const changes = settingChanges(this.data.events);
      this.steps.replaceChildren(
        stepTable(captures, response, reference, this.unitOf(response), changes),
      );
    }
    this.element.dataset.captures = String(captures.length);
    this.element.dataset.trigger = captures[0]
      ? String(captures[0].trigger * captures[0].period_s)
      : '';
  }

  private shown(): Capture[] {
    return this.engine.captures.slice(0, this.settings.overlay);
  }
  private unitOf(name: string): string {
    return this.data.catalog.named(name)?.unit ?? '';
  }

  private change(part: Partial<ScopeSettings>): void {
    const settings = { ...this.settings, ...part };
    if (Object.keys(part).every((key) => kOfThePicture.includes(key))) {
      this.settings = settings;
      this.list();
    } else this.apply(settings);
    this.kept();
  }

  private add(name: string): void {
    const { channels, trigger } = this.settings;
    if (channels.includes(name)) return;
    if (channels.length >= kMostChannels) {
      this.tell(`The oscilloscope has ${kMostChannels} channels: remove one first.`, true);
      return;
    }
    this.change({
      channels: [...channels, name],
      trigger: trigger.signal ? trigger : { ...trigger, signal: name },
    });
  }
  private remove(name: string): void {
    const { channels, response, reference } = this.settings;
    this.change({
      channels: channels.filter((one) => one !== name),
      response: response === name ? '' : response,
      reference: reference === name ? '' : reference,
    });
  }

  /** What one wants to see of a joint whose gains are tuned. */
  private tuneJoint(name: string): void {
    const [position, reference, torque] = ['state.position_rad', 'command.position_rad']
      .concat('state.torque_Nm')
      .map((field) => this.data.catalog.named(`${field}.${name}`)?.name ?? '');
    if (!position || !reference) {
      this.tell(`The run has no position and reference of ${name}.`, true);
      return;
    }
    this.change({
      channels: [position, reference, torque].filter((one) => one),
      trigger: { ...firstSettings().trigger, signal: reference, kind: 'changes' },
      response: position,
      reference,
    });
  }

  private async force(): Promise<void> {
    if (await this.engine.force(this.data.time.selected)) return;
    this.tell('Nothing is kept of that time at full rate, or there is no channel.', true);
  }

  private async find(forward: boolean): Promise<void> {
    const { time } = this.data;
    const found = await this.engine.find(time.selected ?? (forward ? -1 : time.now), forward);
    this.found = found === null ? `No trigger ${forward ? 'after' : 'before'} that time. ` : '';
    if (found !== null) time.select(found);
  }

  private save(): void {
    const [capture] = this.shown();
    if (!capture) {
      this.tell('There is no capture to save: arm, or force one.', true);
      return;
    }
    const names = [...capture.channels.keys()];
    const time = (cycle: number) => String(Number((cycle * capture.period_s).toFixed(9)));
    const head = [
      'time [s]',
      'since trigger [s]',
      ...names.map((name) => `${name} [${this.unitOf(name)}]`),
    ];
    const rows = Array.from({ length: capture.count }, (_, i) => [
      time(capture.first + i),
      time(capture.first + i - capture.trigger),
      ...[...capture.channels.values()].map((values) => float32(values[i])),
    ]);
    saveFile(`tandem-scope-${time(capture.trigger)}s.csv`, 'text/csv', csv(head, rows));
  }

  private list(): void {
    const { channels } = this.settings;
    this.controls.show(this.settings, this.data.hello?.joints.map((one) => one.name) ?? []);
    this.values = [];
    this.channels.replaceChildren(
      ...channels.map((name, i) => {
        const known = this.data.catalog.named(name);
        const value = h('td', { class: 'figure' }, '–');
        this.values.push(value);
        return h(
          'tr',
          { class: known ? undefined : 'unknown' },
          h('td', {}, h('span', { class: 'swatch', style: `--c: var(--series-${i})` })),
          h('th', { scope: 'row', title: known?.doc }, known ? name : `${name} (not in this run)`),
          value,
          h('td', {}, this.unitOf(name)),
          h(
            'td',
            {},
            h(
              'button',
              {
                type: 'button',
                class: 'quiet',
                'aria-label': `remove channel ${name}`,
                onclick: () => this.remove(name),
              },
              '×',
            ),
          ),
        );
      }),
    );
    const trigger = this.data.catalog.named(this.settings.trigger.signal);
    this.data.want('scope', trigger ? [trigger.id] : []);
    this.dirty = true;
    this.anew = true;
  }

  private showValues(): void {
    const [capture] = this.shown();
    const { row } = this.plot;
    const at = row !== null && capture && row < capture.count ? row : null;
    const since = capture && at !== null ? capture.first + at - capture.trigger : 0;
    say(
      this.at,
      this.settings.channels.length === 0
        ? 'Search a signal above, and press Enter: it becomes a channel. Or choose a joint to tune.'
        : at === null
          ? 'Point at the picture for values; a drag zooms, a click selects the time everywhere.'
          : `Newest capture, ${duration(since * capture.period_s)} from the trigger:`,
    );
    this.settings.channels.forEach((name, i) => {
      const value = at === null ? Number.NaN : (capture.channels.get(name)?.[at] ?? Number.NaN);
      const signal = this.data.catalog.named(name);
      say(this.values[i], signal?.lane ? wordOf(signal.field, value) : digits(value, 5));
    });
  }

  private state(): void {
    const { state, missed_s, captures } = this.engine;
    const { trigger } = this.settings;
    const signal = this.data.catalog.named(trigger.signal);
    const waits = triggerWords(trigger, signal?.unit ?? '');
    const newest = captures[0] ? seconds(captures[0].trigger * captures[0].period_s) : '';
    let words = '';
    if (!trigger.signal) words = 'Choose a signal to trigger on.';
    else if (!signal) words = `This run has no signal ${trigger.signal}: choose another trigger.`;
    else if (!this.data.source.live) {
      words = `${this.found}Trigger: ${waits}.${newest ? ` Shown: ${newest}.` : ''}`;
    } else if (state === 'waiting') words = `Waiting until ${waits}.`;
    else if (state === 'filling')
      words = `Triggered: ${Math.floor(100 * this.engine.filled)} % of the record are there.`;
    else if (state === 'filled') words = `Filled: triggered at ${newest}. Arm waits for another.`;
    else if (this.link === 'ended') words = 'The run is over: nothing comes any more.';
    else words = `Stopped. Arm waits until ${waits}.`;
    if (this.link === 'lost') words += ' There is no connection: it goes on when there is one.';
    if (missed_s > 0) {
      words += ` ${duration(missed_s)} are not kept at full rate: triggers in them are not seen.`;
    }
    say(this.words, words);
    this.element.dataset.state = state;
    this.controls.now(
      signal ? this.data.latest(signal.id) : Number.NaN,
      state !== 'stopped' && state !== 'filled',
      signal !== undefined && !(this.data.source.live && this.link === 'ended'),
    );
  }
}
