// Reads an MCAP file twice with @mcap/core, streamed and by its index, with every checksum
// checked, and exits with 1 at the first disagreement.
//   node validate_mcap.mjs FILE [EXPECTED_MESSAGES]
import { readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const [path, expected] = process.argv.slice(2);
const decompressHandlers = await loadDecompressHandlers();

function assert(condition, message) {
  if (condition) return;
  console.error(`${path}: ${message}`);
  process.exit(1);
}

const file = new Uint8Array(await readFile(path));

// Streamed: validates the CRC of each chunk and of the data section.
const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
stream.append(file);
const streamed = { Message: 0, Schema: 0, Channel: 0, Metadata: 0, Footer: 0, DataEnd: 0 };
const bytes = new Map();
for (let record = stream.nextRecord(); record; record = stream.nextRecord()) {
  streamed[record.type] = (streamed[record.type] ?? 0) + 1;
  if (record.type === "Message") {
    bytes.set(record.channelId, (bytes.get(record.channelId) ?? 0) + record.data.byteLength);
  }
}
assert(stream.done(), "the stream ends before its end");
assert(streamed.DataEnd === 1 && streamed.Footer === 1, "data end or footer is missing");

// By index: validates the summary's CRC, offsets and message indices.
const indexed = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(file.byteLength),
    read: async (offset, size) => file.subarray(Number(offset), Number(offset + size)),
  },
  decompressHandlers,
});
let last = -1n;
let messages = 0;
const indexedBytes = new Map();
for await (const message of indexed.readMessages({ validateCrcs: true })) {
  assert(message.logTime >= last, "messages by index are not in the order of time");
  last = message.logTime;
  ++messages;
  const id = message.channelId;
  indexedBytes.set(id, (indexedBytes.get(id) ?? 0) + message.data.byteLength);
}
assert(messages === streamed.Message, `${messages} by index, ${streamed.Message} streamed`);
for (const [id, size] of bytes) assert(indexedBytes.get(id) === size, `channel ${id} differs`);
assert(BigInt(messages) === indexed.statistics.messageCount, "the statistics count otherwise");
for (const [id, count] of indexed.statistics.channelMessageCounts) {
  assert(indexed.channelsById.has(id) && count > 0n, `channel ${id} of the statistics`);
}
let metadata = 0;
for await (const record of indexed.readMetadata()) metadata += record.name.length > 0 ? 1 : 0;
assert(metadata === streamed.Metadata, "the metadata index is not whole");
assert(expected === undefined || messages === Number(expected), `${messages} messages`);
console.log(`${path}: ${messages} messages, ${indexed.channelsById.size} channels, valid`);
