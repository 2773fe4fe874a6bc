// What of a description is not drawn, or not as it is: lines that open to lists.
import { h } from './dom';
import type { Meshes } from './meshes';

function line(words: string, names: string[], hint = ''): HTMLElement[] {
  if (names.length === 0) return [];
  const list = h('ul', {}, ...names.map((name) => h('li', {}, name)));
  return [h('details', { class: 'not-drawn' }, h('summary', {}, words), hint, list)];
}

export class NotDrawn {
  private readonly shapes = h('div', {});
  private readonly coarser = h(
    'p',
    { class: 'not-drawn', hidden: true },
    'ground drawn coarser: it has too many edges',
  );
  readonly element = h('div', {}, this.shapes, this.coarser);

  ground(coarser: boolean): void {
    this.coarser.hidden = !coarser;
  }

  show(names: string[], { coarse, most }: Meshes): void {
    this.shapes.replaceChildren(
      ...line(`not drawn: ${names.length} shapes`, names),
      ...line(
        `drawn coarser: ${coarse.length} ${coarse.length === 1 ? 'mesh' : 'meshes'}`,
        coarse,
        `In this browser a robot has ${most.toLocaleString('en')} triangles at most. To see a mesh as it is, simplify its file (Blender: Decimate), or use a browser with a graphics processor.`,
      ),
    );
  }
}
