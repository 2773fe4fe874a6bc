// The past of a simulated run: back by a second, to the selected time, to where a condition was true.
import type { Actions } from './actions';
import type { Data } from './data';
import { attribute, h, say } from './dom';
import { megabytes, seconds } from './format';
import type { Answer } from './protocol';

const kKey = 'tandem.studio.conditions';
const kMostConditions = 8;

/** What clock.show says of it. */
export interface KeptPast {
  keeps: boolean;
  checkpoints: number;
  bytes: number;
  budget_bytes: number;
  from_s: number | null;
}

/** How far back the run can go, in words. */
export function pastWords(past: KeptPast): string {
  if (!past.keeps && past.from_s === null)
    return 'Nothing is kept yet: pause, and from then on it is.';
  if (past.from_s === null) return 'Kept from now on.';
  return `Kept from ${seconds(past.from_s)} on: ${megabytes(past.bytes)} of ${Math.round(past.budget_bytes / 1e6)} MB.`;
}

/** Why the run cannot be taken to a selected time; empty: it can. */
export function whyNotTo(time: number | null, past: KeptPast | null, now: number): string {
  if (time === null) return 'Select a time first: click into a plot.';
  if (!past || past.from_s === null) return 'Nothing is kept yet.';
  if (time < past.from_s) return `The oldest time that is kept is ${seconds(past.from_s)}.`;
  if (!(time < now)) return 'That time has not been yet.';
  return '';
}

/** The newest first, each once. */
export function remembered(list: string[], condition: string): string[] {
  return [condition, ...list.filter((one) => one !== condition)].slice(0, kMostConditions);
}

function stored(): string[] {
  try {
    const list: unknown = JSON.parse(localStorage.getItem(kKey) ?? '[]');
    return Array.isArray(list) ? list.filter((one) => typeof one === 'string') : [];
  } catch {
    return [];
  }
}

export class PastPanel {
  private past: KeptPast | null = null;
  private conditions = stored();
  private readonly words = h('p', { class: 'why past-words' });
  private readonly wrong = h('p', { class: 'field-error', role: 'alert', hidden: true });
  private readonly list = h('datalist', { id: 'past-conditions' });
  private readonly condition = h('input', {
    type: 'text',
    class: 'condition',
    list: 'past-conditions',
    placeholder: 'torque(LKneeSag) > 40Nm',
    'aria-label': 'condition to go to',
    autocomplete: 'off',
    spellcheck: 'false',
    oninput: () => this.complain(null),
  });
  private readonly here: HTMLElement;
  private readonly awaited = h('span', {});
  private readonly waits: HTMLElement;
  readonly element: HTMLElement;

  constructor(
    private readonly data: Data,
    actions: Actions,
  ) {
    this.here = actions.button(
      'Take the robot back to here',
      () => {
        const time = data.time.selected;
        return this.whyNot() || time === null ? null : { do: 'clock.goto', time_s: rounded(time) };
      },
      { nothing: () => actions.tell('', this.whyNot(), true) },
    );
    const search = (label: string, command: string, title: string) =>
      actions.button(
        label,
        () => {
          const condition = this.condition.value.trim();
          return condition === '' ? null : { do: command, condition };
        },
        {
          title,
          done: (answer) => this.complain(answer),
          nothing: () => this.say(`Write a condition, such as ${this.condition.placeholder}.`),
        },
      );
    this.waits = h(
      'p',
      { class: 'past-waits', hidden: true },
      this.awaited,
      actions.button('Cancel', () => ({ do: 'clock.until', cancel: true }), {
        name: 'cancel: go on until',
        title: 'The condition is given up; time goes on as it does.',
      }),
    );
    this.element = h(
      'div',
      { class: 'past', role: 'group', 'aria-label': 'back in time' },
      actions.button('Back 1 s', () => ({ do: 'clock.rewind', by_s: 1 }), {
        title: 'Time goes back by a second, and stands there.',
      }),
      this.here,
      this.condition,
      this.list,
      search('Back until', 'clock.back-until', 'Back to where that became true last.'),
      search(
        'Go on until',
        'clock.until',
        'On until that becomes true; what holds already has to end first. One that waits is replaced.',
      ),
      this.waits,
      this.wrong,
      this.words,
    );
    data.time.on(() => this.show());
    this.listConditions();
    this.show();
  }

  /** What the clock says now. */
  watched(answer: Answer): void {
    this.past = (answer.past as KeptPast | undefined) ?? null;
    const why = typeof answer.no_past === 'string' ? `: ${answer.no_past}` : '';
    say(this.words, this.past ? pastWords(this.past) : `This run cannot go back in time${why}.`);
    for (const one of this.element.querySelectorAll<HTMLInputElement>('button, input')) {
      one.disabled = this.past === null;
    }
    const until = typeof answer.until === 'string' ? answer.until : '';
    this.waits.hidden = until === '';
    say(this.awaited, `◷ Goes on until ${until}`);
    this.show();
  }

  private whyNot(): string {
    return whyNotTo(this.data.time.selected, this.past, this.data.time.now);
  }

  private show(): void {
    const button = this.here.querySelector('button');
    if (!button) return;
    const why = this.whyNot();
    attribute(button, 'aria-disabled', why ? 'true' : null);
    attribute(button, 'aria-description', why || null);
  }

  private say(words: string): void {
    this.wrong.hidden = words === '';
    attribute(this.condition, 'aria-invalid', words ? 'true' : null);
    say(this.wrong, words);
  }

  /** Null: the condition is another one. */
  private complain(answer: Answer | null): void {
    if (answer?.ok) {
      this.conditions = remembered(this.conditions, this.condition.value.trim());
      this.listConditions();
      try {
        localStorage.setItem(kKey, JSON.stringify(this.conditions));
      } catch {
        // Not kept: the list ends with the page.
      }
    }
    const said = answer && !answer.ok ? [answer.error, answer.hint] : [];
    this.say(said.filter(Boolean).join(' – '));
  }

  private listConditions(): void {
    this.list.replaceChildren(...this.conditions.map((value) => h('option', { value })));
  }
}

/** A time as one writes it: a microsecond is less than any cycle. */
function rounded(time: number): number {
  return Math.round(time * 1e6) / 1e6;
}
