// A value that is set by a request, and taken back: its field, Set and Undo.
import type { Actions } from './actions';
import { attribute, h, say } from './dom';
import type { Request } from './protocol';

export interface Value {
  /** What it is called: "kp of squat". */
  name: string;
  field: HTMLInputElement | HTMLSelectElement;
  /** The request that sets a text; null: the text is no value. */
  request(text: string): Request | null;
  /** How the run will tell a value that was typed so: "0.50" is 0.5. */
  told(text: string): string;
  /** What a value is, for the words about a text that is none: "number". */
  type: string;
  /** Where there are many: Set has no button that copies its command. */
  bare?: boolean;
}

export interface Undoable {
  set: HTMLElement;
  undo: HTMLButtonElement;
  /** Says what is in force where the field shows something else. */
  note: HTMLElement;
  /** The value in force, as the run tells it: shown where nothing else is being typed. */
  tell(text: string): void;
}

/** What is in force, what was asked for, and what Undo goes back to. */
export class Setting {
  /** Asked for, and not yet in force; null: nothing is. */
  asked: string | null = null;
  private before: string[] = [];

  constructor(public inForce: string) {}

  get wanted(): string {
    return this.asked ?? this.inForce;
  }
  /** What Undo asks for; undefined: there is nothing to take back. */
  get former(): string | undefined {
    return this.before.at(-1);
  }

  /** The run has taken `text`. @param done it is in force; else it will be. */
  set(text: string, done: boolean): void {
    if (text !== this.wanted) this.before.push(this.wanted);
    this.take(text, done);
  }

  /** The run has taken `text`, which was the former value. */
  undone(text: string, done: boolean): void {
    if (text === this.former) this.before.pop();
    this.take(text, done);
  }

  /** What the run tells. A value that is not from here, as after a rewind, ends what can be undone. */
  tell(text: string): void {
    if (text === this.inForce) return;
    if (text !== this.asked) this.before.length = Math.max(0, this.before.lastIndexOf(text));
    this.inForce = text;
    this.asked = null;
  }

  private take(text: string, done: boolean): void {
    if (done) this.inForce = text;
    this.asked = done || text === this.inForce ? null : text;
  }
}

export function undoable(actions: Actions, value: Value, first: string): Undoable {
  const { name, field } = value;
  const setting = new Setting(first);
  const note = h('span', { class: 'doc in-force', hidden: true });
  let typed = false;
  const texts = new WeakMap<Request, string>();
  const request = (text: string) => {
    const asked = value.request(text);
    if (asked) texts.set(asked, text);
    return asked;
  };
  const undo = actions.button('Undo', () => request(setting.former ?? setting.wanted), {
    name: `undo ${name}`,
    bare: true,
    done: (answer, asked) => {
      if (!answer.ok) return;
      setting.undone(texts.get(asked) ?? setting.wanted, answer.done !== false);
      typed = false;
      show();
    },
  }) as HTMLButtonElement;
  const show = () => {
    if (typed && field !== document.activeElement) typed = field.value !== setting.wanted;
    if (!typed) field.value = setting.wanted;
    undo.disabled = setting.former === undefined;
    const differs = field.value !== setting.inForce;
    field.classList.toggle('changed', differs);
    const asked = !typed && setting.asked !== null ? 'asked for; ' : '';
    const words = differs ? `${asked}in force: ${setting.inForce}` : '';
    say(note, words);
    note.hidden = words === '';
    attribute(field, 'aria-description', words || null);
  };
  const set = actions.button('Set', () => request(field.value), {
    name: `set ${name}`,
    bare: value.bare,
    nothing: () => actions.tell('', `${name}: '${field.value}' is no ${value.type}`, true),
    done: (answer, asked) => {
      if (!answer.ok) return;
      const text = texts.get(asked) ?? field.value;
      setting.set(value.told(text), answer.done !== false);
      typed = field.value !== text;
      show();
    },
  });
  field.addEventListener('input', () => {
    typed = true;
    show();
  });
  field.addEventListener('blur', show);
  field.addEventListener('keydown', (event) => {
    if ((event as KeyboardEvent).key !== 'Enter') return;
    (set instanceof HTMLButtonElement ? set : set.querySelector('button'))?.click();
  });
  show();
  return {
    set,
    undo,
    note,
    tell: (text) => {
      setting.tell(text);
      show();
    },
  };
}
