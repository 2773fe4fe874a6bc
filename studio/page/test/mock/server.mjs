// A studio without a robot, for work on the page: node test/mock/server.mjs [ROBOT] [PORT]
import { existsSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { WebSocketServer } from 'ws';
import { EmulatedRobot } from './emulated_robot.mjs';
import { MockRobot } from './robot.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const kPolicy =
  "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const kFiles = { '/': 'index.html', '/studio.js': 'studio.js', '/studio.css': 'studio.css' };
const kTypes = { html: 'text/html; charset=utf-8', js: 'text/javascript', css: 'text/css' };
const kTick_ms = 33;

function tickFrame(robot, client) {
  const ids = client.signals;
  const frame = Buffer.alloc(32 + 12 * ids.length);
  frame.writeUInt8(1, 0);
  frame.writeUInt8(robot.paused ? 1 : 0, 1);
  frame.writeUInt32LE(client.revision, 4);
  frame.writeUInt32LE(0, 8);
  frame.writeUInt32LE(ids.length, 12);
  frame.writeBigUInt64LE(BigInt(robot.cycle), 16);
  frame.writeDoubleLE(robot.time, 24);
  ids.forEach((id, i) => {
    let min = Number.POSITIVE_INFINITY;
    let max = Number.NEGATIVE_INFINITY;
    let last = Number.NaN;
    const from = Math.max(robot.cycle - 33, 0);
    for (let cycle = from; cycle <= robot.cycle; ++cycle) {
      last = robot.values[id] ? robot.values[id](cycle / 1000) : Number.NaN;
      min = Math.min(min, last);
      max = Math.max(max, last);
    }
    frame.writeFloatLE(min, 32 + 12 * i);
    frame.writeFloatLE(max, 36 + 12 * i);
    frame.writeFloatLE(last, 40 + 12 * i);
  });
  return frame;
}

function windowFrame(robot, { id, signals, from_s, to_s, points }) {
  const from = Math.max(0, Math.round(from_s * 1000));
  const to = Math.min(robot.cycle, Math.round(to_s * 1000));
  const cycles = Math.max(0, to - from + 1);
  const per = cycles <= 4 * points ? 1 : Math.ceil(cycles / (2 * points));
  const rows = Math.floor(cycles / per);
  const width = per === 1 ? 1 : 2;
  const frame = Buffer.alloc(32 + 4 * signals.length * rows * width);
  frame.writeUInt8(2, 0);
  frame.writeUInt16LE(signals.length, 2);
  frame.writeUInt32LE(id, 4);
  frame.writeUInt32LE(rows, 8);
  frame.writeUInt32LE(per, 12);
  frame.writeDoubleLE(from / 1000, 16);
  frame.writeDoubleLE(per / 1000, 24);
  let at = 32;
  for (const signal of signals) {
    for (let row = 0; row < rows; ++row) {
      let min = Number.POSITIVE_INFINITY;
      let max = Number.NEGATIVE_INFINITY;
      for (let c = 0; c < per; ++c) {
        const value = robot.values[signal]((from + row * per + c) / 1000);
        min = Math.min(min, value);
        max = Math.max(max, value);
      }
      at = frame.writeFloatLE(min, at);
      if (width === 2) at = frame.writeFloatLE(max, at);
    }
  }
  return frame;
}

/** @param options robot, port, config, dist, hostile, passive, bus; emulated: its wires, no run. */
export async function startMock(options = {}) {
  const config = options.config ?? join(here, '../../../../config');
  const dist = options.dist ?? join(here, '../../dist');
  const Played = options.emulated ? EmulatedRobot : MockRobot;
  const robot = new Played({ robot: 'coman', ...options, config });
  const clients = new Set();
  const http = createServer((request, response) => {
    const path = request.url.split('?')[0];
    response.setHeader('Content-Security-Policy', kPolicy);
    response.setHeader('Cache-Control', 'no-store');
    if (path === '/robot.urdf') return response.end(robot.urdf);
    if (path.startsWith('/mesh/')) return response.end(robot.meshes[Number(path.slice(6))][1]);
    const file = kFiles[path] && join(dist, kFiles[path]);
    if (!file || !existsSync(file)) return response.writeHead(404).end(`${path} is not here`);
    response.setHeader('Content-Type', kTypes[file.split('.').at(-1)]);
    return response.end(readFileSync(file));
  });
  const sockets = new WebSocketServer({ server: http, path: '/ws' });
  let holder = null;
  const tellControl = () => {
    for (const one of clients) {
      one.send({
        op: 'control',
        taken: holder !== null,
        yours: holder === one,
        by: holder ? 'a page' : '',
      });
    }
  };
  sockets.on('connection', (socket) => {
    const client = { signals: [], revision: 0, may: 'look', watch: [], seen: new Map(), heard: 0 };
    client.send = (message) => socket.send(JSON.stringify(message));
    client.socket = socket;
    clients.add(client);
    client.send(robot.hello());
    client.send({ op: 'signals', revision: 1, sources: robot.table });
    client.send({ op: 'events', events: robot.events() });
    socket.on('close', () => {
      clients.delete(client);
      if (holder === client) {
        holder = null;
        robot.ask({ do: 'joint.halt' });
        tellControl();
      }
    });
    socket.on('message', async (data) => {
      const message = JSON.parse(data);
      client.heard = Date.now();
      if (message.op === 'enter') {
        client.may = message.token === 'abc' ? 'all' : 'look';
        client.send({ op: 'entered', may: client.may });
      } else if (message.op === 'subscribe') {
        client.signals = message.signals;
        client.revision = message.revision;
      } else if (message.op === 'window') {
        socket.send(windowFrame(robot, message));
      } else if (message.op === 'watch') {
        client.watch = message.requests;
        client.seen.clear();
      } else if (message.op === 'control') {
        if (message.take && holder === null && client.may === 'all') holder = client;
        else if (!message.take && holder === client) holder = null;
        tellControl();
      } else if (message.op === 'ask') {
        const { do: name } = message.request;
        const reads = /\.(show|list)$|^status$|^estop$/.test(name);
        let answer = null;
        if (!reads && client.may !== 'all') {
          answer = {
            ok: false,
            error: 'this page may look only',
            hint: 'open the address with its token',
          };
        } else if (name.startsWith('joint.') && !reads && holder !== client) {
          answer = { ok: false, error: 'nobody has control from here', hint: 'take control first' };
        } else answer = robot.ask(message.request);
        client.send({ op: 'answer', id: message.id, answer: await answer });
      }
    });
  });
  const ticks = setInterval(() => {
    if (!robot.paused) robot.time += (kTick_ms / 1000) * (robot.rate || 20);
    for (const client of clients) client.socket.send(tickFrame(robot, client));
    if (holder && Date.now() - holder.heard > 1000) {
      holder = null;
      robot.ask({ do: 'joint.halt' });
      tellControl();
    }
  }, kTick_ms);
  const watches = setInterval(() => {
    for (const client of clients) {
      for (const request of client.watch) {
        const answer = robot.ask({ do: request });
        robot.requests.pop();
        const text = JSON.stringify(answer);
        if (client.seen.get(request) === text) continue;
        client.seen.set(request, text);
        client.send({ op: 'watched', request, answer });
      }
    }
  }, 250);
  await new Promise((resolve) => http.listen(options.port ?? 0, '127.0.0.1', resolve));
  const port = http.address().port;
  return {
    robot,
    address: `http://127.0.0.1:${port}/#token=abc`,
    look: `http://127.0.0.1:${port}/`,
    drop: () => {
      for (const client of clients) client.socket.terminate();
    },
    say: (message) => {
      for (const client of clients) client.send(message);
    },
    stop: () =>
      new Promise((resolve) => {
        clearInterval(ticks);
        clearInterval(watches);
        for (const client of clients) client.socket.terminate();
        sockets.close();
        http.close(resolve);
        http.closeAllConnections();
      }),
  };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const mock = await startMock({
    robot: process.argv[2] ?? 'coman',
    port: Number(process.argv[3] ?? 8700),
  });
  process.stdout.write(`studio: ${mock.address}\n`);
}
