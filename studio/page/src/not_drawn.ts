// What of a description is not drawn: a line that opens to a list.
import { h } from './dom';

export class NotDrawn {
  readonly element = h('details', { class: 'not-drawn', hidden: true });

  show(names: string[]): void {
    this.element.replaceChildren(
      h('summary', {}, `not drawn: ${names.length} shapes`),
      h('ul', {}, ...names.map((name) => h('li', {}, name))),
    );
    this.element.hidden = names.length === 0;
  }
}
