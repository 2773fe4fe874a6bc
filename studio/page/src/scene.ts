// The robot in 3D: posture, reference, ground and marks, at the newest or at the selected time.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Data } from './data';
import { h, say, theme } from './dom';
import { seconds } from './format';
import { ghostly } from './ghost';
import { GroundView } from './ground';
import { Layers } from './layers';
import type { TreeJoint } from './limbs';
import { Marks } from './marks3d';
import { fetchMeshes } from './meshes';
import { buildModel, type Model, usesOfMeshes } from './model';
import { NotDrawn } from './not_drawn';
import { drawsBy } from './webgl';

const kViews: Record<string, [number, number, number]> = {
  free: [1.6, -1.2, 0.7],
  front: [2.2, 0, 0.1],
  side: [0, -2.2, 0.1],
  top: [0.001, 0, 2.4],
};
/** Without a graphics processor the picture costs what the plots need: fewer, and plain. */
const kSlowEvery_ms = 120;
/** Pictures between two looks whether the robot has left the view. */
const kLookEvery = 10;
const kPlainName = /^[\w.-]+$/;

interface Ids {
  joints: string[];
  position: number[];
  reference: number[];
  base: number[];
  com: number[];
  feet: number[];
  forces: number[];
  moments: number[];
  layers: number[];
  moved: number[];
}

export class Scene {
  readonly canvasBox = h('div', { class: 'canvas', role: 'img', 'aria-label': 'the robot in 3D' });
  private readonly words = h('p', { class: 'scene-words', hidden: true });
  private readonly when = h('p', { class: 'scene-when', hidden: true });
  private readonly missing = new NotDrawn();
  readonly element: HTMLElement;
  private renderer: THREE.WebGLRenderer | null = null;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(40, 1, 0.01, 200);
  private controls: OrbitControls | null = null;
  private readonly marks = new Marks();
  private readonly layers = new Layers(() => {
    this.dirty = true;
  });
  private readonly ground = new GroundView();
  private model: Model | null = null;
  private ghost: Model | null = null;
  private ids: Ids | null = null;
  private slow = false;
  private renderedAt = 0;
  private dirty = true;
  private drawn = -1;
  private busy = false;
  /** Values at the selected time, so that the camera turns without asking again. */
  private held: { time: number; values: number[] } | null = null;
  private readonly center = new THREE.Vector3();
  private radius = 0.6;
  private lowest = 0;
  private fitted = false;
  /** Somebody has turned the view. */
  private touched = false;
  private looks = 0;
  private loads = 0;
  private readonly shows = { ghost: false, forces: true, com: true, frames: false, follow: true };
  private readonly onTree: ((tree: TreeJoint[]) => void)[] = [];

  constructor(private readonly data: Data) {
    this.element = h(
      'section',
      { class: 'scene', 'aria-label': '3D view' },
      this.toolbar(),
      h(
        'div',
        { class: 'canvas-frame' },
        this.canvasBox,
        this.when,
        this.words,
        this.layers.legend,
      ),
      this.missing.element,
    );
    this.begin();
    data.whenHello((hello) => {
      this.ground.set(hello.ground);
      this.layers.setGround(hello.ground);
      this.missing.ground(hello.ground?.terrain?.coarser === true);
      void this.load(hello.urdf);
    });
    data.whenCatalog(() => this.wire());
    data.time.on(() => {
      this.dirty = true;
    });
  }

  whenTree(call: (tree: TreeJoint[]) => void): void {
    this.onTree.push(call);
  }

  themeChanged(): void {
    this.ground.draw(this.radius, this.lowest);
    this.scene.background = new THREE.Color(theme('--scene'));
    this.dirty = true;
  }

  /** At each animation frame. */
  update(now: number): void {
    const cycle = this.data.lastTick?.cycle ?? -1;
    // Of a recording, the newest values are those at the selected time.
    const selected = this.data.source.live ? this.data.time.selected : null;
    if (selected === null && cycle !== this.drawn) this.dirty = true;
    if (!this.dirty || this.busy) return;
    if (this.slow && now - this.renderedAt < kSlowEvery_ms) return;
    this.renderedAt = now;
    this.dirty = false;
    this.drawn = cycle;
    this.when.hidden = selected === null;
    if (selected === null) {
      this.pose(this.idsAll().map((id) => this.data.latest(id)));
    } else {
      say(this.when, `at the selected time, ${seconds(selected)}`);
      if (this.held?.time === selected) {
        this.pose(this.held.values);
        return;
      }
      this.busy = true;
      void this.data.valuesAt(this.idsAll(), selected).then((values) => {
        this.busy = false;
        this.held = { time: selected, values };
        this.pose(values);
      });
    }
  }

