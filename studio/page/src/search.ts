// The search of signals: a field with a list, by pointer or by keys.
import type { Data } from './data';
import { attribute, h } from './dom';
import type { Signal } from './signals';

/** @param id of its list, another one for each search of the page */
export function signalSearch(
  data: Data,
  chosen: (signal: Signal) => void,
  id = 'found',
): HTMLElement {
  let found: Signal[] = [];
  let active = 0;
  const list = h('ul', {
    id,
    role: 'listbox',
    'aria-label': 'found signals',
    class: 'found',
    hidden: true,
  });
  const field = h('input', {
    type: 'search',
    class: 'search',
    role: 'combobox',
    placeholder: 'Search a signal: knee torque',
    'aria-label': 'search a signal; Enter adds it',
    'aria-expanded': 'false',
    'aria-controls': id,
    'aria-autocomplete': 'list',
    autocomplete: 'off',
    spellcheck: 'false',
    oninput: () => {
      active = 0;
      show();
    },
    onfocus: () => show(),
    onblur: () => setTimeout(hide, 150),
    onkeydown: (event: KeyboardEvent) => {
      if (event.key === 'ArrowDown') active = Math.min(active + 1, found.length - 1);
      else if (event.key === 'ArrowUp') active = Math.max(active - 1, 0);
      else if (event.key === 'Escape') return hide();
      else if (event.key === 'Enter' && found[active]) return chosen(found[active]);
      else return;
      event.preventDefault();
      mark();
    },
  });

  function hide(): void {
    list.hidden = true;
    attribute(field, 'aria-expanded', 'false');
    attribute(field, 'aria-activedescendant', null);
  }
  function mark(): void {
    [...list.children].forEach((item, i) => {
      attribute(item, 'aria-selected', String(i === active));
      if (i === active && !list.hidden) item.scrollIntoView({ block: 'nearest' });
    });
    attribute(field, 'aria-activedescendant', found[active] ? `${id}-${active}` : null);
  }
  function show(): void {
    found = data.catalog.search(field.value);
    const items = found.map((signal, i) =>
      h(
        'li',
        {
          id: `${id}-${i}`,
          role: 'option',
          onpointerdown: (event: Event) => {
            event.preventDefault();
            chosen(signal);
          },
        },
        h('span', { class: 'found-name' }, signal.name),
        h('span', { class: 'found-unit' }, signal.unit),
        h('span', { class: 'found-doc' }, signal.doc),
      ),
    );
    if (found.length === 0 && field.value.trim() !== '') {
      items.push(
        h(
          'li',
          { role: 'option', 'aria-disabled': 'true', class: 'none' },
          'No signal has all these words.',
        ),
      );
    }
    list.replaceChildren(...items);
    list.hidden = items.length === 0;
    attribute(field, 'aria-expanded', String(items.length > 0));
    mark();
  }
  return h('div', { class: 'search-box' }, field, list);
}
