// The surfaces of a COLLADA file (.dae), as RViz draws them: its unit counts, its up_axis does not.
import * as THREE from 'three';
import { childrenOf } from './urdf';

/** A mesh with this name keeps its own colour. */
export const kOwnColour = "the file's own";

// Bounds for files that name little and mean much.
const kMostCorners = 6_000_000;
const kMostNodes = 20_000;
const kMostSteps = 10_000_000;
const kDeepest = 100;
const kMostColours = 64;

/** Triangles of one colour, corner by corner. */
interface Surface {
  positions: number[];
  normals: number[];
  colour: THREE.Color | null;
}
interface Input {
  semantic: string;
  offset: number;
  /** A triple of numbers of an index. */
  at(index: number): ArrayLike<number>;
}

function readXml(text: string): Document {
  return new DOMParser().parseFromString(text, 'text/xml');
}

function numberOf(of: Element | undefined, name: string, otherwise: number): number {
  const text = of?.getAttribute(name);
  return text ? Number(text) : otherwise;
}

/** A file while it is read. */
class Reader {
  readonly surfaces = new Map<string, Surface>();
  private readonly ids = new Map<string, Element>();
  private readonly lists = new Map<Element, Element[]>();
  private readonly arrays = new Map<Element, Float64Array>();
  private readonly unit: number;
  private nodes = 0;
  private steps = 0;
  private corners = 0;

  constructor(private readonly root: Element) {
    for (const one of Array.from(root.getElementsByTagName('*'))) {
      const id = one.getAttribute('id');
      if (id) this.ids.set(id, one);
    }
    const unit = numberOf(this.child(root, 'asset', 'unit'), 'meter', 1);
    this.unit = Number.isFinite(unit) && unit > 0 ? unit : 1;
  }

  read(): void {
    const scene =
      this.named(this.child(this.root, 'scene', 'instance_visual_scene'), 'url') ??
      this.child(this.root, 'library_visual_scenes', 'visual_scene');
    if (!scene) throw new Error('it has no scene');
    this.visit(scene, new THREE.Matrix4().makeScale(this.unit, this.unit, this.unit), 0);
  }

  /** A short file may repeat a long part of it again and again. */
  private spend(steps: number): void {
    this.steps += steps;
    if (this.steps > kMostSteps) throw new Error('it repeats itself without end');
  }

  private spendNode(): void {
    if (++this.nodes > kMostNodes) throw new Error(`it has more than ${kMostNodes} nodes`);
  }

  private children(of: Element | undefined, name?: string): Element[] {
    if (!of) return [];
    const all = this.lists.get(of) ?? childrenOf(of);
    this.lists.set(of, all);
    this.spend(1 + all.length);
    return name ? all.filter((one) => one.nodeName === name) : all;
  }

  private child(of: Element | undefined, ...path: string[]): Element | undefined {
    return path.reduce((found, name) => this.children(found, name)[0], of);
  }

  private numbers(of: Element | undefined): Float64Array {
    if (!of) return new Float64Array();
    const text = this.arrays.has(of) ? '' : (of.textContent ?? '').trim();
    const all = this.arrays.get(of) ?? Float64Array.from(text ? text.split(/\s+/) : [], Number);
    this.arrays.set(of, all);
    return all;
  }

  /** What "#id" in an attribute names: of this file alone. */
  private named(of: Element | undefined, attribute: string): Element | undefined {
    const name = of?.getAttribute(attribute) ?? '';
    return name.startsWith('#') ? this.ids.get(name.slice(1)) : undefined;
  }

  private visit(node: Element, above: THREE.Matrix4, depth: number): void {
    this.spendNode();
    if (depth > kDeepest) throw new Error('its nodes are too deep');
    const here = above.clone();
    for (const one of this.children(node)) here.multiply(this.moveOf(one));
    for (const one of this.children(node)) {
      if (one.nodeName === 'node') this.visit(one, here, depth + 1);
      if (one.nodeName === 'instance_node') {
        const its = this.named(one, 'url');
        if (its) this.visit(its, here, depth + 1);
      }
      if (one.nodeName === 'instance_geometry') this.place(one, here);
    }
  }

  private moveOf(one: Element): THREE.Matrix4 {
    const move = new THREE.Matrix4();
    if (!['matrix', 'translate', 'rotate', 'scale'].includes(one.nodeName)) return move;
    const [x = 0, y = 0, z = 0, angle = 0, ...rest] = this.numbers(one);
    if (one.nodeName === 'translate') return move.makeTranslation(x, y, z);
    if (one.nodeName === 'scale') return move.makeScale(x, y, z);
    if (one.nodeName === 'matrix') return move.fromArray([x, y, z, angle, ...rest]).transpose();
    const axis = new THREE.Vector3(x, y, z).normalize();
    return move.makeRotationAxis(axis, THREE.MathUtils.degToRad(angle));
  }

  private place(instance: Element, here: THREE.Matrix4): void {
    this.spendNode();
    const materials = this.child(instance, 'bind_material', 'technique_common');
    for (const part of this.children(this.child(this.named(instance, 'url'), 'mesh'))) {
      if (!['triangles', 'polylist', 'polygons', 'tristrips', 'trifans'].includes(part.nodeName)) {
        continue;
      }
      const bound = this.children(materials, 'instance_material').find(
        (one) => one.getAttribute('symbol') === part.getAttribute('material'),
      );
      this.add(part, here, this.colourOf(this.named(bound, 'target')));
    }
  }