  private begin(): void {
    const sun = new THREE.DirectionalLight(0xffffff, 1.8);
    sun.position.set(2, -3, 4);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 1.6), sun);
    this.scene.add(
      this.ground.object,
      this.marks.forces,
      this.marks.com,
      this.marks.frames,
      ...this.layers.objects,
    );
    this.camera.up.set(0, 0, 1);
    const by = drawsBy();
    this.slow = by === 'software';
    this.ground.slow = this.slow;
    try {
      // Where nobody draws it is not tried: three would complain in the console as well.
      this.renderer = by && new THREE.WebGLRenderer({ antialias: !this.slow });
    } catch {
      // As where nobody draws.
    }
    if (!this.renderer) {
      this.say('This browser has no WebGL: no 3D view. Plots, joints and lists work without it.');
      return;
    }
    this.renderer.setPixelRatio(this.slow ? 1 : Math.min(window.devicePixelRatio, 2));
    this.canvasBox.append(this.renderer.domElement);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener('change', () => {
      this.dirty = true;
    });
    this.controls.addEventListener('start', () => {
      this.touched = true;
    });
    new ResizeObserver(() => this.resize()).observe(this.canvasBox);
    this.view('free');
  }

  private say(words: string): void {
    this.words.hidden = words === '';
    say(this.words, words);
  }

  private async load(urdf: string): Promise<void> {
    for (const old of [this.model, this.ghost]) if (old) this.scene.remove(old.robot);
    this.model = null;
    this.ghost = null;
    const turn = ++this.loads;
    if (!urdf) return this.say('The run has no description: nothing to draw.');
    try {
      const text = await this.data.source.description();
      const hello = this.data.hello;
      const meshes = await fetchMeshes(hello, this.data.source, usesOfMeshes(text), this.slow);
      if (turn !== this.loads) return; // a newer hello has come meanwhile
      const measured = new Set([
        ...(hello?.joints.map((one) => one.name) ?? []),
        ...(hello?.passive ?? []),
      ]);
      this.model = buildModel(text, measured, null, meshes);
      this.ghost = this.model.copy(ghostly('#2f7de1'));
      this.ghost.robot.visible = this.shows.ghost;
      this.scene.add(this.model.robot, this.ghost.robot);
      this.marks.setFrames(this.model, [...measured]);
      this.layers.setModel(this.model);
      this.missing.show(this.model.notDrawn, meshes);
      this.fitted = false;
      this.say(this.renderer ? '' : (this.words.textContent ?? ''));
      for (const call of this.onTree) call(this.model.tree);
    } catch (error) {
      this.say(`The robot cannot be drawn: ${error instanceof Error ? error.message : error}`);
    }
    this.themeChanged();
  }

  private wire(): void {
    const { catalog, hello } = this.data;
    const of = (source: string, field: string) => catalog.idsOf(source, field);
    const first = (field: string, ...sources: string[]) =>
      sources.map((source) => of(source, field)).find((ids) => ids.length > 0) ?? [];
    const named = (source: string, field: string, names: string[]) =>
      names.map((name) => catalog.named(`${source}.${field}.${name}`)?.id ?? -1);
    const joints = hello?.joints.map((joint) => joint.name) ?? [];
    const passive = hello?.passive ?? [];
    const passiveIds = of('truth', 'passive_position_rad');
    this.ids = {
      joints: [...joints, ...passive],
      position: [
        ...joints.map((name) => catalog.ofJoint('position_rad', name)?.id ?? -1),
        ...passive.map((_, i) => passiveIds[i] ?? -1),
      ],
      reference: named('command', 'position_rad', joints),
      base: hello?.floating
        ? [
            ...first('base_position_m', 'truth', 'estimate'),
            ...first('base_quaternion', 'truth', 'estimate'),
          ]
        : [],
      com: of('truth', 'center_of_mass_m'),
      feet: of('truth', 'foot_position_m'),
      forces: of('truth', 'foot_force_N'),
      moments: of('truth', 'foot_moment_Nm'),
      layers: this.layers.wire(this.data),
      moved: of('truth', 'ground_position_m'),
    };
    this.held = null;
    this.data.want(
      'scene',
      this.idsAll().filter((id) => id >= 0),
    );
    this.dirty = true;
  }

  private idsAll(): number[] {
    const ids = this.ids;
    if (!ids) return [];
    const { position, reference, base, com, feet, forces, moments, layers, moved } = ids;
    return [position, reference, base, com, feet, forces, moments, layers, moved].flat();
  }

  private pose(values: number[]): void {
    const ids = this.ids;
    if (!ids) return;
    let at = 0;
    const part = (count: number) => {
      at += count;
      return values.slice(at - count, at);
    };
    const position = part(ids.position.length);
    const reference = part(ids.reference.length);
    const base = part(ids.base.length);
    const com = part(ids.com.length);
    const feet = part(ids.feet.length);
    const forces = part(ids.forces.length);
    const moments = part(ids.moments.length);
    const layers = part(ids.layers.length);
    ids.joints.forEach((name, i) => {
      this.model?.set(name, position[i]);
      // A joint without a reference stands where it is.
      const asked = i < reference.length ? reference[i] : Number.NaN;
      this.ghost?.set(name, Number.isFinite(asked) ? asked : position[i]);
      if (kPlainName.test(name)) {
        this.element.setAttribute(`data-joint-${name}`, String(position[i]));
      }
    });
    for (const model of [this.model, this.ghost]) {
      if (model && base.length === 7 && base.every(Number.isFinite)) {
        model.robot.position.set(base[0], base[1], base[2]);
        model.robot.quaternion.set(base[3], base[4], base[5], base[6]).normalize();
      }
    }
    this.ground.move(part(ids.moved.length));
    const carried = this.shows.forces ? forces : forces.map(() => 0);
    const { x, y } = this.model?.robot.position ?? { x: 0, y: 0 };
    this.element.dataset.under = `${x} ${y} ${this.ground.height(x, y, this.lowest)}`;
    const ground = (x: number, y: number) => this.ground.height(x, y, this.lowest);
    this.marks.setFeet(feet, carried, moments, ground);
    this.marks.setCom(com, ground, this.shows.com);
    this.marks.update();
    this.layers.pose(layers);
    this.render(position.some(Number.isFinite));
  }

  private render(posed: boolean): void {
    if (!this.renderer || !this.controls) return;
    if (this.model && posed) this.keepInView();
    if (this.shows.follow && this.model) {
      const now = this.model.robot.position.clone();
      const moved = now.clone().sub(this.center);
      this.camera.position.add(moved);
      this.controls.target.add(moved);
      this.center.copy(now);
    }
    this.controls.update();
    this.renderer.render(this.scene, this.camera);
    this.element.dataset.drawn = String(this.drawn);
    this.dirty = false;
  }

  private extent(): THREE.Sphere | null {
    if (!this.model) return null;
    this.model.robot.updateMatrixWorld(true);
    const box = new THREE.Box3().setFromObject(this.model.robot);
    return box.isEmpty() ? null : box.getBoundingSphere(new THREE.Sphere());
  }

  /** Fits the view at first, and, until somebody turns it, when the robot has left it. */
  private keepInView(): void {
    if (!this.controls || (this.fitted && (this.touched || ++this.looks % kLookEvery !== 0)))
      return;
    const now = this.extent();
    if (!now) return;
    const away = now.center.distanceTo(this.controls.target);
    if (this.fitted && away < 0.3 * this.radius && now.radius < 1.2 * this.radius) return;
    this.fitted = true;
    this.view('free');
  }

  private view(name: string): void {
    if (!this.controls) return;
    const now = this.extent();
    if (now && this.model) {
      this.radius = Math.max(0.1, now.radius);
      this.controls.target.copy(now.center);
      this.center.copy(this.model.robot.position);
      this.marks.setSize(this.radius);
      this.lowest = now.center.z - now.radius;
      this.ground.draw(this.radius, this.lowest);
    }
    const [x, y, z] = kViews[name];
    const narrow = Math.min(1, this.camera.aspect);
    const far = (1.02 * this.radius) / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
    const away = new THREE.Vector3(x, y, z).setLength(far);
    this.camera.position.copy(this.controls.target).add(away);
    this.controls.update();
    this.dirty = true;
  }

  private choose(name: string): void {
    this.touched = name !== 'free';
    this.view(name);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvasBox;
    if (!this.renderer || width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  private toolbar(): HTMLElement {
    const toggle = (label: string, key: keyof Scene['shows'], title: string) => {
      const box = h('input', {
        type: 'checkbox',
        checked: this.shows[key],
        onchange: () => {
          this.shows[key] = box.checked;
          if (this.ghost) this.ghost.robot.visible = this.shows.ghost;
          this.marks.frames.visible = this.shows.frames;
          if (this.model) this.center.copy(this.model.robot.position);
          this.dirty = true;
        },
      });
      return h('label', { class: `toggle of-${key}`, title }, box, label);
    };
    const view = (name: string) =>
      h('button', { type: 'button', onclick: () => this.choose(name) }, name);
    return h(
      'div',
      { class: 'toolbar', role: 'group', 'aria-label': '3D view' },
      view('free'),
      view('front'),
      view('side'),
      view('top'),
      toggle('follow', 'follow', 'the camera goes with the base'),
      toggle('reference', 'ghost', 'the reference posture as a blue ghost'),
      toggle('forces', 'forces', 'of the ground on the feet: green arrows, 1 m is 1000 N'),
      toggle('mass', 'com', 'the centre of mass: an orange dot, and its place on the ground'),
      toggle('frames', 'frames', 'of base and joints: red x, green y, blue z'),
      ...this.layers.toggles,
    );
  }
}
