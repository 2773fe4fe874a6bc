// What controllers draw: points, arrows, lines, polygons and texts in frames of the robot.
import * as THREE from 'three';
import type { Data } from './data';
import type { Layer } from './layer';
import type { Model } from './model';
import type { MarkInfo } from './protocol';

/** Drawn last, through the robot. */
const kAbove = 3;
/** A frame of the world, where a fixed base stands. */
const kWorld = 'odom';

interface Drawn {
  mark: MarkInfo;
  places: number;
  group: THREE.Group;
  /** Shows what is at `points`; `text` of a text. */
  draw(points: THREE.Vector3[], text: string): void;
  text: number;
}

type Draw = Drawn['draw'];

function material(mark: MarkInfo): THREE.MeshBasicMaterial {
  const [r, g, b, a] = mark.rgba;
  const colour = new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
  return new THREE.MeshBasicMaterial({
    color: colour,
    transparent: a < 1,
    opacity: a,
    depthTest: false,
  });
}

function balls(mark: MarkInfo, places: number, group: THREE.Group): Draw {
  const shape = new THREE.SphereGeometry(0.5 * mark.size_m, 16, 12);
  const look = material(mark);
  const all = Array.from({ length: places }, () => new THREE.Mesh(shape, look));
  for (const one of all) one.renderOrder = kAbove;
  group.add(...all);
  return (points) => {
    all.forEach((one, i) => {
      one.visible = i < points.length;
      if (one.visible) one.position.copy(points[i]);
    });
  };
}

function lines(mark: MarkInfo, closed: boolean, group: THREE.Group): Draw {
  const { color, opacity } = material(mark);
  const look = new THREE.LineBasicMaterial({
    color,
    opacity,
    transparent: opacity < 1,
    depthTest: false,
  });
  const shape = new THREE.BufferGeometry();
  const line = closed ? new THREE.LineLoop(shape, look) : new THREE.Line(shape, look);
  line.renderOrder = kAbove;
  line.frustumCulled = false;
  group.add(line);
  return (points) => {
    line.visible = points.length > 1;
    if (line.visible) shape.setFromPoints(points);
  };
}

function arrow(mark: MarkInfo, group: THREE.Group): Draw {
  const look = material(mark);
  const head = 3 * mark.size_m;
  const shaft = new THREE.Mesh(
    new THREE.CylinderGeometry(0.5 * mark.size_m, 0.5 * mark.size_m, 1, 12),
    look,
  );
  const cone = new THREE.Mesh(new THREE.ConeGeometry(mark.size_m, 1, 12), look);
  for (const part of [shaft, cone]) part.renderOrder = kAbove;
  group.add(shaft, cone);
  return (points) => {
    const along = points.length > 1 ? points[1].clone().sub(points[0]) : new THREE.Vector3();
    const length = along.length();
    shaft.visible = cone.visible = length > 1e-6;
    if (!shaft.visible) return;
    const tip = Math.min(head, 0.5 * length);
    along.normalize();
    for (const [part, from, size] of [
      [shaft, 0, length - tip],
      [cone, length - tip, tip],
    ] as const) {
      part.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along);
      part.scale.set(1, size, 1);
      part.position.copy(points[0]).addScaledVector(along, from + 0.5 * size);
    }
  };
}

/** Letters on a plane that faces the camera. */
function words(mark: MarkInfo, group: THREE.Group): Draw {
  const canvas = document.createElement('canvas');
  const texture = new THREE.CanvasTexture(canvas);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture, depthTest: false }));
  sprite.renderOrder = kAbove;
  group.add(sprite);
  let written: string | null = null;
  return (points, text) => {
    sprite.visible = points.length > 0 && text !== '';
    if (!sprite.visible) return;
    sprite.position.copy(points[0]);
    if (text === written) return;
    written = text;
    const context = canvas.getContext('2d');
    if (!context) return;
    const font = '48px system-ui, sans-serif';
    context.font = font;
    canvas.width = Math.ceil(context.measureText(text).width) + 16;
    canvas.height = 64;
    context.font = font;
    context.textBaseline = 'middle';
    context.fillStyle = colourOf(mark);
    context.fillText(text, 8, 34);
    texture.dispose();
    texture.needsUpdate = true;
    // The height of letters is size_m: of 64 pixels they are 48.
    const high = (mark.size_m * 64) / 48;
    sprite.scale.set((high * canvas.width) / canvas.height, high, 1);
  };
}

