// Time of the run: pause, resume, step, rate, and back.
import type { Actions } from './actions';
import type { ControlLease } from './control';
import type { Data } from './data';
import { h, say } from './dom';
import { PastPanel } from './past';
import type { Answer } from './protocol';

export class ClockPanel {
  private readonly cycles = h('input', {
    type: 'number',
    min: '1',
    max: '1000000000',
    value: '10',
    'aria-label': 'cycles of a step',
  });
  private readonly rate = h('select', { 'aria-label': 'simulated seconds per second' });
  private readonly words = h('span', { class: 'why' });
  private readonly body: HTMLElement;
  private readonly past: PastPanel;
  readonly element: HTMLElement;
  private simulated: boolean | null = null;
  private told = Number.NaN;

  constructor(
    data: Data,
    actions: Actions,
    private readonly lease: ControlLease,
  ) {
    for (const rate of ['0.1', '0.25', '0.5', '1', '2', '5', '0']) {
      this.rate.append(
        h('option', { value: rate }, rate === '0' ? 'as fast as possible' : `×${rate}`),
      );
    }
    this.rate.value = '1';
    this.past = new PastPanel(data, actions);
    this.body = h(
      'fieldset',
      { class: 'clock-body asks-run' },
      h('legend', {}, 'Robot time'),
      actions.button('Pause', () => ({ do: 'clock.pause' }), { title: 'Simulated time stands.' }),
      actions.button('Resume', () => ({ do: 'clock.resume' })),
      this.cycles,
      actions.button(
        'Step',
        () => ({
          do: 'clock.step',
          cycles: Math.max(1, Math.round(Number(this.cycles.value)) || 1),
        }),
        { title: 'While time is paused: so many cycles.' },
      ),
      this.rate,
      actions.button('Set rate', () => ({ do: 'clock.rate', rate: Number(this.rate.value) })),
      this.words,
      this.past.element,
    );
    this.element = h(
      'section',
      { class: 'clock-panel', 'aria-label': 'time of the run' },
      this.body,
    );
    data.source.on({ watched: (request, answer) => this.watched(request, answer) });
    lease.on(() => this.allow());
    this.allow();
  }

  private watched(request: string, answer: Answer): void {
    if (request !== 'clock.show' || !answer.ok) return;
    this.simulated = answer.clock === 'simulated';
    this.showRate(Number(answer.rate));
    this.past.watched(answer);
    this.past.element.hidden = !this.simulated;
    if (!this.simulated) {
      const by = answer.clock === 'bus' ? 'the bus' : 'the real clock';
      say(this.words, `Time is advanced by ${by}: only simulated time can be paused.`);
    }
    this.allow();
  }

  /** What the run has, when it changes: until then the choice is the reader's. */
  private showRate(rate: number): void {
    if (!Number.isFinite(rate) || rate === this.told) return;
    this.told = rate;
    const value = String(rate);
    if (![...this.rate.options].some((one) => one.value === value)) {
      this.rate.append(h('option', { value }, `×${value}`));
    }
    this.rate.value = value;
  }

  private allow(): void {
    const may = this.lease.mayChange;
    (this.body as HTMLFieldSetElement).disabled = this.simulated !== true || !may;
    if (this.simulated !== false) say(this.words, this.lease.why);
  }
}
