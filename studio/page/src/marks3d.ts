// Arrows and marks beside the robot: forces of the ground, centre of mass, frames.
import * as THREE from 'three';
import type { Model } from './model';
import { centreOn, type GroundHeight } from './pressure';

const kMetresPerNewton = 1 / 1000;
/** Marks are drawn last, through the robot. */
const kAbove = 2;

export class Marks {
  readonly forces = new THREE.Group();
  readonly com = new THREE.Group();
  readonly frames = new THREE.Group();
  private readonly arrows: THREE.ArrowHelper[] = [];
  private readonly pressure: THREE.Mesh;
  private readonly dot: THREE.Mesh;
  private readonly drop: THREE.Line;
  private followed: { axes: THREE.AxesHelper; object: THREE.Object3D }[] = [];

  constructor() {
    this.dot = new THREE.Mesh(
      new THREE.SphereGeometry(0.018, 16, 12),
      new THREE.MeshBasicMaterial({ color: 0xe69f00, depthTest: false }),
    );
    this.dot.renderOrder = kAbove;
    const points = [new THREE.Vector3(), new THREE.Vector3(0, 0, -1)];
    this.drop = new THREE.Line(
      new THREE.BufferGeometry().setFromPoints(points),
      new THREE.LineBasicMaterial({ color: 0xe69f00, depthTest: false }),
    );
    this.drop.renderOrder = kAbove;
    this.com.add(this.dot, this.drop);
    this.pressure = new THREE.Mesh(
      new THREE.RingGeometry(0.012, 0.022, 24),
      new THREE.MeshBasicMaterial({ color: 0x009e73, depthTest: false, side: THREE.DoubleSide }),
    );
    this.pressure.renderOrder = kAbove;
    this.pressure.visible = false;
    this.forces.add(this.pressure);
    this.com.visible = false;
    this.frames.visible = false;
  }

  /** Arrows of the ground's forces, and a ring at the centre of pressure. */
  setFeet(positions: number[], forces: number[], moments: number[], ground: GroundHeight): void {
    const centre = centreOn(ground, positions, forces, moments);
    this.pressure.visible = centre !== null;
    if (centre) this.pressure.position.set(...centre);
    const feet = Math.floor(forces.length / 3);
    while (this.arrows.length < feet) {
      const arrow = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), undefined, 0.1, 0x009e73);
      for (const part of [arrow.line, arrow.cone]) {
        (part.material as THREE.Material).depthTest = false;
        part.renderOrder = kAbove;
      }
      this.arrows.push(arrow);
      this.forces.add(arrow);
    }
    this.arrows.forEach((arrow, i) => {
      const force = new THREE.Vector3(...forces.slice(3 * i, 3 * i + 3));
      const length = force.length() * kMetresPerNewton;
      arrow.visible = Number.isFinite(length) && length > 0.002 && i < feet;
      if (!arrow.visible) return;
      arrow.position.set(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
      arrow.setDirection(force.normalize());
      arrow.setLength(length, Math.min(0.05, 0.4 * length), Math.min(0.03, 0.25 * length));
    });
  }

  /** @param radius of the robot: the dot is a small part of it. */
  setSize(radius: number): void {
    for (const mark of [this.dot, this.pressure]) {
      mark.scale.setScalar(Math.max(0.2, radius / 0.6));
    }
  }

  /** The line of the centre of mass ends on the ground. */
  setCom(at: number[], ground: GroundHeight, shown: boolean): void {
    this.com.visible = shown && at.length === 3 && at.every(Number.isFinite);
    if (!this.com.visible) return;
    this.com.position.set(at[0], at[1], at[2]);
    this.drop.scale.z = Math.max(1e-3, at[2] - ground(at[0], at[1]));
  }

  /** Axes at the base and at each joint that moves. */
  setFrames(model: Model, joints: string[]): void {
    this.frames.clear();
    this.followed = [];
    const objects = [model.robot, ...joints.map((name) => model.joint(name))];
    for (const object of objects) {
      if (!object) continue;
      const axes = new THREE.AxesHelper(object === model.robot ? 0.2 : 0.08);
      axes.matrixAutoUpdate = false;
      axes.renderOrder = kAbove;
      (axes.material as THREE.Material).depthTest = false;
      this.frames.add(axes);
      this.followed.push({ axes, object });
    }
  }

  /** After the robot has moved. */
  update(): void {
    if (!this.frames.visible) return;
    for (const { axes, object } of this.followed) {
      object.updateWorldMatrix(true, false);
      axes.matrix.copy(object.matrixWorld);
    }
  }
}
