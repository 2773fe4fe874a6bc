// Meshes of more triangles than a browser draws in time: their corners are drawn together.
import * as THREE from 'three';

/** Of a robot, where a graphics processor draws and where none does. */
export const kMostTriangles = { withGpu: 2_000_000, without: 50_000 };

const kFinest = 1000; // cells along a side: their numbers are whole
const kTries = 12;

export function trianglesOf(object: THREE.Object3D): number {
  let corners = 0;
  object.traverse((one) => {
    if (!(one instanceof THREE.Mesh)) return;
    const geometry = one.geometry as THREE.BufferGeometry;
    corners += geometry.index?.count ?? geometry.getAttribute('position')?.count ?? 0;
  });
  return Math.floor(corners / 3);
}

/**
 * How many triangles each may have at most, so that all together have `most`: small ones keep
 * theirs. @param uses how often each is drawn
 */
export function fairShare(counts: number[], uses: number[], most: number): number {
  const order = counts.map((_, i) => i).sort((a, b) => counts[a] - counts[b]);
  let left = most;
  let waiting = uses.reduce((sum, one) => sum + one, 0);
  for (const i of order) {
    if (counts[i] * waiting > left) return Math.floor(left / waiting);
    left -= counts[i] * uses[i];
    waiting -= uses[i];
  }
  return Number.POSITIVE_INFINITY;
}

function areaOf(corners: THREE.BufferAttribute): number {
  const triangle = new THREE.Triangle();
  let area = 0;
  for (let i = 0; i + 2 < corners.count; i += 3) {
    area += triangle.setFromAttributeAndIndices(corners, i, i + 1, i + 2).getArea();
  }
  return area;
}

/** Triangles over the means of the corners in each cell of a grid; those within a cell are gone. */
function inCells(corners: THREE.BufferAttribute, box: THREE.Box3, cell: number): Float32Array {
  const cellOf = (value: number, from: number) => Math.floor((value - from) / cell);
  const nodes = new Map<number, number>();
  const nodeOf = new Uint32Array(corners.count);
  const sums: number[] = [];
  for (let i = 0; i < corners.count; ++i) {
    const [x, y, z] = [corners.getX(i), corners.getY(i), corners.getZ(i)];
    const key =
      cellOf(x, box.min.x) +
      (kFinest + 1) * (cellOf(y, box.min.y) + (kFinest + 1) * cellOf(z, box.min.z));
    let node = nodes.get(key);
    if (node === undefined) {
      node = nodes.size;
      nodes.set(key, node);
      sums.push(0, 0, 0, 0);
    }
    nodeOf[i] = node;
    sums[4 * node] += x;
    sums[4 * node + 1] += y;
    sums[4 * node + 2] += z;
    sums[4 * node + 3] += 1;
  }
  const made: number[] = [];
  const seen = new Set<string>();
  for (let i = 0; i + 2 < corners.count; i += 3) {
    const [a, b, c] = nodeOf.subarray(i, i + 3);
    if (a === b || b === c || c === a) continue;
    const turned = a < b && a < c ? [a, b, c] : b < c ? [b, c, a] : [c, a, b];
    const key = turned.join();
    if (seen.has(key)) continue;
    seen.add(key);
    for (const node of turned) {
      const count = sums[4 * node + 3];
      for (let k = 0; k < 3; ++k) made.push(sums[4 * node + k] / count);
    }
  }
  return new Float32Array(made);
}

/** The same with `most` triangles or fewer. */
export function coarser(geometry: THREE.BufferGeometry, most: number): THREE.BufferGeometry {
  const plain = geometry.index ? geometry.toNonIndexed() : geometry;
  const corners = plain.getAttribute('position') as THREE.BufferAttribute;
  if (corners.count <= 3 * most) return geometry;
  const box = new THREE.Box3().setFromBufferAttribute(corners);
  const size = box.getSize(new THREE.Vector3());
  const made = new THREE.BufferGeometry();
  // A surface has some two triangles in each cell that it passes.
  let cell = Math.max(
    Math.sqrt((2 * areaOf(corners)) / most),
    Math.max(size.x, size.y, size.z) / kFinest,
    Number.MIN_VALUE,
  );
  for (let left = kTries; left > 0; --left) {
    const positions = inCells(corners, box, cell);
    made.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    const triangles = positions.length / 9;
    if (triangles <= most) break;
    cell *= Math.max(1.1, Math.sqrt(triangles / most));
  }
  made.computeVertexNormals();
  return made;
}

/** Draws a mesh's parts with `most` triangles in sum. */
export function makeCoarser(object: THREE.Object3D, most: number): void {
  const share = most / trianglesOf(object);
  object.traverse((one) => {
    if (!(one instanceof THREE.Mesh)) return;
    const old = one.geometry as THREE.BufferGeometry;
    one.geometry = coarser(old, Math.floor(share * trianglesOf(one)));
  });
}
