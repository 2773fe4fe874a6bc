// COLLADA as it is drawn, hostile ones, and meshes with more triangles than are drawn.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { DOMParser } from '@xmldom/xmldom';
import * as THREE from 'three';
import { kOwnColour, parseCollada } from '../src/collada';
import { coarser, fairShare, trianglesOf } from '../src/fewer_triangles';
import { kNoMeshes, limitTriangles } from '../src/meshes';

const read = (text: string) =>
  new DOMParser().parseFromString(text, 'text/xml') as unknown as Document;
const parse = (text: string) => parseCollada(text, read);

interface File {
  asset?: string;
  surfaces?: string;
  nodes?: string;
  more?: string;
}

/** A square of four corners in z = 0, of 2 by 1, in a node. */
function dae({ asset = '', surfaces = kTriangles, nodes = kNode, more = '' }: File = {}): string {
  return `<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>${asset}</asset>${more}
<library_effects><effect id="red"><profile_COMMON><technique sid="c"><phong>
  <diffuse><color>1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="paint"><instance_effect url="#red"/></material></library_materials>
<library_geometries><geometry id="square"><mesh>
  <source id="places"><float_array id="numbers" count="12">0 0 0 2 0 0 2 1 0 0 1 0</float_array>
    <technique_common><accessor source="#numbers" count="4" stride="3"/></technique_common></source>
  <source id="ups"><float_array id="up" count="3">0 0 1</float_array>
    <technique_common><accessor source="#up" count="1" stride="3"/></technique_common></source>
  <vertices id="corners"><input semantic="POSITION" source="#places"/></vertices>
  ${surfaces}</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene">${nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>`;
}
const kInputs =
  '<input semantic="VERTEX" source="#corners" offset="0"/><input semantic="NORMAL" source="#ups" offset="1"/>';
const kTriangles = `<triangles material="m" count="2">${kInputs}<p>0 0 1 0 2 0 0 0 2 0 3 0</p></triangles>`;
const kInstance = `<instance_geometry url="#square"><bind_material><technique_common>
  <instance_material symbol="m" target="#paint"/></technique_common></bind_material></instance_geometry>`;
const kNode = `<node>${kInstance}</node>`;

const meshes = (group: THREE.Object3D) => group.children as THREE.Mesh[];
const places = (mesh: THREE.Mesh) =>
  Array.from(mesh.geometry.getAttribute('position').array, (one) => Math.round(1e5 * one) / 1e5);
const kSquare = [0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 0, 0, 2, 1, 0, 0, 1, 0];

test('a COLLADA file has its surfaces, colours and normals', () => {
  const [mesh, ...others] = meshes(parse(dae()));
  assert.equal(others.length, 0);
  assert.deepEqual(places(mesh), kSquare);
  assert.deepEqual(Array.from(mesh.geometry.getAttribute('normal').array.slice(0, 3)), [0, 0, 1]);
  const look = mesh.material as THREE.MeshLambertMaterial;
  assert.equal(look.name, kOwnColour);
  assert.equal(look.color.getHexString(), 'ff0000');
  const plain = meshes(parse(dae({ nodes: '<node><instance_geometry url="#square"/></node>' })))[0];
  assert.notEqual((plain.material as THREE.Material).name, kOwnColour, "its colour is the URDF's");
});

test('its unit counts, and its axes stay as they are, as in RViz', () => {
  const [mesh] = meshes(
    parse(dae({ asset: '<unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis>' })),
  );
  assert.deepEqual(
    places(mesh),
    kSquare.map((one) => Math.round(100 * one) / 1e5),
  );
  for (const axis of ['X_UP', 'Y_UP', 'Z_UP']) {
    assert.deepEqual(
      places(meshes(parse(dae({ asset: `<up_axis>${axis}</up_axis>` })))[0]),
      kSquare,
    );
  }
});

