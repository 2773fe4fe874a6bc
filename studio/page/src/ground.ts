// The ground in 3D: lines on the level plane, or the terrain and the patches that the run has.
import * as THREE from 'three';
import { theme } from './dom';
import type { Ground, Patch, Terrain } from './protocol';

const kLines_m = 0.25;
const kExtent_m = 10;
/** Of a small robot the lines are nearer to each other. */
const kSmall_m = 0.3;
const kSmallShare = 0.2;
/** Of the texture that has a cell of the lines. */
const kCell_px = 64;
/** A patch lies so much over the terrain that it is seen. */
const kOver_m = 0.002;

/** The line before a place, and the share of the way to the next one: beyond the ends the ends'. */
function placeIn(lines: number[], at: number): [number, number] {
  let low = 0;
  let high = lines.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (lines[middle] <= at) low = middle;
    else high = middle;
  }
  const share = (at - lines[low]) / (lines[high] - lines[low]);
  return [low, Math.min(1, Math.max(0, share))];
}

/** Height of what is drawn at a place, over the level ground: between the run's heights. */
export function heightAt(terrain: Terrain, x: number, y: number): number {
  const [i, u] = placeIn(terrain.x_m, x);
  const [j, v] = placeIn(terrain.y_m, y);
  const width = terrain.x_m.length;
  const at = (row: number) => {
    const first = row * width + i;
    return (1 - u) * terrain.height_m[first] + u * terrain.height_m[first + 1];
  };
  return (1 - v) * at(j) + v * at(j + 1);
}

/** The lines within a range, and its ends. */
function within(lines: number[], [from, to]: number[]): number[] {
  return [from, ...lines.filter((line) => line > from && line < to), to];
}

/** A surface over lines of x and y. */
function surface(
  xs: number[],
  ys: number[],
  height: (x: number, y: number) => number,
): THREE.BufferGeometry {
  const places: number[] = [];
  const cells: number[] = [];
  const corners: number[] = [];
  ys.forEach((y, j) => {
    xs.forEach((x, i) => {
      places.push(x, y, height(x, y));
      cells.push(x / kLines_m, y / kLines_m);
      if (i === 0 || j === 0) return;
      const at = j * xs.length + i;
      corners.push(at, at - 1, at - xs.length, at - 1, at - xs.length - 1, at - xs.length);
    });
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(places, 3));
  geometry.setAttribute('uv', new THREE.Float32BufferAttribute(cells, 2));
  geometry.setIndex(corners);
  // Faces that share corners would be shaded as if they were round.
  const flat = geometry.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

/** A cell of the lines, which repeats. */
function cell(line: string, back: string, slow: boolean): THREE.Texture {
  const canvas = document.createElement('canvas');
  canvas.width = kCell_px;
  canvas.height = kCell_px;
  const context = canvas.getContext('2d');
  if (context) {
    context.fillStyle = back;
    context.fillRect(0, 0, kCell_px, kCell_px);
    context.fillStyle = line;
    context.fillRect(0, 0, kCell_px, 2);
    context.fillRect(0, 0, 2, kCell_px);
  }
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = THREE.RepeatWrapping;
  texture.wrapT = THREE.RepeatWrapping;
  texture.anisotropy = slow ? 1 : 8;
  if (slow) texture.minFilter = THREE.LinearMipmapNearestFilter;
  return texture;
}

const kPatchColours = ['#2f7de1', '#e69f00', '#8a4fbf', '#1a9e3f'];

export function patchColour(index: number): string {
  return kPatchColours[index % kPatchColours.length];
}

/** "ice: friction 0.1 to slide, 0.1 to stick" */
export function patchWords(patch: Patch): string {
  const soft =
    patch.stiffness_share < 1 ? `, ${Math.round(100 * patch.stiffness_share)} % stiff` : '';
  return `${patch.name}: friction ${patch.static_friction}, sliding ${patch.sliding_friction}${soft}`;
}

export class GroundView {
  readonly object = new THREE.Group();
  /** Without a graphics processor: plainer. */
  slow = false;
  private ground: Ground | null = null;
  private readonly moved = new THREE.Vector3();

  set(ground: Ground | null): void {
    this.ground = ground;
    this.moved.set(0, 0, 0);
    this.object.position.set(0, 0, 0);
  }

  /** Makes it anew: in the colours of the theme. @param radius of the robot */
  draw(radius: number, below: number): void {
    this.object.clear();
    const line = new THREE.Color(theme('--ground'));
    const { terrain } = this.ground ?? {};
    if (terrain) {
      const material = new THREE.MeshLambertMaterial({
        map: cell(theme('--ground'), theme('--terrain'), this.slow),
        side: THREE.DoubleSide,
        polygonOffset: true,
        polygonOffsetFactor: 1,
        polygonOffsetUnits: 1,
      });
      const mesh = new THREE.Mesh(
        surface(terrain.x_m, terrain.y_m, (x, y) => heightAt(terrain, x, y)),
        material,
      );
      mesh.name = 'terrain';
      this.object.add(mesh);
    } else {
      const grid = new THREE.GridHelper(kExtent_m, kExtent_m / kLines_m, line, line);
      grid.rotation.x = Math.PI / 2;
      grid.scale.setScalar(radius < kSmall_m ? kSmallShare : 1);
      this.object.add(grid);
    }
    (this.ground?.patches ?? []).forEach((patch, i) => {
      this.object.add(this.patch(patch, i));
    });
    for (const child of this.object.children) child.position.setZ(this.level(below));
  }

  /** @param at how far it was shaken [m]; empty: it does not move */
  move(at: number[]): void {
    if (at.length !== 3 || !at.every(Number.isFinite)) return;
    this.moved.set(at[0], at[1], at[2]);
    this.object.position.copy(this.moved);
  }

  /** Its height under a place of the world. @param below where there is none: below the robot */
  height(x: number, y: number, below: number): number {
    const { terrain } = this.ground ?? {};
    const { moved } = this;
    const rise = terrain ? heightAt(terrain, x - moved.x, y - moved.y) : 0;
    return this.level(below) + moved.z + rise;
  }

  private level(below: number): number {
    return this.ground?.height_m ?? Math.min(0, below);
  }

  private patch(patch: Patch, index: number): THREE.Mesh {
    const terrain = this.ground?.terrain;
    // What reaches far is drawn as far as the ground is.
    const far = (range: number[], lines?: number[]): number[] => {
      const [from, to] = lines ? [lines[0], lines[lines.length - 1]] : [-kExtent_m, kExtent_m];
      return [Math.max(range[0], from), Math.min(range[1], to)];
    };
    const xs = within(terrain?.x_m ?? [], far(patch.x_m, terrain?.x_m));
    const ys = within(terrain?.y_m ?? [], far(patch.y_m, terrain?.y_m));
    const mesh = new THREE.Mesh(
      surface(xs, ys, (x, y) => kOver_m + (terrain ? heightAt(terrain, x, y) : 0)),
      new THREE.MeshBasicMaterial({
        color: patchColour(index),
        transparent: true,
        opacity: 0.35,
        side: THREE.DoubleSide,
        depthWrite: false,
      }),
    );
    mesh.name = `patch ${patch.name}`;
    return mesh;
  }
}
