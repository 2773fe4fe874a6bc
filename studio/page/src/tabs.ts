// Panels of which one is seen: by pointer, or by arrow keys.
import { attribute, h } from './dom';

export interface Tab {
  name: string;
  label: string;
  content: HTMLElement;
}

export class Tabs {
  active = '';
  private readonly buttons: HTMLButtonElement[];
  readonly element: HTMLElement;

  constructor(
    private readonly tabs: Tab[],
    private readonly changed: (name: string) => void,
  ) {
    this.buttons = tabs.map((tab) =>
      h(
        'button',
        {
          type: 'button',
          role: 'tab',
          id: `tab-${tab.name}`,
          'aria-controls': `panel-${tab.name}`,
          onclick: () => this.open(tab.name),
        },
        tab.label,
      ),
    );
    const list = h(
      'div',
      {
        role: 'tablist',
        class: 'tabs',
        'aria-label': 'panels',
        onkeydown: (event: KeyboardEvent) => this.key(event),
      },
      ...this.buttons,
    );
    const panels = tabs.map((tab) =>
      h(
        'div',
        {
          role: 'tabpanel',
          id: `panel-${tab.name}`,
          'aria-labelledby': `tab-${tab.name}`,
          class: 'tab-panel',
        },
        tab.content,
      ),
    );
    this.element = h('section', { class: 'panels', 'aria-label': 'panels' }, list, ...panels);
  }

  open(name: string): void {
    this.active = name;
    this.tabs.forEach((tab, i) => {
      const on = tab.name === name;
      attribute(this.buttons[i], 'aria-selected', String(on));
      this.buttons[i].tabIndex = on ? 0 : -1;
      const panel = tab.content.parentElement;
      if (panel) panel.hidden = !on;
    });
    this.changed(name);
  }

  /** Those that there are; the others are not shown. */
  keep(names: string[]): void {
    this.tabs.forEach((tab, i) => {
      this.buttons[i].hidden = !names.includes(tab.name);
    });
    if (!names.includes(this.active)) this.open(names[0]);
  }

  private key(event: KeyboardEvent): void {
    const shown = this.buttons.filter((button) => !button.hidden);
    const { length } = shown;
    const at = shown.findIndex((button) => button.id === `tab-${this.active}`);
    const places: Record<string, number> = {
      ArrowRight: (at + 1) % length,
      ArrowLeft: (at + length - 1) % length,
      Home: 0,
      End: length - 1,
    };
    const next = places[event.key];
    if (next === undefined) return;
    event.preventDefault();
    shown[next].click();
    shown[next].focus();
  }
}
