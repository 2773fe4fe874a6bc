// Decodes every message of every channel of a log with @foxglove/rosmsg and
// @foxglove/rosmsg2-serialization, as ROS viewers do, by nothing but the log's own schemas. Compares
// every number with the tables of `tandem log csv --every N`; what is there for viewers with the
// images of the same cycle, and its schemas with ROS 2's published ones. Exits with 1 at the first
// disagreement. A channel that it cannot compare is one, too.
//   node decode_log.mjs LOG N TOPIC=TABLE.csv …
import { readFile } from "node:fs/promises";
import { McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { parse } from "@foxglove/rosmsg";
import common from "@foxglove/rosmsg-msgs-common";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const [path, every, ...named] = process.argv.slice(2);

function fail(message) {
  console.error(`${path}: ${message}`);
  process.exit(1);
}

/// Lines of cells; a cell in quotes holds no quotes.
async function table(file) {
  const lines = (await readFile(file, "utf8")).trimEnd().split("\n");
  const cells = (line) =>
    line.includes('"') ? [...line.matchAll(/"([^"]*)"|([^,]+)/g)].map((one) => one[1] ?? one[2]) : line.split(",");
  return { head: cells(lines[0]), rows: lines.slice(1).map(cells) };
}

const tables = new Map();
for (const one of named) {
  const [topic, file] = one.split("=");
  tables.set(topic, await table(file));
}

/// The numbers of a message in the order of its fields.
function numbers(definition, message) {
  return definition.definitions.flatMap((field) => {
    const value = message[field.name];
    if (field.isComplex) return Object.values(value).map(Number);
    return field.isArray ? Array.from(value, Number) : [Number(value)];
  });
}

/// The numbers of a part, which has one of each joint or sensor.
const each = (part) => Object.values(part ?? {});

/// Whether joints and sensors were never measured: their samples are older than the run.
const unmeasured = (message) =>
  [...each(message.age_cycles), ...each(message.sensor_age_cycles)].map((age) => age > message.cycle);

/// What `tandem log csv` writes of an event, without the time and the kind's name.
const ofEvent = (event) => [Number(event.cycle), event.joint, event.code, event.text];
const eventRow = (row) => [Number(row[1]), Number(row[3]), Number(row[4]), row[5]];

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/// A type's fields with those of its parts, by nothing but their names and types.
function outline(name, find) {
  return find(name).definitions.filter((field) => !field.isConstant).map((field) => {
    const { type, isArray, arrayLength } = field;
    const part = field.isComplex ? outline(type, find) : type;
    return [field.name, part, isArray ?? false, arrayLength ?? 0];
  });
}

/// What viewers need, by its type: whether `message` says the same as what came before it.
const last = new Map(); // topic -> message
const metadata = new Map();
const views = {
  "sensor_msgs/msg/JointState": (message, time) => {
    const state = last.get("/tandem/state");
    const stamp = BigInt(message.header.stamp.sec) * 1000000000n + BigInt(message.header.stamp.nanosec ?? message.header.stamp.nsec);
    return (
      stamp === time && state.time_ns === time &&
      same(message.name, metadata.get("tandem").get("joints").trimEnd().split("\n")) &&
      same(Array.from(message.position), each(state.position_rad)) &&
      same(Array.from(message.velocity), each(state.velocity_rad_s)) &&
      same(Array.from(message.effort), each(state.torque_nm))
    );
  },
  // Links in the ones before them; a floating base in odom, in a message of its own.
  "tf2_msgs/msg/TFMessage": (message, time, topic) => {
    const truth = last.get("/tandem/truth");
    return message.transforms.length > 0 && message.transforms.every((one) => {
      const { translation: p, rotation: q } = one.transform;
      if (one.child_frame_id === "" || Math.abs(Math.hypot(q.x, q.y, q.z, q.w) - 1) > 1e-9) return false;
      if (topic === "/tf_static" || one.header.frame_id !== "odom") return true;
      return (
        message.transforms.length === 1 && truth.time_ns === time &&
        same([p.x, p.y, p.z], Array.from(truth.base_position_m)) &&
        same([q.x, q.y, q.z, q.w], Array.from(truth.base_quaternion))
      );
    });
  },
  "std_msgs/msg/String": (message) => {
    const files = [...metadata.get("configuration")];
    return message.data.length > 0 && files.some(([, text]) => text === message.data);
  },
};

class Channel {
  constructor(record, schema) {
    this.topic = record.topic;
    if (schema.encoding !== "ros2msg" || record.messageEncoding !== "cdr") {
      fail(`${this.topic} is ${schema.encoding} and ${record.messageEncoding}`);
    }
    try {
      this.definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
    } catch (error) {
      fail(`the schema of ${this.topic}: ${error.message}`);
    }
    this.reader = new MessageReader(this.definitions);
    this.messages = 0;
    this.rows = 0;
    this.compared = 0;
    this.view = views[schema.name];
    if (this.view) {
      const short = (name) => (name ?? "").replace("/msg/", "/");
      const type = short(schema.name);
      const ours = outline(type, (name) =>
        name === type ? this.definitions[0] : this.definitions.find((one) => short(one.name) === short(name)));
      const theirs = outline(type, (name) => common.ros2jazzy[short(name)]);
      if (!same(ours, theirs)) fail(`${this.topic} is no ${type} as it is published`);
      return;
    }
    this.table = tables.get(this.topic) ?? fail(`there is no table of ${this.topic}`);
  }

  take(record) {
    const message = this.reader.readMessage(record.data);
    last.set(this.topic, message);
    const index = this.messages++;
    if (this.view) {
      if (!this.view(message, record.logTime, this.topic)) fail(`${this.topic}, message ${index}: is not what its image says`);
      ++this.compared;
      return;
    }
    const event = this.topic === "/tandem/event";
    if (!event && index % Number(every) !== 0) return;
    const old = unmeasured(message);
    if (this.rows === 0 && old.length > 0 && !old.includes(false)) return; // the table begins later
    const command = this.topic === "/tandem/command"; // repeats positions until a controller writes them
    if (this.rows === 0 && command && message.cycle < Number(this.table.rows[0]?.[1])) return; // not measured yet
    const row = this.table.rows[this.rows++];
    if (row === undefined) fail(`the table of ${this.topic} ends before message ${index}`);
    const expected = event ? eventRow(row) : row.slice(1).map((cell) => (cell === "" ? null : Number(cell)));
    const values = event ? ofEvent(message) : numbers(this.definitions[0], message);
    if (values.length !== expected.length) {
      fail(`${this.topic}: ${values.length} values, ${expected.length} columns`);
    }
    for (const [i, value] of values.entries()) {
      if (expected[i] === null && old.includes(true)) continue;
      if (expected[i] === null && command && this.table.head[i + 1].startsWith("position_rad")) continue;
      if (!Object.is(value, expected[i])) {
        const name = event ? "an event" : this.table.head[i + 1];
        fail(`${this.topic}, message ${index}: ${name} is ${value}, the table says ${expected[i]}`);
      }
      ++this.compared;
    }
    const time = Number(record.logTime) * 1e-9;
    if (Math.abs(Number(row[0]) - time) > 1e-12 * Math.abs(time)) {
      fail(`${this.topic}, message ${index}: is of ${time} s, the table says ${row[0]}`);
    }
    if (typeof message.time_ns !== "bigint" || message.time_ns !== record.logTime) {
      fail(`${this.topic}, message ${index}: time_ns ${message.time_ns} of ${record.logTime}`);
    }
  }

  finish() {
    if (this.view) {
      if (this.messages === 0) fail(`${this.topic} has no messages`);
      console.log(`${this.topic}: ${this.messages} messages, as the images say`);
      return;
    }
    if (this.rows !== this.table.rows.length) fail(`${this.topic}: the table has more rows than messages`);
    if (this.compared === 0) fail(`${this.topic} has no messages`);
    console.log(`${this.topic}: ${this.messages} messages, ${this.compared} values as in the table`);
  }
}

const stream = new McapStreamReader({
  validateCrcs: true,
  decompressHandlers: await loadDecompressHandlers(),
});
stream.append(new Uint8Array(await readFile(path)));
const schemas = new Map();
const channels = new Map();
for (let record = stream.nextRecord(); record; record = stream.nextRecord()) {
  if (record.type === "Metadata") metadata.set(record.name, record.metadata);
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel" && !channels.has(record.id)) {
    channels.set(record.id, new Channel(record, schemas.get(record.schemaId)));
  }
  if (record.type === "Message") channels.get(record.channelId).take(record);
}
for (const channel of channels.values()) channel.finish();
for (const topic of tables.keys()) {
  if (![...channels.values()].some((one) => one.topic === topic)) fail(`there is no ${topic}`);
}
