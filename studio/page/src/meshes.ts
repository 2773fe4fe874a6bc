// Meshes of the description: those that the run has, as geometry.
import * as THREE from 'three';
import { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js';
import { STLLoader } from 'three/examples/jsm/loaders/STLLoader.js';
import type { MeshFile } from './protocol';
import type { Source } from './source';

export interface Meshes {
  /** By the name that the description has: each use takes a copy. */
  readonly ready: Map<string, THREE.Object3D>;
  /** Why others are not there. */
  readonly why: Map<string, string>;
}

/** Many files have normals of length 0: the corners say them better. */
function stl(bytes: ArrayBuffer): THREE.Object3D {
  const surface = new STLLoader().parse(bytes);
  surface.computeVertexNormals();
  return new THREE.Mesh(surface);
}

/** Of a corner from the mesh's origin, in its own units: millimetres may be among them. */
const kFarthest = 1e6;

const kParsers: Record<string, (bytes: ArrayBuffer) => THREE.Object3D> = {
  stl,
  obj: (bytes) => new OBJLoader().parse(new TextDecoder().decode(bytes)),
};

/** The geometry in a file's bytes. @throws Error in words. */
export function parseMesh(file: string, bytes: ArrayBuffer): THREE.Object3D {
  const parse = kParsers[file.slice(file.lastIndexOf('.') + 1).toLowerCase()];
  if (!parse) throw new Error('it is neither STL nor OBJ');
  let made: THREE.Object3D;
  try {
    made = parse(bytes);
  } catch {
    throw new Error('its content is neither STL nor OBJ'); // the parsers' own words are about their code
  }
  let corners = 0;
  made.traverse((one) => {
    if (!(one instanceof THREE.Mesh)) return;
    const places = one.geometry.getAttribute('position') as THREE.BufferAttribute | undefined;
    corners += places?.count ?? 0;
    // One such corner, and the camera would find nothing of the robot.
    if (places && !Array.from(places.array).every((value) => Math.abs(value) <= kFarthest)) {
      throw new Error('a corner of it is no place near the robot');
    }
  });
  if (corners === 0) throw new Error('it has no surface');
  return made;
}

/** All that can be had. */
export async function fetchMeshes(files: MeshFile[], source: Source): Promise<Meshes> {
  const meshes: Meshes = { ready: new Map(), why: new Map() };
  for (const { file, path, why } of files) {
    if (!path) {
      meshes.why.set(file, why);
      continue;
    }
    try {
      meshes.ready.set(file, parseMesh(file, await source.mesh(path)));
    } catch (error) {
      meshes.why.set(file, error instanceof Error ? error.message : String(error));
    }
  }
  return meshes;
}