test('nodes move, turn, scale and repeat their surfaces', () => {
  const nodes = `<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate>
    <node id="inner"><scale>2 2 2</scale>${kInstance}</node></node>
    <node><matrix>1 0 0 0 0 1 0 0 0 0 1 5 0 0 0 1</matrix><instance_node url="#inner"/></node>`;
  const [mesh] = meshes(parse(dae({ nodes })));
  assert.deepEqual(places(mesh).slice(0, 9), [10, 0, 0, 10, 4, 0, 8, 4, 0]);
  assert.deepEqual(places(mesh).slice(18, 27), [0, 0, 5, 4, 0, 5, 4, 2, 5]);
  // A mirror turns corners about, so that the outside stays outside.
  const [mirrored] = meshes(
    parse(dae({ nodes: `<node><scale>1 1 -1</scale>${kInstance}</node>` })),
  );
  mirrored.geometry.computeVertexNormals();
  assert.ok(mirrored.geometry.getAttribute('normal').getZ(0) < -0.9);
});

test('polygons, strips and fans are triangles', () => {
  const square = '0 0 1 0 2 0 3 0';
  for (const surfaces of [
    `<polylist count="1">${kInputs}<vcount>4</vcount><p>${square}</p></polylist>`,
    `<polygons count="1">${kInputs}<p>${square}</p></polygons>`,
    `<trifans count="1">${kInputs}<p>${square}</p></trifans>`,
  ]) {
    assert.deepEqual(places(meshes(parse(dae({ surfaces })))[0]), kSquare);
  }
  const strip = `<tristrips count="1">${kInputs}<p>0 0 1 0 3 0 2 0</p></tristrips>`;
  const [mesh] = meshes(parse(dae({ surfaces: strip })));
  assert.deepEqual(places(mesh).slice(9), [0, 1, 0, 2, 0, 0, 2, 1, 0].slice(0, 9));
  mesh.geometry.computeVertexNormals();
  for (let i = 0; i < 6; ++i) assert.equal(mesh.geometry.getAttribute('normal').getZ(i), 1);
  const lines = `<lines count="1">${kInputs}<p>0 0 1 0</p></lines>${kTriangles}`;
  assert.deepEqual(places(meshes(parse(dae({ surfaces: lines })))[0]), kSquare);
});

test('hostile COLLADA ends in words, and soon', () => {
  const bomb = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>';
  assert.throws(() => parse(bomb + dae()), /it defines entities/);
  assert.throws(
    () => parse('<!doctype COLLADA SYSTEM "http://elsewhere/x.dtd"><COLLADA/>'),
    /entities/,
  );
  assert.throws(() => parse('<robot/>'), /it is no COLLADA/);
  assert.throws(() => parse('<COLLADA/>'), /it has no scene/);
  const twice = (id: number) =>
    `<node id="n${id}"><instance_node url="#n${id + 1}"/><instance_node url="#n${id + 1}"/></node>`;
  const doubling = Array.from({ length: 60 }, (_, i) => twice(i)).join('');
  assert.throws(() => parse(dae({ nodes: doubling + kNode })), /more than 20000 nodes/);
  const loop = '<node id="a"><instance_node url="#a"/></node>';
  assert.throws(() => parse(dae({ nodes: loop })), /too deep/);
  const many = `<node id="n">${kInstance.repeat(2000)}</node>${'<instance_node url="#n"/>'.repeat(2000)}`;
  assert.throws(() => parse(dae({ nodes: `<node>${many}</node>` })), /more than 20000 nodes/);
  // Nothing but polygons without a surface, again and again.
  const empty = `<polylist>${kInputs}<vcount>${'1 '.repeat(3000)}</vcount><p>${'0 '.repeat(6000)}</p></polylist>`;
  const again = `<node>${kInstance.repeat(5000)}</node>`;
  assert.throws(() => parse(dae({ surfaces: empty, nodes: again })), /repeats itself/);
  const short = `<polylist>${kInputs}<vcount>1e9</vcount><p>0 0</p></polylist>`;
  assert.throws(() => parse(dae({ surfaces: short })), /cut short/);
  const nothing = '<triangles><p>0 1 2</p></triangles>';
  assert.throws(() => parse(dae({ surfaces: nothing })), /no corners/);
  const outside = kTriangles.replace('0 0 1 0', '0 0 999 0');
  assert.ok(places(meshes(parse(dae({ surfaces: outside })))[0]).some(Number.isNaN));
  const count = dae()
    .replace('count="12"', 'count="4000000000"')
    .replace('count="4"', 'count="4e9"');
  assert.deepEqual(places(meshes(parse(count))[0]), kSquare);
});

