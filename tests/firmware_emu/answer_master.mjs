// A drive that is not ours at our master: npm canopen's device by its data sheet, which serves NMT,
// SDO, heartbeats and PDOs, before a CiA 402 machine whose motor is where it is told to be. The
// library sends no boot-up message; that is added here. Frames go as lines "ID DATA" (hexadecimal)
// through standard input and output; a line "." ends the frames of a cycle, either way.
//   node answer_master.mjs SHEET.eds NODE
import Module, { createRequire } from "node:module";
import { createInterface } from "node:readline";

// The native package is for the checksum of block transfers alone.
const load = Module._load;
Module._load = (name, ...rest) => (name === "node-crc" ? { crc: () => 0 } : load(name, ...rest));
const { DataType, Device, Eds } = createRequire(import.meta.url)("canopen");

const [path, id] = [process.argv[2], Number(process.argv[3])];
let drive;
const object = (index) => drive.eds.getEntry(index);

/// As after power-on: a reset of the library's own loses objects.
function power_on() {
  drive?.stop();
  const sheet = Eds.fromFile(path);
  // A sheet may leave its default server (1200) out; the library then has none.
  if (sheet.getEntry(0x1200) === undefined) {
    sheet.addSdoServerParameter(0, 0x580 + id, 0x600 + id);
  }
  if (sheet.getEntry(0x1005) === undefined) {  // the same of SYNC's identifier
    sheet.addEntry(0x1005, { parameterName: "SYNC", dataType: DataType.UNSIGNED32 }).value = 0x80;
  }
  drive = new Device({ id, eds: sheet });
  drive.on("message", ({ id: cob, data }) => {
    console.log(`${cob.toString(16)} ${data.toString("hex")}`);
  });
  drive.start();
  drive.nmt.send(0x700 + id, Buffer.from([0]));
}

// Statusword of each state, and what controlwords lead to.
const words = { disabled: 0x0250, ready: 0x0231, on: 0x0233, enabled: 0x0237 };
let state = "disabled";

function run() {
  const control = object(0x6040).value;
  const command = control & 0x0f;
  const quickStop = (control & 0x06) === 0x02;  // at once at rest, then disabled
  if ((control & 0x02) === 0 || quickStop) state = "disabled";
  else if (command === 0x06) state = "ready";
  else if (command === 0x07 && state !== "disabled") state = "on";
  else if (command === 0x0f && state !== "disabled" && state !== "ready") state = "enabled";
  object(0x6061).value = object(0x6060).value;
  if (state === "enabled" && object(0x6060).value === 8) {
    object(0x6064).value = object(0x607a).value;
  }
  object(0x6041).value = words[state];
}

process.stdout.on("error", () => process.exit());  // the master is gone
createInterface({ input: process.stdin }).on("line", (line) => {
  if (line === ".") {
    run();
    setImmediate(() => console.log("."));
    return;
  }
  const [cob, text] = line.split(" ");
  const frame = { id: parseInt(cob, 16), data: Buffer.from(text ?? "", "hex") };
  const resets = frame.id === 0 && frame.data[0] === 0x81 && [0, id].includes(frame.data[1]);
  if (resets) power_on();
  else drive.receive(frame);
});
power_on();
