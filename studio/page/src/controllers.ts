// The list of controllers, and the parameters of each: unit, range, set and undo.
import type { Actions } from './actions';
import type { ControlLease } from './control';
import type { Data } from './data';
import { attribute, h, say } from './dom';
import { micros, plain } from './format';
import type { Answer } from './protocol';
import { Shadows } from './shadows';
import { type Undoable, undoable } from './undo';

interface Parameter {
  name: string;
  type: string;
  elements: string[];
  unit: string;
  min: number | number[] | null;
  max: number | number[] | null;
  above_min: boolean;
  choices: string[];
  value: unknown;
  live: boolean;
  doc: string;
}
interface Controller {
  name: string;
  active: boolean;
  shadow?: boolean;
  finished: boolean;
  call_ns: { p50: number; p99: number; p999: number; max: number } | null;
  overruns: number;
  claims: { joint: string }[];
  parameters?: Parameter[];
}

interface Row {
  element: HTMLElement;
  state: HTMLElement;
  cost: HTMLElement;
  parameters: HTMLElement;
  /** What the parameters are, without what changes. */
  shape: string;
  values: Map<string, Undoable>;
}

/** A value of the parameter's type of what was typed. Undefined: it is none. */
export function parsed(parameter: Pick<Parameter, 'type'>, text: string): unknown {
  if (parameter.type === 'boolean') return text === 'true';
  if (parameter.type === 'choice') return text;
  const one = (part: string) => (part.trim() === '' ? Number.NaN : Number(part));
  if (parameter.type === 'numbers') {
    const list = text
      .replace(/[[\]]/g, '')
      .split(/[\s,]+/)
      .filter(Boolean)
      .map(one);
    if (list.length === 0 || !list.every(Number.isFinite)) return undefined;
    return list.length === 1 ? list[0] : list;
  }
  const value = one(text);
  if (!Number.isFinite(value)) return undefined;
  return parameter.type === 'integer' && !Number.isInteger(value) ? undefined : value;
}

function shown(value: unknown): string {
  return Array.isArray(value) ? value.join(', ') : String(value ?? '');
}

/** What was typed, as the run will tell it: one number for a list is that of every element. */
export function toldAs(parameter: Pick<Parameter, 'type' | 'elements'>, text: string): string {
  const value = parsed(parameter, text);
  const one = parameter.type === 'numbers' && typeof value === 'number';
  return shown(one ? parameter.elements.map(() => value) : value);
}

function range(parameter: Parameter): string {
  const { min, max } = parameter;
  const end = (of: number | number[]) => plain(Array.isArray(of) ? of[0] : of);
  if (min === null) return max === null ? '' : `≤ ${end(max)}`;
  const above = parameter.above_min ? '> ' : '≥ ';
  if (max === null || end(max) === '–') return end(min) === '–' ? '' : `${above}${end(min)}`;
  return `${parameter.above_min ? '> ' : ''}${end(min)} … ${end(max)}`;
}

const kShow = 'controller.show';

export class Controllers {
  private readonly rows = new Map<string, Row>();
  private readonly body = h('fieldset', { class: 'cards' });
  private readonly stop = h('select', { 'aria-label': 'controller to stop' });
  private readonly start = h('select', { 'aria-label': 'controller to start' });
  private readonly shadows: Shadows;
  private names = '';
  readonly element: HTMLElement;

  constructor(
    data: Data,
    private readonly actions: Actions,
    lease: ControlLease,
  ) {
    this.shadows = new Shadows(data, actions);
    const both = h(
      'fieldset',
      { class: 'toolbar' },
      h('legend', {}, 'Switch in one cycle'),
      h('label', {}, 'stop ', this.stop),
      h('label', {}, 'start ', this.start),
      actions.button('Switch', () => {
        const list = (choice: HTMLSelectElement) => (choice.value ? [choice.value] : []);
        return { do: 'controller.switch', stop: list(this.stop), start: list(this.start) };
      }),
    );
    this.element = h('div', { class: 'controllers asks-run' }, both, this.body);
    data.source.on({
      watched: (request, answer) => {
        if (request === kShow) this.show(answer);
      },
    });
    // What is watched is told when it changes: not where time went back to what was told before.
    data.whenBack(async () => {
      if (this.rows.size > 0) this.show(await data.source.ask({ do: kShow }));
    });
    lease.on(() => {
      both.disabled = !lease.mayChange;
      this.body.disabled = !lease.mayChange;
      attribute(this.body, 'aria-description', lease.why || null);
      this.body.title = lease.why;
    });
  }