test('a picture, wherever it is, is not looked at', () => {
  const more =
    '<library_images><image id="i"><init_from>http://elsewhere/x.png</init_from></image></library_images>';
  const picture = dae({ more }).replace('<color>1 0 0 1</color>', '<texture texture="i"/>');
  const [mesh] = meshes(parse(picture));
  assert.deepEqual(places(mesh), kSquare);
  assert.notEqual((mesh.material as THREE.Material).name, kOwnColour);
});

const ball = (rings: number) => new THREE.SphereGeometry(0.5, rings, rings).toNonIndexed();

test('a mesh is drawn with as many triangles as it may have, in its shape', () => {
  const fine = ball(200);
  const made = coarser(fine, 5000);
  const count = made.getAttribute('position').count / 3;
  assert.ok(count <= 5000 && count > 2000, String(count));
  const places = made.getAttribute('position');
  for (let i = 0; i < places.count; ++i) {
    const radius = Math.hypot(places.getX(i), places.getY(i), places.getZ(i));
    assert.ok(Math.abs(radius - 0.5) < 0.01, String(radius));
  }
  assert.equal(coarser(made, 5000), made, 'what is small enough stays');
  const outwards = new THREE.Vector3().fromBufferAttribute(places, 0);
  const normal = new THREE.Vector3().fromBufferAttribute(made.getAttribute('normal'), 0);
  assert.ok(outwards.normalize().dot(normal) > 0.9);
  // Triangles from anywhere to anywhere, and none at all of some size.
  let seed = 1;
  const random = () => {
    seed = (seed * 48271) % 2147483647;
    return seed / 2147483647;
  };
  for (const scale of [1, 0]) {
    const soup = new THREE.BufferGeometry();
    const corners = Float32Array.from({ length: 9 * 20000 }, () => scale * random());
    soup.setAttribute('position', new THREE.BufferAttribute(corners, 3));
    assert.ok(coarser(soup, 1000).getAttribute('position').count <= 3000);
  }
});

test('only large meshes of a robot give way, and each use counts', () => {
  assert.equal(fairShare([10, 20, 30], [1, 1, 1], 100), Number.POSITIVE_INFINITY);
  assert.equal(fairShare([10, 200, 300], [1, 1, 1], 110), 50);
  assert.equal(fairShare([10, 200, 300], [1, 4, 1], 260), 50);
  assert.equal(fairShare([10, 200], [1, 0], 20), Number.POSITIVE_INFINITY);
  const ready = new Map<string, THREE.Object3D>();
  for (const [file, rings] of [
    ['a.stl', 60],
    ['b.stl', 10],
  ] as const) {
    ready.set(file, new THREE.Mesh(ball(rings)));
  }
  const small = trianglesOf(ready.get('b.stl')!);
  const words = limitTriangles(
    { ...kNoMeshes, ready },
    new Map([
      ['a.stl', 2],
      ['b.stl', 1],
    ]),
    3000,
  );
  assert.equal(words.length, 1);
  assert.match(words[0], /^a\.stl: \d+ of 7080 triangles$/);
  assert.equal(trianglesOf(ready.get('b.stl')!), small);
  assert.ok(2 * trianglesOf(ready.get('a.stl')!) + small <= 3000);
});
