// What is drawn of a description: of the bundled robots, and of hostile ones.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { DOMParser } from '@xmldom/xmldom';
import { parseMesh } from '../src/meshes';
import { describe, planOf, prepare } from '../src/urdf';

const parse = (text: string) =>
  new DOMParser().parseFromString(text, 'text/xml') as unknown as Document;
const bundled = (robot: string) =>
  parse(readFileSync(`${process.env.TANDEM_CONFIG}/${robot}/${robot}.urdf`, 'utf8'));
const count = (doc: Document, tag: string) => doc.getElementsByTagName(tag).length;

test('COMAN is drawn by its boxes', () => {
  const plan = planOf(describe(bundled('coman')));
  assert.deepEqual(plan, { capsules: [], byCollision: [], notDrawn: [] });
});

test('the four-bar linkage, which has no visuals, is drawn as its four bars', () => {
  const plan = planOf(describe(bundled('four_bar')));
  assert.deepEqual(plan.capsules, [
    { link: 'ground', from: [0, 0, 0], to: [0.3, 0, 0] },
    { link: 'crank', from: [0, 0, 0], to: [0.1, 0, 0] },
    { link: 'coupler', from: [0, 0, 0], to: [0.28, 0, 0] },
    { link: 'rocker', from: [0, 0, 0], to: [0.2, 0, 0] },
  ]);
});

test('Walk-Man, which has no visuals, has rods in both legs', () => {
  const rods = planOf(describe(bundled('walkman'))).capsules.map((rod) => rod.link);
  for (const link of ['LHipMot', 'RHipMot']) {
    assert.ok(
      rods.some((one) => one.startsWith(link[0])),
      link,
    );
  }
  assert.ok(rods.length > 20);
});

const kMeshes = `<robot name="r">
  <link name="a"><visual><geometry><mesh filename="package://r/a.stl"/></geometry></visual>
    <collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="b"><visual><geometry><mesh filename="b.dae"/></geometry></visual></link>
  <link name="c"><visual name="v"><geometry><sphere radius="1"/></geometry>
    <material name="m"><texture filename="http://elsewhere/x.png"/></material></visual></link>
  <joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>
  <joint name="bc" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 0.5"/>
    <mimic joint="nobody"/></joint>
  <gazebo><mesh filename="http://elsewhere/y.stl"/></gazebo>
</robot>`;

test('meshes become words and other shapes', () => {
  const plan = planOf(describe(parse(kMeshes)));
  assert.deepEqual(plan.byCollision, ['a']);
  assert.deepEqual(plan.capsules, [{ link: 'b', from: [0, 0, 0], to: [0, 0, 0.5] }]);
  assert.deepEqual(plan.notDrawn, [
    'a: mesh package://r/a.stl (it is not here): its collision shape instead',
    'b: mesh b.dae (it is not here): a rod instead',
  ]);
});

test('what the loader gets names no file, and nobody that is not there', () => {
  const doc = parse(kMeshes);
  prepare(doc, planOf(describe(doc)), new Set());
  for (const tag of ['mesh', 'texture', 'gazebo', 'mimic']) assert.equal(count(doc, tag), 0, tag);
  assert.equal(count(doc, 'box'), 1);
  assert.equal(count(doc, 'sphere'), 1);
});

test('names of any kind become plain ones', () => {
  const hostile = '&lt;img src=x onerror=alert(1)&gt;&quot;]';
  const doc = parse(`<robot><link name="__proto__"/><link name="${hostile}"/>
    <joint name="${hostile}" type="revolute"><parent link="__proto__"/><child link="${hostile}"/>
    </joint></robot>`);
  const names = prepare(doc, planOf(describe(doc)), new Set());
  assert.deepEqual([...names.links.values()], ['link_0', 'link_1']);
  assert.equal(names.joints.get('<img src=x onerror=alert(1)>"]'), 'joint_0');
  assert.equal(doc.getElementsByTagName('child')[0].getAttribute('link'), 'link_1');
});

test('a follower with values of its own follows nobody', () => {
  const text = (name: string) => `<robot><link name="a"/><link name="b"/><link name="c"/>
    <joint name="x" type="revolute"><parent link="a"/><child link="b"/></joint>
    <joint name="${name}" type="revolute"><parent link="b"/><child link="c"/>
      <mimic joint="x"/></joint></robot>`;
  const doc = parse(text('y'));
  prepare(doc, planOf(describe(doc)), new Set(['y']));
  assert.equal(count(doc, 'mimic'), 0);
  const other = parse(text('z'));
  prepare(other, planOf(describe(other)), new Set(['y']));
  assert.equal(other.getElementsByTagName('mimic')[0].getAttribute('joint'), 'joint_0');
});

test('what is no robot says so', () => {
  assert.throws(() => describe(parse('<html/>')), /no URDF/);
});

test('meshes that are there are kept, with their names', () => {
  const doc = parse(`<robot name="r"><link name="a">
    <visual><geometry><mesh filename="a.stl" scale="1 1 1"/></geometry></visual>
    <visual><geometry><mesh filename="b.dae"/></geometry></visual></link></robot>`);
  const plan = planOf(describe(doc), (file) =>
    file === 'a.stl' ? '' : 'it is neither STL nor OBJ',
  );
  assert.deepEqual(plan.notDrawn, [
    'a: mesh b.dae (it is neither STL nor OBJ): its other shapes are drawn',
  ]);
  prepare(doc, plan, new Set(), (file) => file === 'a.stl');
  const kept = doc.getElementsByTagName('mesh');
  assert.equal(kept.length, 1);
  assert.equal(kept[0].getAttribute('filename'), 'a.stl');
});

test('meshes are read by their ending, and have a surface', () => {
  const bytes = (text: string) => new TextEncoder().encode(text).buffer as ArrayBuffer;
  const corner = (x: number, y: number) => `vertex ${x} ${y} 0\n`;
  const facet = `facet normal 0 0 1\nouter loop\n${corner(0, 0)}${corner(1, 0)}${corner(0, 1)}endloop\nendfacet\n`;
  assert.ok(parseMesh('A.STL', bytes(`solid a\n${facet}endsolid a\n`)));
  assert.ok(parseMesh('a.obj', bytes('v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n')));
  assert.throws(() => parseMesh('a.obj', bytes('# nothing')), /it has no surface/);
  for (const far of ['v nan 0 0', 'v 1e30 0 0']) {
    const text = `v 0 0 0\nv 1 0 0\n${far}\nf 1 2 3\n`;
    assert.throws(() => parseMesh('a.obj', bytes(text)), /no place near the robot/, far);
  }
  const beyond = bytes('v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n');
  assert.throws(() => parseMesh('a.obj', beyond), /no place near the robot/);
  assert.throws(() => parseMesh('a.ply', bytes('ply')), /neither STL, OBJ nor COLLADA/);
});
