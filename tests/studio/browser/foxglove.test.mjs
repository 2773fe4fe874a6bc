// The studio by Foxglove's protocol, with Foxglove's own client and decoders, against a real run:
// TANDEM=build/release/bin/tandem node --test tests/studio/browser/foxglove.test.mjs
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { eventually, kPage } from './support.mjs';

const require = createRequire(join(kPage, 'package.json'));
const kTandem = process.env.TANDEM ?? join(kPage, '../../build/release/bin/tandem');
const kConfig = join(kPage, '../../config');
const kScratch = mkdtempSync(join(tmpdir(), 'tandem-foxglove-'));
const kSubprotocols = ['foxglove.websocket.v1', 'foxglove.sdk.v1'];
const lacks = [
  [existsSync(join(kPage, 'node_modules/@foxglove/ws-protocol')), 'npm packages of studio/page'],
  [existsSync(kTandem), kTandem],
].find(([is]) => !is);

describe('the studio by Foxglove’s protocol', {
  skip: lacks ? `${lacks[1]} is not there` : false,
  timeout: 480000,
}, () => {
  let child;
  let address;
  const socket = join(kScratch, 'run.sock');
  const ask = (request) =>
    JSON.parse(
      execFileSync(kTandem, ['ask', JSON.stringify(request), '--socket', socket], {
        encoding: 'utf8',
      }),
    );
  const clients = [];

  before(async () => {
    const words = ['run', join(kConfig, 'coman/squat.toml'), '--rate', '1', '--no-log'];
    words.push('--socket', socket, '--duration', '300', '--studio=0');
    words.push('--studio-origin', 'http://lichtblick.example');
    child = spawn(kTandem, words, { cwd: kScratch });
    let said = '';
    for (const stream of [child.stdout, child.stderr]) {
      stream.on('data', (data) => {
        said += data;
      });
    }
    await eventually('it says where', () => /studio: http\S+/.test(said));
    address = /studio: http:\/\/([^/]+)/.exec(said)[1];
    await eventually('the robot runs', () => ask({ do: 'status' }).phase === 'running');
  });
  after(async () => {
    for (const client of clients) client.close();
    const ended = new Promise((resolve) => child.on('exit', resolve));
    child.kill('SIGINT');
    await ended;
    rmSync(kScratch, { recursive: true, force: true });
  });

  /** A client and everything that it was told; messages decoded by the schemas announced. */
  const connect = async (subprotocol) => {
    const { FoxgloveClient } = require('@foxglove/ws-protocol');
    const { parse } = require('@foxglove/rosmsg');
    const { MessageReader } = require('@foxglove/rosmsg2-serialization');
    const ws = new (require('ws'))(`ws://${address}/`, [subprotocol]);
    const client = new FoxgloveClient({ ws });
    const it = { client, ws, channels: new Map(), messages: [], statuses: [], values: [] };
    const readers = new Map();
    client.on('error', (error) => it.statuses.push({ level: 3, message: String(error) }));
    client.on('serverInfo', (info) => {
      it.info = info;
    });
    client.on('advertise', (some) => {
      for (const one of some) it.channels.set(one.topic, one);
    });
    client.on('status', (status) => it.statuses.push(status));
    client.on('parameterValues', (values) => it.values.push(values));
    client.on('time', ({ timestamp }) => {
      it.time = timestamp;
    });
    client.on('fetchAssetResponse', (asset) => {
      it.asset = asset;
    });
    client.on('message', ({ subscriptionId, timestamp, data }) => {
      const { topic, reader } = readers.get(subscriptionId);
      it.messages.push({ topic, timestamp, value: reader.readMessage(data) });
    });
    it.subscribe = (topic) => {
      const { id, schema, encoding, schemaEncoding } = it.channels.get(topic);
      assert.deepEqual([encoding, schemaEncoding], ['cdr', 'ros2msg']);
      const reader = new MessageReader(parse(schema, { ros2: true }));
      readers.set(client.subscribe(id), { topic, reader });
    };
    it.of = (topic) => it.messages.filter((one) => one.topic === topic);
    clients.push(client);
    await eventually('it has channels', () => it.channels.size > 0 && it.info);
    assert.equal(ws.protocol, subprotocol);
    return it;
  };

  for (const subprotocol of kSubprotocols) {
    test(`${subprotocol}: joints, frames and description are the run's`, async () => {
      const it = await connect(subprotocol);
      assert.match(it.info.name, /^tandem .*: coman, squat.toml$/);
      assert.deepEqual([...it.info.capabilities].sort(), [
        'assets',
        'parameters',
        'parametersSubscribe',
        'time',
      ]);
      assert.match(it.info.sessionId, /^[0-9a-f]{8}$/);
      ask({ do: 'clock.pause' });
      for (const topic of it.channels.keys()) it.subscribe(topic);
      const joints = ask({ do: 'joint.list' }).joints;
      const cycles = ask({ do: 'clock.show' }).cycles;
      const shows = () => Number(it.of('/tandem/state').at(-1)?.value.cycle);
      await eventually('its last cycle', () => shows() === cycles - 1);
      const { value: shown, timestamp } = it.of('/joint_states').at(-1);
      assert.ok(joints.length > 20);
      for (const { joint, position_rad } of joints) {
        const place = shown.position[shown.name.indexOf(joint)];
        assert.ok(Math.abs(place - position_rad) < 1e-6, `${joint}: ${place}, ${position_rad}`);
      }
      const stamp = BigInt(shown.header.stamp.sec) * 1000000000n;
      assert.equal(stamp + BigInt(shown.header.stamp.nsec), timestamp);
      assert.equal(it.time, timestamp);

      const urdf = it.of('/robot_description')[0].value.data;
      assert.equal(urdf, readFileSync(join(kConfig, 'coman/coman.urdf'), 'utf8'));
      const links = [...urdf.matchAll(/<link\s+name="([^"]+)"/g)].map((found) => found[1]);
      const frames = [...it.of('/tf_static'), it.of('/tf').at(-1)].flatMap(
        (one) => one.value.transforms,
      );
      assert.deepEqual(
        frames.map((one) => one.child_frame_id).sort(),
        links.sort(),
        'each link has a place',
      );
      const base = frames.find((one) => one.header.frame_id === 'odom').transform.translation;
      assert.deepEqual(base, it.of('/odom').at(-1).value.pose.pose.position);
      ask({ do: 'clock.resume' });
      assert.deepEqual(it.statuses, []);
    });
  }

  test('at most 60 messages a second of a channel, and some of each that is fast', async () => {
    const it = await connect(kSubprotocols[0]);
    for (const topic of it.channels.keys()) it.subscribe(topic);
    await eventually('it goes on', () => it.of('/joint_states').length > 2);
    it.messages.length = 0;
    await new Promise((resolve) => setTimeout(resolve, 1000));
    for (const topic of [
      '/joint_states',
      '/tf',
      '/clock',
      '/imu/imu',
      '/tandem/controller/squat',
    ]) {
      const count = it.of(topic).length;
      assert.ok(count > 0 && count <= 60, `${topic}: ${count}`);
    }
    assert.deepEqual(it.statuses, []);
  });

  test('the bundled layout is whole, and its topics are the run’s', async () => {
    const it = await connect(kSubprotocols[0]);
    const layout = JSON.parse(readFileSync(join(kConfig, '../examples/foxglove/tandem.json')));
    const leaves = (node) =>
      typeof node === 'string' ? [node] : [...leaves(node.first), ...leaves(node.second)];
    const panels = Object.keys(layout.configById);
    assert.deepEqual(leaves(layout.layout).sort(), panels.sort());
    const text = JSON.stringify(layout);
    const wanted = [...text.matchAll(/"(?:value|topicToRender|topicPath)":"(\/[\w/]+)/g)];
    const topics = wanted.map(([, topic]) => topic);
    for (const panel of Object.values(layout.configById)) {
      topics.push(...Object.keys(panel.topics ?? {}));
    }
    assert.ok(topics.length > 8);
    for (const topic of topics) assert.ok(it.channels.has(topic), topic);
  });

  test('parameters are shown and not set; the rest is refused in words', async () => {
    const it = await connect(kSubprotocols[1]);
    it.client.getParameters(['squat.depth_m'], 'get');
    await eventually('an answer', () => it.values.length === 1);
    const [{ id, parameters }] = it.values;
    const [controller] = ask({ do: 'controller.show', name: 'squat' }).controllers;
    const truly = controller.parameters.find((one) => one.name === 'depth_m').value;
    assert.deepEqual(
      [id, parameters],
      ['get', [{ name: 'squat.depth_m', value: truly, type: 'float64' }]],
    );
    it.client.setParameters([{ name: 'squat.depth_m', value: 0.9, type: 'float64' }], 'set');
    await eventually('its value', () => it.values.length === 2);
    assert.match(it.statuses[0].message, /setParameters/);
    assert.equal(it.statuses[0].level, 2);
    assert.deepEqual(it.values[1], { ...it.values[1], id: 'set', parameters });

    it.client.advertise({ topic: '/cmd_vel', encoding: 'cdr', schemaName: 'geometry_msgs/Twist' });
    it.client.sendMessage(1, new Uint8Array(8));
    it.client.subscribeConnectionGraph();
    await eventually('three refusals', () => it.statuses.length === 4);
    assert.match(it.statuses[1].message, /only shows/);

    it.client.fetchAsset('package://coman/coman.urdf', 5);
    await eventually('the file', () => it.asset?.requestId === 5);
    const text = new TextDecoder().decode(it.asset.data);
    assert.equal(text, readFileSync(join(kConfig, 'coman/coman.urdf'), 'utf8'));
    for (const uri of ['package://coman/../icub/icub.urdf', 'package://coman/robot.toml']) {
      it.asset = undefined;
      it.client.fetchAsset(uri, 6);
      await eventually('an answer', () => it.asset?.requestId === 6);
      assert.equal(it.asset.status, 1, uri);
      assert.ok(it.asset.error);
    }

    const closed = new Promise((resolve) => it.ws.on('close', resolve));
    for (let i = 0; i < 20; ++i) it.ws.send(i % 2 ? 'garbage' : new Uint8Array([77, 7]));
    assert.equal(await closed, 1008);
  });

  test('pages of elsewhere are refused, unless the run names them', async () => {
    const status = (origin) =>
      new Promise((resolve) => {
        const ws = new (require('ws'))(`ws://${address}`, kSubprotocols, { origin });
        ws.on('unexpected-response', (_, answer) => resolve(answer.statusCode));
        ws.on('open', () => {
          ws.close();
          resolve(101);
        });
        ws.on('error', () => {});
      });
    assert.equal(await status('https://app.foxglove.dev'), 403);
    assert.equal(await status('http://lichtblick.example'), 101);
    assert.equal(await status('file://'), 101);
    assert.equal(await status(undefined), 101);
  });
});