  private show(answer: Answer): void {
    if (!answer.ok) return;
    const list = answer.controllers as Controller[];
    const names = list.map((one) => one.name).join('\n');
    if (names !== this.names) {
      this.names = names;
      this.rows.clear();
      this.shadows.clear();
      this.body.replaceChildren(...list.map((one) => this.card(one)));
      for (const choice of [this.stop, this.start]) {
        choice.replaceChildren(
          h('option', { value: '' }, 'none'),
          ...list.map((one) => h('option', { value: one.name }, one.name)),
        );
      }
    }
    for (const one of list) {
      const row = this.rows.get(one.name);
      if (!row) continue;
      const finished = one.finished ? ', its task is done' : '';
      const idle = one.shadow ? '◌ shadow' : '■ inactive';
      say(row.state, one.active ? `▶ active${finished}` : idle);
      attribute(row.element, 'data-active', String(one.active));
      attribute(row.element, 'data-shadow', String(one.shadow === true));
      const cost = one.call_ns;
      const joints = one.claims.length === 1 ? '1 joint' : `${one.claims.length} joints`;
      say(
        row.cost,
        cost
          ? `${joints}; a cycle takes ${micros(cost.p50)}, p99 ${micros(cost.p99)}, most ${micros(cost.max)}; late ${one.overruns} times`
          : joints,
      );
      this.parameters(row, one);
    }
    if (list.length === 0) say(this.body, 'No controller is loaded: tandem controller load NAME.');
  }

  private card(one: Controller): HTMLElement {
    const state = h('span', { class: 'chip' });
    const cost = h('p', { class: 'muted' });
    const parameters = h('div', { class: 'parameters' });
    const element = h(
      'section',
      { class: 'card', 'aria-label': `controller ${one.name}` },
      h(
        'div',
        { class: 'card-head' },
        h('h2', {}, one.name),
        state,
        this.actions.button('Start', () => ({ do: 'controller.start', name: one.name }), {
          name: `start ${one.name}`,
        }),
        this.actions.button('Stop', () => ({ do: 'controller.stop', name: one.name }), {
          name: `stop ${one.name}`,
          title: 'Its joints are held.',
        }),
        h('span', { class: 'begins-shadow' }, this.shadows.button(one.name, false)),
        h('span', { class: 'ends-shadow' }, this.shadows.button(one.name, true)),
      ),
      cost,
      this.shadows.part(one.name),
      parameters,
    );
    this.rows.set(one.name, { element, state, cost, parameters, shape: '', values: new Map() });
    return element;
  }

  /** Their values; the table is made again where it has other rows, as after a reload. */
  private parameters(row: Row, one: Controller): void {
    const list = one.parameters ?? [];
    const shape = JSON.stringify(list.map((each) => (each.live ? { ...each, value: null } : each)));
    if (shape !== row.shape) {
      row.shape = shape;
      row.values.clear();
      row.parameters.replaceChildren();
      if (list.length > 0) row.parameters.append(this.table(row, one.name, list));
    }
    for (const each of list) row.values.get(each.name)?.tell(shown(each.value));
  }

  private table(row: Row, controller: string, list: Parameter[]): HTMLElement {
    const heads = ['parameter', 'value', 'unit', 'range', 'change'];
    return h(
      'div',
      {
        class: 'table-box',
        tabindex: '0',
        role: 'region',
        'aria-label': `parameters of ${controller}`,
      },
      h(
        'table',
        { class: 'parameter-table' },
        h('thead', {}, h('tr', {}, ...heads.map((head) => h('th', { scope: 'col' }, head)))),
        h('tbody', {}, ...list.map((parameter) => this.parameter(row, controller, parameter))),
      ),
    );
  }

  private parameter(row: Row, controller: string, parameter: Parameter): HTMLElement {
    const first = shown(parameter.value);
    const words = `${parameter.name} of ${controller}`;
    const field = this.field(parameter, first, words);
    const request = (text: string) => {
      const value = parsed(parameter, text);
      if (value === undefined) return null;
      return { do: 'controller.set', name: controller, parameters: { [parameter.name]: value } };
    };
    const told = (text: string) => toldAs(parameter, text);
    const value = undoable(
      this.actions,
      { name: words, field, request, told, type: parameter.type },
      first,
    );
    const { set, undo, note } = value;
    if (parameter.live) row.values.set(parameter.name, value);
    return h(
      'tr',
      {},
      h(
        'th',
        { scope: 'row', title: parameter.doc },
        parameter.name,
        h('span', { class: 'doc' }, parameter.doc),
      ),
      h('td', {}, ...(parameter.live ? [field, note] : [h('span', { class: 'figure' }, first)])),
      h('td', {}, parameter.unit),
      h('td', {}, range(parameter)),
      h(
        'td',
        {},
        ...(parameter.live ? [set, undo] : [h('span', { class: 'muted' }, 'fixed while loaded')]),
      ),
    );
  }

  private field(
    parameter: Parameter,
    value: string,
    name: string,
  ): HTMLInputElement | HTMLSelectElement {
    const choices = parameter.type === 'boolean' ? ['true', 'false'] : parameter.choices;
    if (choices.length > 0) {
      const choice = h(
        'select',
        { 'aria-label': name },
        ...choices.map((one) => h('option', { value: one }, one)),
      );
      choice.value = value;
      return choice;
    }
    return h('input', { type: 'text', inputmode: 'decimal', 'aria-label': name, value });
  }
}
