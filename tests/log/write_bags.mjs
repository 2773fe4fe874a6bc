// Writes tests/data/recordings/*.mcap with encoders of others: the format's own project's writer,
// another project's CDR encoder, the zstd and lz4 programs. Big-endian bodies are written here byte
// by byte. node write_bags.mjs FOLDER
import { McapWriter } from "@mcap/core";
import { ros2humble } from "@foxglove/rosmsg-msgs-common";
import { MessageWriter } from "@foxglove/rosmsg2-serialization";
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";

const folder = process.argv[2];

class File {
  bytes = [];
  position() { return BigInt(this.bytes.reduce((sum, one) => sum + one.byteLength, 0)); }
  async write(data) { this.bytes.push(Uint8Array.from(data)); }
}

/** A message's definition with all that it needs, the wanted one first. */
function definitions(type) {
  const short = type.replace("/msg/", "/");
  const found = [];
  const add = (name) => {
    const one = ros2humble[name] ?? ros2humble[name.replace("/msg/", "/")];
    if (found.includes(one)) return;
    found.push(one);
    for (const field of one.definitions) if (field.isComplex) add(field.type);
  };
  add(type in ros2humble ? type : short);
  return found;
}

function text(type) {
  const line = (field) => {
    const name = field.type === "time" ? "builtin_interfaces/Time" : field.type;
    return `${name}${field.isArray ? `[${field.arrayLength ?? ""}]` : ""} ${field.name}`;
  };
  return definitions(type)
    .map((one, i) => (i === 0 ? "" : `${"=".repeat(80)}\nMSG: ${one.name}\n`) +
      one.definitions.filter((field) => !field.isConstant).map(line).join("\n") + "\n")
    .join("");
}

async function bag(name, options, topics, messages) {
  const file = new File();
  const writer = new McapWriter({ writable: file, ...options });
  await writer.start({ profile: "ros2", library: "write_bags.mjs" });
  const ids = {};
  for (const [topic, type] of Object.entries(topics)) {
    const schemaId = await writer.registerSchema(
      { name: type, encoding: "ros2msg", data: new TextEncoder().encode(text(type)) });
    ids[topic] = await writer.registerChannel(
      { schemaId, topic, messageEncoding: "cdr", metadata: new Map() });
  }
  let sequence = 0;
  for (const { topic, logNs, data } of messages) {
    await writer.addMessage({ channelId: ids[topic], sequence: sequence++, logTime: logNs,
      publishTime: logNs, data });
  }
  await writer.end();
  const all = Buffer.concat(file.bytes);
  writeFileSync(`${folder}/${name}.mcap`, all);
  console.log(name, all.length, "bytes");
}

const second = 1_000_000_000n;
const start = 1_700_000_000n * second;
const stamp = (ns) => ({ sec: Number(ns / second), nanosec: Number(ns % second) });
const compressed = (program) => (data) => ({ compression: program,
  compressedData: execFileSync(program, ["-c", "-q", "--content-size"], { input: data }) });

/** What the tests expect at time t [s] of joint 0 and 1. */
const position = (joint, t) => (joint === 0 ? 0.4 * Math.sin(2 * t) : 0.3 - 0.1 * t);
const velocity = (joint, t) => (joint === 0 ? 0.8 * Math.cos(2 * t) : -0.1);
const effort = (joint, t) => (joint === 0 ? 2 * Math.cos(t) : Math.sin(3 * t));

// 1: zstd chunks, other names and order, a joint too many, logged late and unevenly.
{
  const writer = new MessageWriter(definitions("sensor_msgs/msg/JointState"));
  const messages = [];
  for (let i = 0; i < 100; i++) {
    const t = i * 0.01;
    const ns = start + BigInt(i) * 10_000_000n;
    messages.push({ topic: "/joint_states", logNs: ns + 1_500_000n + BigInt(i % 7) * 100_000n,
      data: writer.writeMessage({ header: { stamp: stamp(ns), frame_id: "" },
        name: ["finger", "arm_2", "arm_1"],
        position: [0, position(1, t), position(0, t)],
        velocity: [0, velocity(1, t), velocity(0, t)],
        effort: [0, effort(1, t), effort(0, t)] }) });
  }
  await bag("zstd", { compressChunk: compressed("zstd"), chunkSize: 4096 },
    { "/joint_states": "sensor_msgs/msg/JointState" }, messages);
}

