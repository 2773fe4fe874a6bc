// Who leads the joints: control is taken explicitly, and lives only while this page is alive.
import { h, say } from './dom';
import type { Control } from './protocol';
import type { Source } from './source';

const kAlive_ms = 200;
const kSilent =
  'Control ended by itself: this page was hidden, or silent for a second. The joints hold.';
const kWentBack =
  'Control ended, as time went back: what moved then goes on. Take control again, or halt all.';

export class ControlLease {
  state: Control = { taken: false, yours: false, by: '' };
  private may = 'look';
  private linked = false;
  private ended = false;
  private last = 0;
  /** Whether control was given back here. */
  private given = false;
  /** Why; empty: it did not. */
  private lost = '';
  private readonly listeners: (() => void)[] = [];
  private readonly button = h('button', {
    type: 'button',
    class: 'lease',
    onclick: () => {
      this.given = this.state.yours;
      this.source.control(!this.state.yours);
    },
  });
  private readonly words = h('span', { class: 'lease-words', role: 'status' });
  readonly element = h('div', { class: 'lease-row' }, this.button, this.words);

  constructor(private readonly source: Source) {
    source.on({
      control: (control) => this.set(control),
      entered: (may) => {
        this.may = may;
        this.set(this.state);
      },
      connection: (state) => {
        this.linked = state === 'live';
        this.ended = state === 'ended';
        if (!this.linked) this.may = 'look';
        this.set(this.state);
      },
    });
    this.set(this.state);
  }

  get mine(): boolean {
    return this.state.yours;
  }
  get mayChange(): boolean {
    return this.may === 'all';
  }
  /** Why nothing may be changed from here; empty: it may. */
  get why(): string {
    if (this.mayChange) return '';
    if (this.ended) return 'The run has ended.';
    return this.linked ? 'Looking only: open the address with its token.' : 'No connection.';
  }
  /** Why joints cannot be moved from here; empty: they can. */
  get whyNotMine(): string {
    const { taken, yours, by } = this.state;
    if (yours) return '';
    if (taken) return `${by || 'Another page'} has control of the joints.`;
    return this.why || 'Take control first.';
  }
  on(listener: () => void): void {
    this.listeners.push(listener);
  }

  private set(control: Control): void {
    const began = control.yours && !this.state.yours;
    if (control.yours) this.lost = '';
    else if (this.state.yours) this.lost = this.given ? '' : control.wentBack ? kWentBack : kSilent;
    this.state = control;
    if (began) requestAnimationFrame((now) => this.beat(now));
    document.body.dataset.control = control.yours ? 'yours' : control.taken ? 'taken' : 'free';
    document.body.dataset.may = this.may;
    say(this.button, control.yours ? 'Give control back' : 'Take control');
    this.button.disabled = !control.yours && (control.taken || !this.mayChange);
    let words = this.ended ? '' : this.lost;
    if (words === '') words = 'Nobody leads the joints from here.';
    if (control.yours) words = 'You lead the joints. If this page is hidden or lost, they hold.';
    else if (control.taken) words = `${control.by || 'Another page'} has control.`;
    else if (!this.mayChange) words = this.why;
    say(this.words, words);
    for (const listener of this.listeners) listener();
  }

  /** By animation frames: a frozen or hidden page draws none, and so says nothing. */
  private beat(now: number): void {
    if (!this.state.yours) return;
    if (now - this.last >= kAlive_ms) {
      this.last = now;
      this.source.alive();
    }
    requestAnimationFrame((next) => this.beat(next));
  }
}
