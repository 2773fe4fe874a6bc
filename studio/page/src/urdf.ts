// What of a robot's description can be drawn, and what stands in for the rest.
import type { TreeJoint } from './limbs';

export type Vector = [number, number, number];

interface Shape {
  kind: string;
  file: string;
}
export interface LinkShape {
  name: string;
  visuals: Shape[];
  collisions: Shape[];
  /** Centre of mass; null: it has no mass. */
  com: Vector | null;
}
export interface DescribedJoint extends TreeJoint {
  type: string;
  origin: Vector;
}
export interface Description {
  links: LinkShape[];
  joints: DescribedJoint[];
}
/** A rod with round ends, in a link's frame. */
export interface Capsule {
  link: string;
  from: Vector;
  to: Vector;
}
export interface Plan {
  capsules: Capsule[];
  /** Links whose collision shapes are drawn in place of their visual ones. */
  byCollision: string[];
  /** "foot: mesh foot.stl is not here; a capsule instead" */
  notDrawn: string[];
}

const kDrawn = new Set(['box', 'cylinder', 'sphere', 'capsule']);
const kShort_m = 0.002;

/** Elements of that name, or all. */
export function childrenOf(node: Node, name?: string): Element[] {
  const found: Element[] = [];
  for (let child = node.firstChild; child; child = child.nextSibling) {
    if (child.nodeType === 1 && (!name || child.nodeName === name)) found.push(child as Element);
  }
  return found;
}

function vector(text: string | null | undefined): Vector {
  const [x = 0, y = 0, z = 0] = (text ?? '').trim().split(/\s+/).map(Number);
  return [x, y, z].map((one) => (Number.isFinite(one) ? one : 0)) as Vector;
}

function shapesOf(link: Element, kind: string): Shape[] {
  return childrenOf(link, kind).map((visual) => {
    const geometry = childrenOf(visual, 'geometry')[0];
    const shape = geometry ? childrenOf(geometry)[0] : undefined;
    return { kind: shape?.nodeName ?? 'nothing', file: shape?.getAttribute('filename') ?? '' };
  });
}

/** @throws Error in words, when the document is no robot. */
export function describe(doc: Document): Description {
  const robot = doc.documentElement;
  if (robot?.nodeName !== 'robot') {
    throw new Error('the description is no URDF: its root is not <robot>');
  }
  const links = childrenOf(robot, 'link').map((link): LinkShape => {
    const inertial = childrenOf(link, 'inertial')[0];
    const origin = inertial ? childrenOf(inertial, 'origin')[0] : undefined;
    return {
      name: link.getAttribute('name') ?? '',
      visuals: shapesOf(link, 'visual'),
      collisions: shapesOf(link, 'collision'),
      com: inertial ? vector(origin?.getAttribute('xyz')) : null,
    };
  });
  const joints = childrenOf(robot, 'joint').map((joint): DescribedJoint => {
    const link = (end: string) => childrenOf(joint, end)[0]?.getAttribute('link') ?? '';
    return {
      name: joint.getAttribute('name') ?? '',
      type: joint.getAttribute('type') ?? '',
      parent: link('parent'),
      child: link('child'),
      origin: vector(childrenOf(joint, 'origin')[0]?.getAttribute('xyz')),
    };
  });
  return { links, joints };
}

function length(of: Vector): number {
  return Math.hypot(...of);
}

/** Rods from a link's joint to the next joints; of the last link to twice its centre of mass. */
function rods(link: LinkShape, joints: DescribedJoint[]): Capsule[] {
  const ends = joints.map((joint) => joint.origin).filter((origin) => length(origin) > kShort_m);
  if (ends.length === 0 && link.com && length(link.com) > kShort_m) {
    ends.push(link.com.map((one) => 2 * one) as Vector);
  }
  return ends.map((to) => ({ link: link.name, from: [0, 0, 0], to }));
}

/**
 * A robot without any visual is drawn as rods between its joints. In others a link whose visuals
 * cannot be had gets its collision shapes, or rods; links without visuals are frames.
 * @param meshes why a mesh is not drawn; empty: it is.
 */