/** A body of CDR in big-endian order, header included. */
class BigEndian {
  bytes = [0, 0, 0, 0];
  align(size) { while ((this.bytes.length - 4) % size !== 0) this.bytes.push(0); }
  u32(value) {
    this.align(4);
    this.bytes.push((value >>> 24) & 255, (value >>> 16) & 255, (value >>> 8) & 255, value & 255);
  }
  f64(value) {
    this.align(8);
    const view = new DataView(new ArrayBuffer(8));
    view.setFloat64(0, value, false);
    for (let i = 0; i < 8; i++) this.bytes.push(view.getUint8(i));
  }
  string(value) {
    this.u32(value.length + 1);
    for (const one of value) this.bytes.push(one.charCodeAt(0));
    this.bytes.push(0);
  }
  list(values) { this.u32(values.length); for (const one of values) this.f64(one); }
  done() { return Uint8Array.from(this.bytes); }
}

// 2: no chunks, big-endian, the robot's own names; each joint by a publisher of its own; no velocity;
// effort of the second is NaN, as of an interface that is not there.
{
  const messages = [];
  for (let i = 0; i < 100; i++) {
    for (const joint of [0, 1]) {
      const t = i * 0.01;
      const ns = start + BigInt(i) * 10_000_000n;
      const out = new BigEndian();
      out.u32(Number(ns / second));
      out.u32(Number(ns % second));
      out.string("base");
      out.u32(1);
      out.string(joint === 0 ? "joint1" : "joint2");
      out.list([position(joint, t)]);
      out.list([]);
      out.list([joint === 0 ? effort(0, t) : NaN]);
      messages.push({ topic: "/joint_states", logNs: ns + BigInt(joint) * 1000n, data: out.done() });
    }
  }
  await bag("big_endian", { useChunks: false },
    { "/joint_states": "sensor_msgs/msg/JointState" }, messages);
}

// 3: lz4 chunks; joints, an IMU at another rate, a wrench.
{
  const joints = new MessageWriter(definitions("sensor_msgs/msg/JointState"));
  const imu = new MessageWriter(definitions("sensor_msgs/msg/Imu"));
  const wrench = new MessageWriter(definitions("geometry_msgs/msg/WrenchStamped"));
  const messages = [];
  for (let i = 0; i < 60; i++) {
    const t = i * 0.01;
    const ns = start + BigInt(i) * 10_000_000n;
    messages.push({ topic: "/joint_states", logNs: ns, data: joints.writeMessage(
      { header: { stamp: stamp(ns), frame_id: "" }, name: ["joint1", "joint2"],
        position: [position(0, t), position(1, t)], velocity: [velocity(0, t), velocity(1, t)],
        effort: [effort(0, t), effort(1, t)] }) });
    messages.push({ topic: "/ft", logNs: ns, data: wrench.writeMessage(
      { header: { stamp: stamp(ns), frame_id: "ft_frame" },
        wrench: { force: { x: 1 + t, y: 2, z: -30 * t }, torque: { x: 0.1, y: t, z: -0.2 } } }) });
    if (i % 2 === 1) continue;
    const half = t; // the tilt's half angle: about x by 2 t
    messages.push({ topic: "/imu", logNs: ns, data: imu.writeMessage(
      { header: { stamp: stamp(ns), frame_id: "link1" },
        orientation: { x: Math.sin(half), y: 0, z: 0, w: Math.cos(half) },
        orientation_covariance: new Array(9).fill(0),
        angular_velocity: { x: 2, y: t, z: -t }, angular_velocity_covariance: new Array(9).fill(0),
        linear_acceleration: { x: 0, y: 9.8 * t, z: 9.8 },
        linear_acceleration_covariance: new Array(9).fill(0) }) });
  }
  await bag("lz4", { compressChunk: compressed("lz4"), chunkSize: 4096 },
    { "/joint_states": "sensor_msgs/msg/JointState", "/imu": "sensor_msgs/msg/Imu",
      "/ft": "geometry_msgs/msg/WrenchStamped" }, messages);
}
