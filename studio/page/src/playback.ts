// Time of a recording: play, pause, speed, seek. The selected time of all panes is its time.
import type { Data } from './data';
import { attribute, h, say } from './dom';
import { seconds } from './format';
import type { RecordedSource } from './recorded';

const kSpeeds = ['0.05', '0.1', '0.25', '0.5', '1', '2', '5', '10'];

export class Playback {
  private playing = false;
  private last = 0;
  private shown = Number.NaN;
  private readonly button = h('button', {
    type: 'button',
    class: 'play',
    onclick: () => this.play(!this.playing),
  });
  private readonly speed = h(
    'select',
    { 'aria-label': 'speed of the playback' },
    ...kSpeeds.map((one) => h('option', { value: one }, `×${one}`)),
  );
  private readonly slider: HTMLInputElement;
  private readonly words = h('span', { class: 'play-time' });
  readonly element: HTMLElement;

  constructor(
    private readonly data: Data,
    private readonly source: RecordedSource,
  ) {
    const { start, end } = source;
    this.speed.value = '1';
    this.slider = h('input', {
      type: 'range',
      class: 'seek',
      min: start,
      max: end,
      step: 'any',
      'aria-label': 'time of the recording',
      oninput: () => data.time.select(Number(this.slider.value)),
      onkeydown: (event: KeyboardEvent) => this.key(event),
    });
    this.element = h(
      'section',
      { class: 'playback', 'aria-label': 'time of the recording' },
      this.button,
      this.slider,
      this.words,
      this.speed,
    );
    data.time.whole = { from: start, to: end };
    data.time.follow();
    data.time.on(() => this.follow());
    data.whenCatalog(() => data.time.select(source.first));
    this.show();
  }

  play(on: boolean): void {
    const at = this.data.time.selected ?? this.source.start;
    if (on && at >= this.source.end) this.data.time.select(this.source.start);
    this.playing = on;
    this.last = performance.now();
    this.show();
  }

  /** At each animation frame. */
  update(now: number): void {
    if (!this.playing) return;
    const passed = (Math.max(0, now - this.last) / 1000) * Number(this.speed.value);
    this.last = now;
    const at = (this.data.time.selected ?? this.source.start) + passed;
    if (at >= this.source.end) this.play(false);
    this.data.time.select(Math.min(at, this.source.end));
  }

  /** Somebody has selected another time. */
  private follow(): void {
    const { selected } = this.data.time;
    if (selected === null || selected === this.shown) return;
    this.shown = selected;
    this.source.seek(selected);
    this.show();
  }

  private show(): void {
    say(this.button, this.playing ? '‖ Pause' : '▶ Play');
    attribute(this.button, 'aria-pressed', String(this.playing));
    const at = this.data.time.selected ?? this.source.start;
    this.slider.value = String(at);
    attribute(this.slider, 'aria-valuetext', seconds(at));
    say(this.words, `${seconds(at)} of ${seconds(this.source.end)}`);
  }

  private key(event: KeyboardEvent): void {
    const by = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
    if (by === 0) return;
    event.preventDefault();
    const { time } = this.data;
    const step = (this.source.end - this.source.start) / (event.shiftKey ? 20 : 200);
    time.select((time.selected ?? this.source.start) + by * step);
  }
}
