// Meshes of the description: those that the run has, as geometry.
import * as THREE from 'three';
import { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js';
import { STLLoader } from 'three/examples/jsm/loaders/STLLoader.js';
import { parseCollada } from './collada';
import { fairShare, kMostTriangles, makeCoarser, trianglesOf } from './fewer_triangles';
import type { Hello } from './protocol';
import type { Source } from './source';

export interface Meshes {
  /** By the name that the description has: each use takes a copy. */
  readonly ready: Map<string, THREE.Object3D>;
  /** Why others are not there. */
  readonly why: Map<string, string>;
  /** Those that are drawn with fewer triangles than their files have, in words. */
  coarse: string[];
  /** Triangles that the robot may have. */
  most: number;
}
export const kNoMeshes: Meshes = { ready: new Map(), why: new Map(), coarse: [], most: 0 };

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
  dae: (bytes) => parseCollada(new TextDecoder().decode(bytes)),
};

/** The geometry in a file's bytes. @throws Error in words. */
export function parseMesh(file: string, bytes: ArrayBuffer): THREE.Object3D {
  const parse = kParsers[file.slice(file.lastIndexOf('.') + 1).toLowerCase()];
  if (!parse) throw new Error('it is neither STL, OBJ nor COLLADA');
  let made: THREE.Object3D;
  try {
    made = parse(bytes);
  } catch (error) {
    // The words of the other parsers are about their code.
    const words = parse === kParsers.dae && error instanceof Error ? `: ${error.message}` : '';
    throw new Error(`its content is neither STL, OBJ nor COLLADA${words}`);
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

/**
 * All that can be had.
 * @param uses how often each is drawn
 * @param slow no graphics processor draws
 */
export async function fetchMeshes(
  hello: Hello | null,
  source: Source,
  uses: Map<string, number>,
  slow: boolean,
): Promise<Meshes> {
  const most = slow ? kMostTriangles.without : kMostTriangles.withGpu;
  const meshes: Meshes = { ready: new Map(), why: new Map(), coarse: [], most };
  for (const { file, path, why } of hello?.meshes ?? []) {
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
  meshes.coarse = limitTriangles(meshes, uses, most);
  return meshes;
}

/**
 * Makes the largest coarser until the robot has `most` triangles.
 * @param uses how often each is drawn
 * @return what is drawn with fewer, in words
 */
export function limitTriangles(
  { ready }: Meshes,
  uses: Map<string, number>,
  most: number,
): string[] {
  const files = [...ready.keys()];
  const counts = files.map((file) => trianglesOf(ready.get(file)!));
  const share = fairShare(
    counts,
    files.map((file) => uses.get(file) ?? 0),
    most,
  );
  return files.flatMap((file, i) => {
    if (counts[i] <= share) return [];
    const mesh = ready.get(file)!;
    makeCoarser(mesh, share);
    return [`${file}: ${trianglesOf(mesh)} of ${counts[i]} triangles`];
  });
}
