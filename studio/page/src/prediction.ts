// Where the run's model will be after some time: asked for, and shown as a ghost.
import type * as THREE from 'three';
import type { Data } from './data';
import { h, say } from './dom';
import { seconds } from './format';
import { Ghost, type Posture } from './ghost';
import type { Layer } from './layer';
import type { Model } from './model';
import type { Answer } from './protocol';

const kColour = '#008c96';
/** What `predict` allows [s]. */
const kMost_s = 10;

/** The end of a prediction. */
export interface Foreseen extends Posture {
  time_s: number;
  /** What is to be known of it; empty: nothing. */
  remark: string;
}

/** The last row of an answer to `predict`. */
export function foreseen(answer: Answer): Foreseen {
  const { from_s, cycles, period_ns, end, joints, base, ...more } = answer as unknown as {
    from_s: number;
    cycles: number;
    period_ns: number;
    end: string;
    joints: Record<string, { position_rad: number[] }>;
    base: { position_m: number[][]; quaternion: number[][] } | null;
    unarchived_controllers?: string[];
  };
  const anew = more.unarchived_controllers ?? [];
  const remarks = [
    ...(end === 'horizon' ? [] : [end]),
    ...(anew.length === 0 ? [] : [`${anew.join(', ')} began anew`]),
  ];
  const last = <T>(rows: T[]) => rows[rows.length - 1];
  const names = Object.entries(joints);
  return {
    time_s: from_s + Math.max(0, cycles - 1) * 1e-9 * period_ns,
    remark: remarks.join('; '),
    joints: new Map(names.map(([name, rows]) => [name, last(rows.position_rad) ?? Number.NaN])),
    base: base ? [...(last(base.position_m) ?? []), ...(last(base.quaternion) ?? [])] : [],
  };
}

export class Prediction implements Layer {
  legend: Layer['legend'] = [];
  shown = 0;
  private readonly ghost = new Ghost(kColour);
  private readonly ahead = h('input', {
    type: 'number',
    min: '0.01',
    max: String(kMost_s),
    step: 'any',
    value: '1',
    size: '4',
    'aria-label': 'seconds ahead',
  });
  private readonly button = h(
    'button',
    {
      type: 'button',
      title: 'where the model of the run will be then: tandem predict',
      onclick: () => void this.ask(),
    },
    'predict',
  );
  private readonly words = h('span', { role: 'status' });
  readonly controls = h(
    'span',
    { class: 'toggle predict asks-run', hidden: true },
    this.button,
    this.ahead,
    's',
    this.words,
  );
  private data: Data | null = null;
  private end: Foreseen | null = null;

  /** @param show there is a new one. */
  constructor(private readonly show: (layer: Layer) => void) {}

  get object(): THREE.Object3D {
    return this.ghost.object;
  }

  setModel(model: Model | null): void {
    this.ghost.of(model);
    this.end = null;
    this.legend = [];
  }

  wire(data: Data): number[] {
    this.data = data;
    this.controls.hidden = !data.source.live || !!data.hello?.emulated;
    return [];
  }

  pose(): void {
    this.shown = Number(this.object.visible && this.end !== null && this.ghost.stand(this.end));
  }

  private async ask(): Promise<void> {
    const horizon_s = Number(this.ahead.value);
    const period_s = this.data?.hello?.period_s ?? 0.001;
    if (!(horizon_s > 0 && horizon_s <= kMost_s)) {
      say(this.words, `up to ${kMost_s} s`);
      return;
    }
    this.button.disabled = true;
    // The last row is asked for: those before it are not drawn.
    const every_cycles = Math.ceil(horizon_s / period_s);
    const answer = await this.data?.source.ask({ do: 'predict', horizon_s, every_cycles });
    this.button.disabled = false;
    if (!answer?.ok) {
      say(this.words, `${answer?.error ?? 'no answer'}${answer?.hint ? ` – ${answer.hint}` : ''}`);
      return;
    }
    say(this.words, '');
    this.end = foreseen(answer);
    const { time_s, remark } = this.end;
    const words = `predicted for ${seconds(time_s)}${remark ? ` (${remark})` : ''}`;
    this.legend = [{ name: words, colour: kColour }];
    this.show(this);
  }
}