export function colourOf(mark: MarkInfo): string {
  const [r, g, b] = mark.rgba.map((one) => Math.round(255 * Math.min(1, Math.max(0, one))));
  return `rgb(${r} ${g} ${b})`;
}

/** Bytes up to the first zero, as text. */
export function textOf(bytes: number[]): string {
  const end = bytes.indexOf(0);
  const text = Uint8Array.from(end < 0 ? bytes : bytes.slice(0, end));
  return new TextDecoder().decode(text);
}

/** x, y, z of each place that is shown. */
export function placesOf(values: number[], shown: number): THREE.Vector3[] {
  const count = Math.min(Number.isFinite(shown) ? shown : 0, Math.floor(values.length / 3));
  return Array.from(
    { length: count },
    (_, i) => new THREE.Vector3(values[3 * i], values[3 * i + 1], values[3 * i + 2]),
  );
}

export class ControllerMarks implements Layer {
  readonly object = new THREE.Group();
  legend: Layer['legend'] = [];
  /** How many are shown: for whoever looks without seeing. */
  shown = 0;
  private drawn: Drawn[] = [];
  private model: Model | null = null;

  setModel(model: Model | null): void {
    this.model = model;
  }

  wire(data: Data): number[] {
    this.object.clear();
    this.drawn = [];
    this.legend = [];
    const ids: number[] = [];
    for (const source of data.sources) {
      for (const mark of source.marks ?? []) {
        const places = data.catalog.idsOf(source.name, mark.name);
        const text = data.catalog.idsOf(source.name, `${mark.name}.text`);
        ids.push(...places, ...data.catalog.idsOf(source.name, `${mark.name}.shown`), ...text);
        this.drawn.push(this.begin(mark, places.length / 3, text.length));
        const name = `${source.name.replace(/^marks\//, '')}: ${mark.name}`;
        this.legend.push({ name, colour: colourOf(mark) });
      }
    }
    return ids;
  }

  pose(values: number[]): void {
    let at = 0;
    const part = (count: number) => {
      at += count;
      return values.slice(at - count, at);
    };
    this.shown = 0;
    for (const one of this.drawn) {
      const places = part(3 * one.places);
      const [shown] = part(1);
      const points = placesOf(places, shown);
      one.draw(points, textOf(part(one.text)));
      one.group.visible = points.length > 0 && this.place(one);
      if (one.group.visible) ++this.shown;
    }
  }

  /** Into its frame. @return false: the robot has no such link. */
  private place({ mark, group }: Drawn): boolean {
    const link = mark.link === kWorld ? null : this.model?.link(mark.link);
    if (link === undefined) return false;
    link?.updateWorldMatrix(true, false);
    const own = new THREE.Matrix4()
      .makeRotationFromEuler(new THREE.Euler(mark.rpy[0], mark.rpy[1], mark.rpy[2], 'ZYX'))
      .setPosition(mark.xyz[0], mark.xyz[1], mark.xyz[2]);
    group.matrix.copy(link ? own.premultiply(link.matrixWorld) : own);
    return true;
  }

  private begin(mark: MarkInfo, places: number, text: number): Drawn {
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    this.object.add(group);
    const draws: Record<string, () => Draw> = {
      points: () => balls(mark, places, group),
      arrow: () => arrow(mark, group),
      line: () => lines(mark, false, group),
      polygon: () => lines(mark, true, group),
      text: () => words(mark, group),
    };
    return { mark, places, text, group, draw: (draws[mark.shape] ?? draws.points)() };
  }
}
