// A CANopen master that is not ours, npm canopen, at an emulated board: its data sheet, every object
// of it over SDO, what is refused, and a PDO. Frames go as lines "ID DATA" (hexadecimal) through
// standard output and input; the last line is "= JSON" with what was found.
//   node read_board.mjs SHEET.eds NODE
import Module, { createRequire } from "node:module";
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";

// The native package is for the checksum of block transfers alone, which our boards do not have.
const load = Module._load;
Module._load = (name, ...rest) => (name === "node-crc" ? { crc: () => 0 } : load(name, ...rest));
const { Device, Eds, DataType, AccessType } = createRequire(import.meta.url)("canopen");

const [path, id] = [process.argv[2], Number(process.argv[3])];
const sheet = Eds.fromFile(path), text = readFileSync(path, "latin1");
const master = new Device({ id: 127, eds: new Eds() });
const input = createInterface({ input: process.stdin });
master.on("message", ({ id: cob, data }) => {
  console.log(`${cob.toString(16)} ${data.toString("hex")}`);
});
input.on("line", (line) => {
  const [cob, data] = line.split(" ");
  master.receive({ id: parseInt(cob, 16), data: Buffer.from(data ?? "", "hex") });
});
master.eds.addSdoClientParameter(id, 0x600 + id, 0x580 + id);

const status = master.eds.addEntry(0x6041, {
  parameterName: "Statusword", dataType: DataType.UNSIGNED16 });
const position = master.eds.addEntry(0x6064, {
  parameterName: "Position", dataType: DataType.INTEGER32 });
master.eds.addReceivePdo({ cobId: 0x180 + id, dataObjects: [status, position] });
const states = [], emergencies = [];
master.eds.addHeartbeatConsumer(id, 60000);
master.eds.addEmcyConsumer(0x80 + id);
master.nmt.on("heartbeat", ({ state }) => states.push(state));
master.emcy.on("emergency", ({ em }) => emergencies.push(em.code));

const where = (index, subIndex) => ({ deviceId: id, index, subIndex, timeout: 60000 });
const upload = (index, subIndex, dataType) =>
  master.sdo.upload({ ...where(index, subIndex), dataType });
const download = (index, subIndex, dataType, data) =>
  master.sdo.download({ ...where(index, subIndex), dataType, data });
/// The abort code of what has to be refused; 0 when it is not.
const refused = (transfer) => transfer.then(() => 0, (error) => error.code);

/// Reads what the sheet lists. The library lists sub-indices that are not in it, and counts the
/// entries of a list itself (sub 0 of 1003, 16xx, 1Axx): the sections are the file's own. Measured
/// values are not those of the sheet.
/// @return objects read, and what is not as the sheet has it
async function read_all() {
  let read = 0;
  const wrong = [];
  for (const [, key, sub] of text.matchAll(/^\[([0-9A-F]{4})(?:sub([0-9A-F]+))?\]/gm)) {
    const [index, subIndex] = [parseInt(key, 16), parseInt(sub ?? "0", 16)];
    const entry = sheet.getEntry(index);
    if (sub === undefined && entry.subNumber) continue;  // its sub-indices have their own sections
    const object = sub === undefined ? entry : sheet.getSubEntry(index, subIndex);
    const name = `${key}:${subIndex}`;
    try {
      const raw = await upload(index, subIndex);
      ++read;
      if (object.dataType === DataType.VISIBLE_STRING) {
        if (raw.toString() !== object.value) wrong.push(`${name} is '${raw}'`);
        continue;
      }
      if (raw.length !== object.size) wrong.push(`${name} has ${raw.length} bytes`);
      const measured = object.accessType === AccessType.READ_ONLY && object.pdoMapping;
      const counted = subIndex === 0 && /^1(003|6|A)/.test(key);
      if (!measured && !counted && !raw.equals(object.raw)) {
        wrong.push(`${name} is ${raw.toString("hex")}, not ${object.raw.toString("hex")}`);
      }
    } catch (error) {
      wrong.push(`${name}: abort ${error.code?.toString(16) ?? error}`);
    }
  }
  return { read, wrong };
}

/// Status and position by TPDO 1, at a SYNC; heartbeats beside it.
async function exchange() {
  const U8 = DataType.UNSIGNED8, U32 = DataType.UNSIGNED32;
  await download(0x1800, 1, U32, 0xc0000180 + id);
  await download(0x1a00, 0, U8, 0);
  await download(0x1a00, 1, U32, 0x60410010);
  await download(0x1a00, 2, U32, 0x60640020);
  await download(0x1a00, 0, U8, 2);
  await download(0x1800, 2, U8, 1);
  await download(0x1800, 1, U32, 0x40000180 + id);
  master.nmt.startNode(0);  // all, and itself: else it takes no PDO
  const answer = new Promise((resolve) => master.pdo.once("pdo", resolve));
  const operational = new Promise((resolve) => {
    master.nmt.on("heartbeat", ({ state }) => state === 5 && resolve());
  });
  for (let sync = 0; sync < 10; ++sync) console.log("80 ");
  await Promise.all([answer, operational]);
  return { statusword: status.value, position: position.value };
}

setTimeout(() => process.exit(1), 60000);  // the board does not answer
master.start();
const U8 = DataType.UNSIGNED8, U16 = DataType.UNSIGNED16, U32 = DataType.UNSIGNED32;
const result = { name: await upload(0x1008, 0, DataType.VISIBLE_STRING) };
Object.assign(result, await read_all());
result.refused = [
  await refused(upload(0x7000, 0)),
  await refused(upload(0x1018, 9)),
  await refused(upload(0x1003, 1)),
  await refused(download(0x1018, 1, U32, 1)),
  await refused(download(0x1017, 0, U32, 1)),
  await refused(download(0x607d, 1, U16, 1)),
  await refused(download(0x1800, 1, U32, 0x40000000)),
  await refused(download(0x605d, 0, U16, 3)),
  await refused(download(0x1a00, 1, U32, 0x60400010)),
];
await download(0x1017, 0, U16, 5);
result.heartbeat = await upload(0x1017, 0, U16);
await download(0x607d, 2, DataType.INTEGER32, 123456);
result.limit = await upload(0x607d, 2, DataType.INTEGER32);
Object.assign(result, await exchange());
result.states = states;
result.emergencies = emergencies;
console.log(`= ${JSON.stringify(result)}`);
process.exit(0);
