// What the 3D view can show beside the robot: a row is a layer, with its switch and its legend.
import type * as THREE from 'three';
import { ControllerMarks } from './controller_marks';
import type { Data } from './data';
import { h } from './dom';
import type { Layer } from './layer';
import type { Model } from './model';

interface Row {
  layer: Layer;
  label: string;
  title: string;
  shown: boolean;
}

export class Layers {
  readonly legend = h('ul', { class: 'scene-legend', hidden: true, 'aria-label': 'drawn beside' });
  readonly toggles: HTMLElement[];
  private readonly rows: Row[] = [
    {
      layer: new ControllerMarks(),
      label: 'marks',
      title: 'what controllers draw: points, arrows, lines and words',
      shown: true,
    },
  ];
  private counts: number[] = [];

  /** @param changed something is to be drawn anew. */
  constructor(private readonly changed: () => void) {
    this.toggles = this.rows.map((row) => this.toggle(row));
  }

  get objects(): THREE.Object3D[] {
    return this.rows.map((row) => row.layer.object);
  }

  setModel(model: Model | null): void {
    for (const row of this.rows) row.layer.setModel(model);
    this.changed();
  }

  wire(data: Data): number[] {
    const ids = this.rows.map((row) => row.layer.wire(data));
    this.counts = ids.map((one) => one.length);
    this.tell();
    return ids.flat();
  }

  pose(values: number[]): void {
    let at = 0;
    this.rows.forEach((row, i) => {
      row.layer.pose(values.slice(at, at + this.counts[i]));
      at += this.counts[i];
    });
    this.legend.dataset.shown = String(this.rows.reduce((sum, row) => sum + row.layer.shown, 0));
  }

  private tell(): void {
    this.rows.forEach((row, i) => {
      row.layer.object.visible = row.shown;
      this.toggles[i].hidden = row.layer.legend.length === 0;
    });
    const seen = this.rows.filter((row) => row.shown).flatMap((row) => row.layer.legend);
    this.legend.replaceChildren(
      ...seen.map(({ name, colour }) => {
        const swatch = h('span', { class: 'swatch', 'aria-hidden': 'true' });
        swatch.style.background = colour;
        return h('li', {}, swatch, name);
      }),
    );
    this.legend.hidden = seen.length === 0;
    this.changed();
  }

  private toggle(row: Row): HTMLElement {
    const box = h('input', {
      type: 'checkbox',
      checked: row.shown,
      onchange: () => {
        row.shown = box.checked;
        this.tell();
      },
    });
    return h('label', { class: 'toggle', title: row.title, hidden: true }, box, row.label);
  }
}
