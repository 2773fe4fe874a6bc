// Inputs of the controllers as sliders: a sample is sent again while it is held.
import type { Actions } from './actions';
import type { Data } from './data';
import { h, say } from './dom';
import { number } from './format';
import type { Answer } from './protocol';

interface Input {
  input: string;
  controller: string;
  doc: string;
  source: string;
  active: boolean;
  fresh: boolean;
  timeout_s: number;
  after: string;
  components: string[];
  units: string[];
  values?: Record<string, number>;
}

const kSteps = 200;

export class Inputs {
  private readonly body = h('div', { class: 'cards' });
  private readonly holds = new Map<string, HTMLElement>();
  private shape = '?';
  readonly element = h('div', { class: 'inputs asks-run' }, this.body);

  constructor(
    data: Data,
    private readonly actions: Actions,
  ) {
    data.source.on({ watched: (request, answer) => this.watched(request, answer) });
  }

  private watched(request: string, answer: Answer): void {
    if (request !== 'input.list' || !answer.ok) return;
    const list = answer.inputs as Input[];
    const shape = list
      .map((one) => `${one.controller}/${one.input}/${one.source}/${one.active}`)
      .join('\n');
    if (shape !== this.shape) {
      this.shape = shape;
      this.holds.clear();
      const cards = list.map((one) => this.card(one));
      if (cards.length === 0)
        cards.push(h('p', { class: 'empty' }, 'No loaded controller has an input.'));
      this.body.replaceChildren(...cards);
    }
    for (const one of list) {
      const words = one.fresh
        ? 'a sample counts'
        : `no sample within ${one.timeout_s} s: ${one.after}`;
      const values = Object.entries(one.values ?? {}).map(
        ([name, value]) => `${name} ${number(value)}`,
      );
      const line = this.holds.get(`${one.controller}/${one.input}`);
      if (line) say(line, `${words}; holds ${values.join(', ') || 'a trajectory'}`);
    }
  }

  private card(one: Input): HTMLElement {
    const holds = h('p', { class: 'muted' });
    this.holds.set(`${one.controller}/${one.input}`, holds);
    const name = `${one.controller}/${one.input}`;
    const values: Record<string, number> = {};
    for (const component of one.components) values[component] = one.values?.[component] ?? 0;
    const may = one.source === 'command' && one.active && one.values !== undefined;
    const rows = may
      ? one.components.map((component, i) =>
          this.slider(name, component, one.units[i] ?? '', values),
        )
      : [];
    const why =
      one.source === 'command' ? 'its controller is not active' : `it is fed by: ${one.source}`;
    return h(
      'section',
      { class: 'card', 'aria-label': `input ${name}` },
      h(
        'div',
        { class: 'card-head' },
        h('h2', {}, name),
        may
          ? this.actions.button('Send', () => ({ do: 'input.set', name, values: { ...values } }), {
              name: `send ${name}`,
            })
          : h('span', { class: 'chip' }, why),
      ),
      h('p', { class: 'muted' }, one.doc),
      holds,
      ...rows,
    );
  }

  private slider(
    name: string,
    component: string,
    unit: string,
    values: Record<string, number>,
  ): HTMLElement {
    const most = h('input', {
      type: 'number',
      class: 'short',
      value: '1',
      min: '0',
      step: 'any',
      'aria-label': `range of ${component} [${unit}]`,
      title: 'range of the slider',
    });
    const shown = h('output', { class: 'figure' }, number(values[component]));
    const slider = h('input', {
      type: 'range',
      min: -kSteps,
      max: kSteps,
      value: '0',
      'aria-label': `${component} [${unit}]`,
    });
    slider.addEventListener('input', () => {
      values[component] = (Number(slider.value) / kSteps) * (Number(most.value) || 1);
      say(shown, number(values[component]));
    });
    slider.addEventListener('change', () => {
      void this.actions.run({ do: 'input.set', name, values: { ...values } });
    });
    const zero = h(
      'button',
      {
        type: 'button',
        'aria-label': `0: ${component} to zero`,
        onclick: () => {
          slider.value = '0';
          slider.dispatchEvent(new Event('input'));
          slider.dispatchEvent(new Event('change'));
        },
      },
      '0',
    );
    return h(
      'div',
      { class: 'slider-row' },
      h('span', { class: 'name' }, component),
      slider,
      shown,
      h('span', { class: 'unit' }, unit),
      h('label', { class: 'range' }, '± ', most),
      zero,
    );
  }
}