  /** Of a material without a picture; null: another one is needed. */
  private colourOf(material: Element | undefined): THREE.Color | null {
    const effect = this.named(this.child(material, 'instance_effect'), 'url');
    const look = this.child(effect, 'profile_COMMON', 'technique');
    const shader = this.children(look).find((one) => this.child(one, 'diffuse'));
    const rgb = this.numbers(this.child(shader, 'diffuse', 'color'));
    if (rgb.length < 3 || !rgb.every(Number.isFinite)) return null;
    return new THREE.Color().setRGB(rgb[0], rgb[1], rgb[2], THREE.SRGBColorSpace);
  }

  private surfaceOf(colour: THREE.Color | null): Surface {
    const known = (key: string) => this.surfaces.get(key);
    let key = colour?.getHexString() ?? '';
    if (!known(key) && this.surfaces.size >= kMostColours) key = '';
    const its = known(key) ?? { positions: [], normals: [], colour: key ? colour : null };
    this.surfaces.set(key, its);
    return its;
  }

  private add(part: Element, here: THREE.Matrix4, colour: THREE.Color | null): void {
    const inputs = this.children(part, 'input').flatMap((one) => this.inputsOf(one));
    const stride = 1 + Math.max(...inputs.map((one) => one.offset));
    const position = inputs.find((one) => one.semantic === 'POSITION');
    if (!position || !Number.isInteger(stride)) throw new Error('a surface of it has no corners');
    const normal = inputs.find((one) => one.semantic === 'NORMAL');
    const { positions, normals } = this.surfaceOf(colour);
    const turn = new THREE.Matrix3().getNormalMatrix(here);
    const place = new THREE.Vector3();
    const mirrored = here.determinant() < 0;
    const put = (indices: Float64Array, corner: number) => {
      if (++this.corners > kMostCorners) throw new Error('it has more than 2 million triangles');
      const from = corner * stride;
      place.fromArray(position.at(indices[from + position.offset])).applyMatrix4(here);
      positions.push(place.x, place.y, place.z);
      if (normal) place.fromArray(normal.at(indices[from + normal.offset])).applyMatrix3(turn);
      else place.set(0, 0, 0);
      normals.push(...place.normalize());
    };
    for (const [indices, a, b, c] of this.trianglesOf(part, stride)) {
      put(indices, a);
      put(indices, mirrored ? c : b);
      put(indices, mirrored ? b : c);
    }
  }

  /** An input of corners stands for those of <vertices>. */
  private inputsOf(input: Element): Input[] {
    const semantic = input.getAttribute('semantic') ?? '';
    const offset = numberOf(input, 'offset', 0);
    const source = this.named(input, 'source');
    if (!source) return [];
    if (source.nodeName === 'vertices') {
      return this.children(source, 'input')
        .filter((one) => this.named(one, 'source')?.nodeName === 'source')
        .flatMap((one) => this.inputsOf(one).map((its) => ({ ...its, offset })));
    }
    const accessor = this.child(source, 'technique_common', 'accessor');
    const array = this.named(accessor, 'source');
    if (!array) return [];
    const values = this.numbers(array);
    const step = numberOf(accessor, 'stride', 1);
    const first = numberOf(accessor, 'offset', 0);
    const at = (index: number) => values.subarray(first + index * step, first + index * step + 3);
    return [{ semantic, offset, at }];
  }

  /** Corners of each triangle in the indices of a <p>; polygons are fans about their first corner. */
  private *trianglesOf(
    part: Element,
    stride: number,
  ): Generator<[Float64Array, number, number, number]> {
    const counts = part.nodeName === 'polylist' ? this.numbers(this.child(part, 'vcount')) : null;
    const holed = this.children(part, 'ph').flatMap((one) => this.children(one, 'p'));
    for (const p of [...this.children(part, 'p'), ...holed]) {
      const indices = this.numbers(p);
      const all = Math.floor(indices.length / stride);
      const sizes = counts ?? (part.nodeName === 'triangles' ? triples(all) : [all]);
      let first = 0;
      for (const size of sizes) {
        if (!(size >= 0) || first + size > all) throw new Error('a surface of it is cut short');
        for (let k = 2; k < size; ++k) {
          const last = first + k;
          if (part.nodeName !== 'tristrips') yield [indices, first, last - 1, last];
          else if (k % 2 === 0) yield [indices, last - 2, last - 1, last];
          else yield [indices, last - 1, last - 2, last];
        }
        first += size;
        this.spend(1);
      }
    }
  }
}

function* triples(all: number): Generator<number> {
  for (let left = all; left >= 3; left -= 3) yield 3;
}

function meshOf({ positions, normals, colour }: Surface): THREE.Mesh {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new THREE.Float32BufferAttribute(normals, 3));
  let whole = true;
  for (let i = 0; whole && i < normals.length; i += 3) {
    whole = Math.abs(Math.hypot(normals[i], normals[i + 1], normals[i + 2]) - 1) < 1e-3;
  }
  if (!whole) geometry.computeVertexNormals();
  const own = colour && new THREE.MeshLambertMaterial({ color: colour, name: kOwnColour });
  return new THREE.Mesh(geometry, own ?? undefined);
}

/**
 * Pictures, animations and what other files have are left out: nothing is asked for.
 * @throws Error in words.
 */
export function parseCollada(
  text: string,
  read: (text: string) => Document = readXml,
): THREE.Group {
  // Entities may grow without end, or name files.
  if (/<!(DOCTYPE|ENTITY)/i.test(text)) throw new Error('it defines entities');
  const root = read(text).documentElement;
  if (root?.nodeName !== 'COLLADA') throw new Error('it is no COLLADA');
  const reader = new Reader(root);
  reader.read();
  const group = new THREE.Group();
  for (const one of reader.surfaces.values()) {
    if (one.positions.length > 0) group.add(meshOf(one));
  }
  return group;
}
