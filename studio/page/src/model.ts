// The robot as objects of three: built of its description, moved by joint positions.
import * as THREE from 'three';
import URDFLoader, { type URDFRobot } from 'urdf-loader';
import { kOwnColour } from './collada';
import type { TreeJoint } from './limbs';
import { kNoMeshes, type Meshes } from './meshes';
import { type Capsule, describe, planOf, prepare } from './urdf';

export interface Model {
  robot: URDFRobot;
  tree: TreeJoint[];
  notDrawn: string[];
  /** @return false: the robot has no such joint. */
  set(joint: string, position: number): boolean;
  /** The object of a link; undefined: there is none. */
  link(name: string): THREE.Object3D | undefined;
  joint(name: string): THREE.Object3D | undefined;
  /** Another of it, all in one look. */
  copy(look: THREE.Material): Model;
}

function rod(capsule: Capsule, material: THREE.Material): THREE.Object3D {
  const from = new THREE.Vector3(...capsule.from);
  const along = new THREE.Vector3(...capsule.to).sub(from);
  const length = along.length();
  const radius = Math.min(0.035, Math.max(0.006, 0.08 * length));
  const mesh = new THREE.Mesh(new THREE.CapsuleGeometry(radius, length, 4, 12), material);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize());
  mesh.position.copy(from).addScaledVector(along, 0.5);
  return mesh;
}

/** Meshes are named by number, so that the loader changes no name, and never asks for a file. */
function readMade(doc: Document, meshes: Meshes): URDFRobot {
  const used: (THREE.Object3D | undefined)[] = [];
  for (const mesh of Array.from(doc.getElementsByTagName('mesh'))) {
    used.push(meshes.ready.get(mesh.getAttribute('filename') ?? ''));
    mesh.setAttribute('filename', String(used.length - 1));
  }
  const loader = new URDFLoader();
  loader.loadMeshCb = (number, _manager, look, done) => {
    const made = used[Number(number)]?.clone();
    made?.traverse((one) => {
      // As RViz does: the description's material is of what has none.
      if (one instanceof THREE.Mesh && one.material.name !== kOwnColour) one.material = look;
    });
    done(made ?? new THREE.Group());
  };
  return loader.parse(doc);
}

function parsed(text: string): Document {
  const doc = new DOMParser().parseFromString(text, 'text/xml');
  if (doc.getElementsByTagName('parsererror')[0]) throw new Error('the description is no XML');
  return doc;
}

/** How often the description draws each mesh. @throws as buildModel() */
export function usesOfMeshes(text: string): Map<string, number> {
  const uses = new Map<string, number>();
  for (const { visuals } of describe(parsed(text)).links) {
    for (const { kind, file } of visuals) {
      if (kind === 'mesh') uses.set(file, (uses.get(file) ?? 0) + 1);
    }
  }
  return uses;
}

/**
 * @param material null: the description's colours.
 * @throws Error in words, when the description cannot be read.
 */
export function buildModel(
  text: string,
  measured: Set<string>,
  material: THREE.Material | null,
  meshes: Meshes = kNoMeshes,
): Model {
  const doc = parsed(text);
  const description = describe(doc);
  const has = (file: string) => meshes.ready.has(file);
  const plan = planOf(description, (file) =>
    has(file) ? '' : meshes.why.get(file) || 'it is not here',
  );
  const names = prepare(doc, plan, measured, has);
  const robot = readMade(doc, meshes);
  const plain = new THREE.MeshLambertMaterial({ color: 0x9aa7b5 });
  robot.traverse((one) => {
    if (!(one instanceof THREE.Mesh)) return;
    if (material) one.material = material;
    else if (!(one.material as THREE.Material).name) one.material = plain;
  });
  for (const capsule of plan.capsules) {
    const link = robot.links[names.links.get(capsule.link) ?? ''];
    link?.add(rod(capsule, material ?? plain));
  }
  for (const joint of Object.values(robot.joints)) joint.ignoreLimits = true;
  return {
    robot,
    tree: description.joints,
    notDrawn: plan.notDrawn,
    set(name, position) {
      const joint = robot.joints[names.joints.get(name) ?? ''];
      if (!joint) return false;
      if (Number.isFinite(position)) joint.setJointValue(position);
      return true;
    },
    link: (name) => robot.links[names.links.get(name) ?? ''],
    joint: (name) => robot.joints[names.joints.get(name) ?? ''],
    copy: (look) => buildModel(text, measured, look, meshes),
  };
}
