// A robot beside the run's, that is seen through: the same robot in another posture.
import * as THREE from 'three';
import type { Data } from './data';
import type { Layer } from './layer';
import type { Model } from './model';
import type { Catalog } from './signals';

/** Where a ghost stands: joints by name, and its base, or where the robot's is. */
export interface Posture {
  joints: Map<string, number>;
  /** Place and quaternion (x y z w); empty: the robot's own. */
  base: number[];
}

/** Signals of a posture, -1 where there is none. */
export interface PostureIds {
  names: string[];
  joints: number[];
  base: number[];
}

/** How a ghost looks: where both stand alike, the robot is seen, and not a mixture that flickers. */
export function ghostly(colour: string): THREE.Material {
  return new THREE.MeshBasicMaterial({
    color: colour,
    transparent: true,
    opacity: 0.38,
    depthWrite: false,
    polygonOffset: true,
    polygonOffsetFactor: 2,
    polygonOffsetUnits: 4,
  });
}

/** A copy of the robot, which is made when it is seen first. */
export class Ghost {
  readonly object = new THREE.Group();
  private readonly look: THREE.Material;
  private model: Model | null = null;
  private copy: Model | null = null;

  constructor(colour: string) {
    this.look = ghostly(colour);
  }

  /** The robot is another, or none. */
  of(model: Model | null): void {
    this.object.clear();
    this.model = model;
    this.copy = null;
  }

  /** @return whether it is there: not where no joint is known, or there is no robot. */
  stand({ joints, base }: Posture): boolean {
    const known = [...joints.values()].some(Number.isFinite);
    if (this.copy) this.copy.robot.visible = known;
    if (!this.model || !known) return false;
    if (!this.copy) {
      this.copy = this.model.copy(this.look);
      this.object.add(this.copy.robot);
    }
    for (const [name, position] of joints) this.copy.set(name, position);
    const { position, quaternion } = this.copy.robot;
    if (base.length === 7 && base.every(Number.isFinite)) {
      position.set(base[0], base[1], base[2]);
      quaternion.set(base[3], base[4], base[5], base[6]).normalize();
    } else {
      position.copy(this.model.robot.position);
      quaternion.copy(this.model.robot.quaternion);
    }
    return true;
  }
}

/** Sources of another robot. */
export interface GhostSources {
  /** Has position_rad by joint. */
  state: string;
  /** Have the base; the first has the passive joints. */
  base: string[];
}

/** The signals of the first of `choices` that has joints of the robot; null: none has. */
export function postureIds(
  catalog: Catalog,
  choices: GhostSources[],
  robot: { joints: string[]; passive: string[]; floating: boolean },
): PostureIds | null {
  for (const { state, base } of choices) {
    const joints = robot.joints.map(
      (name) => catalog.named(`${state}.position_rad.${name}`)?.id ?? -1,
    );
    if (!joints.some((id) => id >= 0)) continue;
    const passive = catalog.idsOf(base[0], 'passive_position_rad');
    const standing = base
      .map((source) => [
        ...catalog.idsOf(source, 'base_position_m'),
        ...catalog.idsOf(source, 'base_quaternion'),
      ])
      .find((ids) => ids.length === 7);
    return {
      names: [...robot.joints, ...robot.passive],
      joints: [...joints, ...robot.passive.map((_, i) => passive[i] ?? -1)],
      base: (robot.floating && standing) || [],
    };
  }
  return null;
}

/** Another robot's newest posture: of the one that runs in parallel, or of another log. */
export class RobotGhost implements Layer {
  legend: Layer['legend'] = [];
  shown = 0;
  private readonly ghost: Ghost;
  private ids: PostureIds | null = null;

  /** @param choices the first that is there counts */
  constructor(
    private readonly name: string,
    private readonly colour: string,
    private readonly choices: GhostSources[],
  ) {
    this.ghost = new Ghost(colour);
  }

  get object(): THREE.Object3D {
    return this.ghost.object;
  }

  setModel(model: Model | null): void {
    this.ghost.of(model);
  }

  wire({ catalog, hello }: Data): number[] {
    this.ids = postureIds(catalog, this.choices, {
      joints: hello?.joints.map((one) => one.name) ?? [],
      passive: hello?.passive ?? [],
      floating: hello?.floating ?? false,
    });
    this.legend = this.ids ? [{ name: this.name, colour: this.colour }] : [];
    return this.ids ? [...this.ids.joints, ...this.ids.base] : [];
  }

  pose(values: number[]): void {
    this.shown = 0;
    if (!this.object.visible) return;
    const names = this.ids?.names ?? [];
    const joints = new Map(names.map((name, i) => [name, values[i]]));
    this.shown = Number(this.ghost.stand({ joints, base: values.slice(names.length) }));
  }
}
