// The pushes of a simulated robot: an arrow on the line along which their sum acts.
import * as THREE from 'three';
import type { Data } from './data';
import type { Layer } from './layer';
import type { Model } from './model';

const kMetresPerNewton = 1 / 100;
const kColour = '#d55e00';
/** Drawn last, through the robot. */
const kAbove = 2;

/**
 * Where on its line of action a force is nearest to the centre of mass.
 * @param com the centre of mass [m], `force` [N] and its `moment` [Nm] about it: world axes
 * @returns x, y, z [m]; null: nothing pushes, or it is not known
 */
export function pushPoint(
  com: number[],
  force: number[],
  moment: number[],
): [number, number, number] | null {
  const [fx, fy, fz] = force;
  const [mx, my, mz] = moment;
  const square = fx * fx + fy * fy + fz * fz;
  if (!(square > kLeast_N * kLeast_N)) return null;
  const at: [number, number, number] = [
    com[0] + (fy * mz - fz * my) / square,
    com[1] + (fz * mx - fx * mz) / square,
    com[2] + (fx * my - fy * mx) / square,
  ];
  return at.every(Number.isFinite) ? at : null;
}

/** Less is not seen. */
const kLeast_N = 0.01;

export class Pushes implements Layer {
  readonly object = new THREE.Group();
  private readonly arrow = new THREE.ArrowHelper(
    new THREE.Vector3(1, 0, 0),
    undefined,
    0.1,
    kColour,
  );
  private seen = false;

  /** @param appeared the first push is there, so that there is something to choose. */
  constructor(private readonly appeared: (layer: Layer) => void) {
    for (const part of [this.arrow.line, this.arrow.cone]) {
      (part.material as THREE.Material).depthTest = false;
      part.renderOrder = kAbove;
    }
    this.arrow.visible = false;
    this.object.add(this.arrow);
  }

  get shown(): number {
    return this.arrow.visible ? 1 : 0;
  }

  get legend(): { name: string; colour: string }[] {
    return this.seen ? [{ name: 'push', colour: kColour }] : [];
  }

  setModel(_model: Model | null): void {}

  wire({ catalog }: Data): number[] {
    const ids = ['center_of_mass_m', 'push_force_N', 'push_moment_Nm'].map((field) =>
      catalog.idsOf('truth', field),
    );
    return ids.every((one) => one.length === 3) ? ids.flat() : [];
  }

  /** The arrow's head is where it pushes. */
  pose(values: number[]): void {
    const force = new THREE.Vector3(...values.slice(3, 6));
    const at =
      values.length === 9 ? pushPoint(values.slice(0, 3), force.toArray(), values.slice(6)) : null;
    this.arrow.visible = at !== null;
    if (!at) return;
    const length = Math.min(2, force.length() * kMetresPerNewton);
    const direction = force.normalize();
    this.arrow.position.set(...at).addScaledVector(direction, -length);
    this.arrow.setDirection(direction);
    this.arrow.setLength(length, Math.min(0.08, 0.4 * length), Math.min(0.05, 0.25 * length));
    if (this.seen) return;
    this.seen = true;
    this.appeared(this);
  }
}
