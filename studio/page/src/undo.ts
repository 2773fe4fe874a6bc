// A value that is set by a request, and taken back: its field, Set and Undo.
import type { Actions } from './actions';
import { attribute } from './dom';
import type { Request } from './protocol';

export interface Value {
  /** What it is called: "kp of squat". */
  name: string;
  field: HTMLInputElement | HTMLSelectElement;
  /** The request that sets a text; null: the text is no value. */
  request(text: string): Request | null;
  /** What a value is, for the words about a text that is none: "number". */
  type: string;
  /** Where there are many: Set has no button that copies its command. */
  bare?: boolean;
}

export interface Undoable {
  set: HTMLElement;
  undo: HTMLButtonElement;
  /** The value in force, as the run tells it: shown where nothing else is being typed. */
  tell(text: string): void;
}

export function undoable(actions: Actions, value: Value, first: string): Undoable {
  const { name, field } = value;
  const history: string[] = [];
  let inForce = first;
  const undo = actions.button('Undo', () => value.request(history.at(-1) ?? inForce), {
    name: `undo ${name}`,
    bare: true,
    done: (answer) => {
      if (!answer.ok) return;
      inForce = history.pop() ?? inForce;
      settle();
    },
  }) as HTMLButtonElement;
  const mark = () => field.classList.toggle('changed', field.value !== inForce);
  const settle = () => {
    field.value = inForce;
    undo.disabled = history.length === 0;
    mark();
  };
  const set = actions.button('Set', () => value.request(field.value), {
    name: `set ${name}`,
    bare: value.bare,
    nothing: () => actions.tell('', `${name}: '${field.value}' is no ${value.type}`, true),
    done: (answer) => {
      if (!answer.ok) return;
      if (field.value !== inForce) history.push(inForce);
      inForce = field.value;
      settle();
    },
  });
  field.addEventListener('input', mark);
  field.addEventListener('keydown', (event) => {
    if ((event as KeyboardEvent).key !== 'Enter') return;
    (set instanceof HTMLButtonElement ? set : set.querySelector('button'))?.click();
  });
  settle();
  return {
    set,
    undo,
    tell: (text) => {
      const typing = field.value !== inForce;
      if (text === inForce) return;
      inForce = text;
      if (typing) mark();
      else field.value = text;
      attribute(field, 'data-value', text);
    },
  };
}