export function planOf(
  { links, joints }: Description,
  meshes: (file: string) => string = () => 'it is not here',
): Plan {
  const plan: Plan = { capsules: [], byCollision: [], notDrawn: [] };
  const bare = links.every((link) => link.visuals.length === 0);
  for (const link of links) {
    const after = joints.filter((joint) => joint.parent === link.name);
    if (bare) {
      plan.capsules.push(...rods(link, after));
      continue;
    }
    const why = (shape: Shape) => (shape.kind === 'mesh' ? meshes(shape.file) : ' ');
    const missing = link.visuals.filter((shape) => !kDrawn.has(shape.kind) && why(shape) !== '');
    if (missing.length === 0) continue;
    const drawn = missing.length < link.visuals.length;
    const solid = link.collisions.some((shape) => kDrawn.has(shape.kind));
    let instead = 'a rod instead';
    if (drawn) instead = 'its other shapes are drawn';
    else if (solid) {
      instead = 'its collision shape instead';
      plan.byCollision.push(link.name);
    } else {
      const some = rods(link, after);
      if (some.length === 0) instead = 'nothing instead';
      plan.capsules.push(...some);
    }
    for (const shape of missing) {
      const words = why(shape).trim() === '' ? '' : ` (${why(shape)})`;
      plan.notDrawn.push(`${link.name}: ${shape.kind} ${shape.file}${words}: ${instead}`);
    }
  }
  return plan;
}

export interface Prepared {
  /** Names in the document by the robot's own. */
  joints: Map<string, string>;
  links: Map<string, string>;
}

/**
 * Makes a document that the loader reads without surprises: links and joints have plain names,
 * no file is named but meshes that are there, and joints that have values of their own follow no other one.
 */
export function prepare(
  doc: Document,
  plan: Plan,
  measured: Set<string>,
  hasMesh: (file: string) => boolean = () => false,
): Prepared {
  const robot = doc.documentElement!;
  const links = new Map<string, string>();
  const joints = new Map<string, string>();
  const chosen = new Set(plan.byCollision);
  for (const link of childrenOf(robot, 'link')) {
    const name = link.getAttribute('name') ?? '';
    links.set(name, `link_${links.size}`);
    link.setAttribute('name', links.get(name)!);
    for (const visual of childrenOf(link, 'visual')) keepDrawn(doc, visual, hasMesh);
    for (const collision of childrenOf(link, 'collision')) {
      if (chosen.has(name)) {
        const visual = doc.createElement('visual');
        while (collision.firstChild) visual.appendChild(collision.firstChild);
        link.appendChild(visual);
        keepDrawn(doc, visual, () => false);
      }
      link.removeChild(collision);
    }
  }
  const nodes = childrenOf(robot, 'joint');
  for (const joint of nodes) joints.set(joint.getAttribute('name') ?? '', `joint_${joints.size}`);
  for (const joint of nodes) renameJoint(joint, joints, links, measured);
  for (const material of childrenOf(robot, 'material')) withoutTexture(material);
  for (const other of childrenOf(robot)) {
    if (!['link', 'joint', 'material'].includes(other.nodeName)) robot.removeChild(other);
  }
  return { joints, links };
}

function renameJoint(
  joint: Element,
  joints: Map<string, string>,
  links: Map<string, string>,
  measured: Set<string>,
): void {
  const name = joint.getAttribute('name') ?? '';
  joint.setAttribute('name', joints.get(name)!);
  for (const end of [...childrenOf(joint, 'parent'), ...childrenOf(joint, 'child')]) {
    end.setAttribute('link', links.get(end.getAttribute('link') ?? '') ?? '');
  }
  for (const mimic of childrenOf(joint, 'mimic')) {
    const led = joints.get(mimic.getAttribute('joint') ?? '');
    if (led === undefined || measured.has(name)) joint.removeChild(mimic);
    else mimic.setAttribute('joint', led);
  }
}

function withoutTexture(material: Element): void {
  for (const texture of childrenOf(material, 'texture')) material.removeChild(texture);
}

/** Leaves a visual that can be drawn; others go. A capsule becomes a cylinder. */
function keepDrawn(doc: Document, visual: Element, hasMesh: (file: string) => boolean): void {
  visual.removeAttribute('name');
  for (const material of childrenOf(visual, 'material')) withoutTexture(material);
  const geometry = childrenOf(visual, 'geometry')[0];
  const shape = geometry ? childrenOf(geometry)[0] : undefined;
  const mesh = shape?.nodeName === 'mesh' && hasMesh(shape.getAttribute('filename') ?? '');
  if (!shape || !(mesh || kDrawn.has(shape.nodeName))) {
    visual.parentNode?.removeChild(visual);
  } else if (shape.nodeName === 'capsule') {
    const cylinder = doc.createElement('cylinder');
    for (const key of ['radius', 'length']) {
      cylinder.setAttribute(key, shape.getAttribute(key) ?? '0');
    }
    geometry.replaceChild(cylinder, shape);
  }
}
