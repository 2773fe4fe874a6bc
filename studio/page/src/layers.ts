// What the 3D view can show beside the robot: a row is a layer, with its switch and its legend.
import type * as THREE from 'three';
import { ControllerMarks } from './controller_marks';
import type { Data } from './data';
import { h } from './dom';
import { RobotGhost } from './ghost';
import { patchColour, patchWords } from './ground';
import type { Layer } from './layer';
import type { Model } from './model';
import { Prediction } from './prediction';
import type { Ground } from './protocol';
import { Pushes } from './pushes';

interface Row {
  layer: Layer;
  label: string;
  title: string;
}

/** Of another log, by its letter: its truth has the base where the robot was simulated. */
function ghostOf(letter: string, colour: string): Layer {
  const [state, ...base] = ['state', 'truth', 'estimate'].map((name) => `${letter}/${name}`);
  return new RobotGhost(letter, colour, [{ state, base }]);
}

export class Layers {
  readonly legend = h('ul', { class: 'scene-legend', hidden: true, 'aria-label': 'drawn beside' });
  private readonly rows: Row[] = [
    {
      layer: new ControllerMarks(),
      label: 'marks',
      title: 'what controllers draw: points, arrows, lines and words',
    },
    {
      layer: new Pushes((layer) => this.show(layer)),
      label: 'pushes',
      title: 'the sum of all pushes on the simulated robot: 1 m is 100 N',
    },
    {
      // Of a run one source has all of it; of a log there are the topics.
      layer: new RobotGhost('twin', '#d6249f', [
        { state: 'parallel', base: ['parallel'] },
        { state: 'parallel/state', base: ['parallel/truth'] },
      ]),
      label: 'twin',
      title: 'the robot that runs in parallel, as a ghost',
    },
    {
      layer: ghostOf('B', '#e8590c'),
      label: 'B',
      title: 'the robot of the second log, as a ghost',
    },
    {
      layer: ghostOf('C', '#1a9e3f'),
      label: 'C',
      title: 'the robot of the third log, as a ghost',
    },
    {
      layer: new Prediction((layer) => this.show(layer)),
      label: 'predicted',
      title: 'where the model will be, as it was asked for',
    },
  ];
  private readonly switches = this.rows.map(() =>
    h('input', { type: 'checkbox', checked: true, onchange: () => this.tell() }),
  );
  private readonly labels = this.rows.map(({ label, title }, i) =>
    h('label', { class: 'toggle', title, hidden: true }, this.switches[i], label),
  );
  private counts: number[] = [];
  private patches: { name: string; colour: string }[] = [];

  /** @param changed something is to be drawn anew. */
  constructor(private readonly changed: () => void) {}

  /** For the toolbar: what each has to choose, and its switch. */
  get toggles(): HTMLElement[] {
    return this.rows.flatMap(({ layer }, i) =>
      layer.controls ? [layer.controls, this.labels[i]] : [this.labels[i]],
    );
  }

  get objects(): THREE.Object3D[] {
    return this.rows.map((row) => row.layer.object);
  }

  setModel(model: Model | null): void {
    for (const row of this.rows) row.layer.setModel(model);
    this.tell();
  }

  /** Patches of the ground, which are always shown. */
  setGround(ground: Ground | null): void {
    this.patches = (ground?.patches ?? []).map((patch, i) => ({
      name: patchWords(patch),
      colour: patchColour(i),
    }));
    this.tell();
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

  /** Something is in it that was asked for. */
  private show(layer: Layer): void {
    this.switches[this.rows.findIndex((row) => row.layer === layer)].checked = true;
    this.tell();
  }

  private tell(): void {
    const shown = this.rows.filter(({ layer }, i) => {
      this.labels[i].hidden = layer.legend.length === 0;
      layer.object.visible = this.switches[i].checked;
      return layer.object.visible;
    });
    const seen = [...shown.flatMap((row) => row.layer.legend), ...this.patches];
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
}
