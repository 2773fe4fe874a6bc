// Something that the 3D view draws beside the robot, of numbers of the run.
import type * as THREE from 'three';
import type { Data } from './data';
import type { Model } from './model';

export interface Layer {
  readonly object: THREE.Object3D;
  /** Beside its switch, where there is more to choose; it is there as long as the layer is. */
  readonly controls?: HTMLElement;
  /** How many parts of it are drawn. */
  readonly shown: number;
  /** What is in it, for the legend; empty: nothing. */
  readonly legend: { name: string; colour: string }[];
  /** The robot is another, or none. */
  setModel(model: Model | null): void;
  /** Sources have come or gone. @return the ids whose values it needs. */
  wire(data: Data): number[];
  /** Values of those ids, in their order, at the time that is shown. The robot stands there. */
  pose(values: number[]): void;
}
