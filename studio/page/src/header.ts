// The top of the page: which run, how it is, and the emergency stop.
import type { Actions } from './actions';
import type { Data } from './data';
import { attribute, h, say } from './dom';
import { age, seconds } from './format';
import type { Answer } from './protocol';
import type { Connection } from './source';

const kSilent_ms = 1000;

/** Ends that nothing went wrong in: what `ended` of `tandem run --json` says. */
const kWell = /^(as planned|on request|its controllers were done|(stopped|interrupted) by SIG)/;
const kNothingToStop =
  'The run has ended: there is nothing to stop from here. If the robot moves, use its own emergency stop.';

export class Header {
  private state: Connection = 'connecting';
  private why = '';
  private brokeAt = 0;
  private gaps = 0;
  private readonly robot = h('strong', { class: 'robot' }, '–');
  private readonly experiment = h('span', { class: 'experiment' });
  private readonly phase = h('span', { class: 'chip phase' }, '–');
  private readonly time = h('span', { class: 'clock' }, '–');
  private readonly rate = h('span', { class: 'rate' });
  private readonly measured = h('span', { class: 'rate measured' });
  private readonly link = h('span', { class: 'chip link' }, 'connecting');
  private readonly lost = h('span', { class: 'frames-lost' });
  private readonly stop: HTMLElement;
  private readonly reset: HTMLElement;
  private readonly start: HTMLElement;
  private readonly fault = h('p', { class: 'fault', role: 'alert', hidden: true });
  readonly element: HTMLElement;

  constructor(
    private readonly data: Data,
    private readonly actions: Actions,
    themeButton: HTMLElement,
  ) {
    this.stop = h(
      'button',
      {
        type: 'button',
        class: 'estop',
        title: 'Stops the robot; needs no control.\ntandem estop',
        onclick: async () => {
          if (this.state === 'ended') return this.alarm(kNothingToStop);
          const answer = await actions.run({ do: 'estop' });
          if (!answer.ok)
            this.alarm(`The stop is not confirmed: ${answer.error}. Type: tandem estop`);
        },
      },
      'EMERGENCY STOP',
    );
    this.reset = actions.button('Reset faults', () => ({ do: 'fault.reset' }), {
      class: 'attention',
    });
    this.start = actions.button('Start controllers', () => ({ do: 'controller.start' }), {
      class: 'attention',
    });
    this.reset.hidden = true;
    this.start.hidden = true;
    this.element = h(
      'header',
      { class: 'top' },
      h('h1', {}, 'Tandem studio'),
      h('div', { class: 'run' }, this.robot, this.experiment),
      h(
        'div',
        { class: 'facts' },
        data.source.live && this.phase,
        this.time,
        this.rate,
        this.measured,
        this.link,
        this.lost,
        this.reset,
        this.start,
      ),
      h('div', { class: 'right' }, themeButton, data.source.live && this.stop),
      this.fault,
    );
    data.source.on({
      connection: (state, words) => this.connection(state, words),
      watched: (request, answer) => this.watched(request, answer),
    });
    data.whenHello((hello) => {
      say(this.robot, hello.robot);
      say(this.experiment, hello.experiment);
      this.experiment.title = hello.experiment;
      document.title = `${hello.robot} – Tandem studio`;
    });
    setInterval(() => this.refresh(), 100);
  }

  /** At each frame that has new values. */
  update(): void {
    const tick = this.data.lastTick;
    if (!tick) return;
    say(this.time, seconds(tick.time));
    if (tick.gap) ++this.gaps;
    const gaps = this.gaps > 0 ? `${this.gaps} gaps in the values` : '';
    const lost = tick.lost > 0 ? `${tick.lost} frames lost` : '';
    say(this.lost, [lost, gaps].filter(Boolean).join(', '));
    document.body.dataset.time = String(tick.time);
    document.body.dataset.cycle = String(tick.cycle);
    document.body.dataset.lost = String(tick.lost);
    document.body.dataset.paused = String(tick.paused);
  }

  private alarm(words: string): void {
    this.fault.hidden = words === '';
    say(this.fault, words);
  }

  private connection(state: Connection, words: string): void {
    if (state === 'connecting' && this.state === 'lost') return;
    if (state === 'lost' && this.state !== 'lost') {
      const heard = this.data.heard;
      this.brokeAt = Number.isFinite(heard) ? heard : performance.now();
    }
    this.state = state;
    this.why = words;
    if (state === 'ended') {
      // It can still be pressed: then it says what is left to do.
      attribute(this.stop, 'aria-disabled', 'true');
      this.stop.title = kNothingToStop;
      this.reset.hidden = true;
      this.start.hidden = true;
    }
    this.refresh();
  }

  private refresh(): void {
    const now = performance.now();
    const quiet = now - this.data.heard;
    let words = 'connecting';
    let stale = true;
    if (this.state === 'ended') words = `ended${this.why ? `: ${this.why}` : ''}`;
    else if (this.state === 'lost') words = `lost ${age(now - this.brokeAt)} ago`;
    else if (this.state === 'recorded') {
      words = 'recorded';
      stale = false;
    } else if (this.state === 'live' && !this.data.lastTick) words = 'waiting for values';
    else if (this.state === 'live' && quiet > kSilent_ms) words = `silent for ${age(quiet)}`;
    else if (this.state === 'live') {
      const stands = this.data.hello?.emulated ? 'waits for SYNC' : 'paused';
      words = this.data.lastTick?.paused ? stands : 'live';
      stale = false;
    }
    const searching = this.state === 'live' && this.actions.searching;
    if (searching) words = 'searching backwards';
    this.measured.hidden = searching; // no cycle is made
    say(this.link, words);
    attribute(this.link, 'title', this.state === 'lost' ? `${this.why} It is tried again.` : null);
    document.body.dataset.state = this.state;
    document.body.classList.toggle('ended-well', this.state === 'ended' && kWell.test(this.why));
    document.body.classList.toggle('stale', stale);
  }

  private watched(request: string, answer: Answer): void {
    if (this.state === 'ended') return;
    if (request === 'status' && answer.ok) {
      const phase = String(answer.phase);
      say(this.phase, phase);
      document.body.dataset.phase = phase;
      const latched = Number(answer.latched ?? 0) > 0;
      this.reset.hidden = !latched;
      this.start.hidden = latched || phase !== 'held';
      if (!latched) this.alarm('');
    } else if (request === 'clock.show' && answer.ok) {
      const rate = Number(answer.rate);
      const factor = answer.realtime_factor;
      say(this.rate, rate === 0 ? 'free running' : `×${rate}`);
      say(this.measured, typeof factor === 'number' ? `measured ×${factor.toFixed(2)}` : '');
    } else if (request === 'fault.show' && answer.ok) {
      this.faults(answer);
    }
  }

  private faults(answer: Answer): void {
    if (!(Number(answer.latched) > 0) || !Array.isArray(answer.faults)) return;
    const faults = answer.faults as Record<string, unknown>[];
    const newest = faults.at(-1);
    if (!newest) return;
    const texts = ['joint', 'text', 'cause', 'advice'].map((key) => newest[key]);
    const words = texts.filter((one) => typeof one === 'string' && one !== '').join(' – ');
    this.alarm(faults.length > 1 ? `${words} (and ${faults.length - 1} more)` : words);
  }
}
