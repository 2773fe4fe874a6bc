// Decodes samples with @foxglove/rosmsg2-serialization and checks every value by the rule of
// tests/dds/cdr_sample.hpp's pattern(): by ROS 2's published definitions where
// @foxglove/rosmsg-msgs-common has them, and by ours. Exits with 1 at the first disagreement.
//   node decode_samples.mjs FILE    a JSON text per line: {type, definition, published, cdr (hex)}
import { readFileSync } from "node:fs";
import { parse } from "@foxglove/rosmsg";
import common from "@foxglove/rosmsg-msgs-common";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const kSequenceElements = 2;
const withoutKind = (name) => name.replace("/msg/", "/");

/// A published type with all that it needs, the type first.
function published(name) {
  const found = new Map();
  const collect = (type) => {
    const definition = common.ros2jazzy[type];
    if (!definition || found.has(type)) return;
    found.set(type, definition);
    for (const field of definition.definitions) if (field.isComplex) collect(field.type);
  };
  collect(name);
  return [...found.values()];
}

function check(type, definitions, cdr) {
  const message = new MessageReader(definitions).readMessage(cdr);
  let n = 0;
  let leaves = 0;
  const agree = (where, value, expected) => {
    ++leaves;
    if (value !== expected) {
      console.error(`${type}: ${where} is ${value}, was sent as ${expected}`);
      process.exit(1);
    }
  };
  const leaf = (where, field, value) => {
    ++n;
    if (field.type === "time" || field.type === "duration") {
      agree(`${where}.sec`, value.sec, n);
      agree(`${where}.nanosec`, value.nsec ?? value.nanosec, ++n);
    } else if (field.type === "bool") agree(where, value, n % 2 === 1);
    else if (field.type === "string") agree(where, value, `s${n}`);
    else if (/^(u?int64)$/.test(field.type)) agree(where, value, BigInt(n));
    else if (/^float/.test(field.type)) agree(where, value, n / 4);
    else agree(where, value, n % 256 ** (Number(/\d+/.exec(field.type)?.[0] ?? 8) / 8));
  };
  const walk = (where, definition, values) => {
    for (const field of definition.definitions) {
      if (field.isConstant) continue;
      const name = `${where}.${field.name}`;
      const complex =
        field.isComplex && definitions.find((one) => withoutKind(one.name ?? "") === withoutKind(field.type));
      const one = (at, value) => (complex ? walk(at, complex, value) : leaf(at, field, value));
      const value = values[field.name];
      if (!field.isArray) {
        one(name, value);
        continue;
      }
      agree(`${name}.length`, value.length, field.arrayLength ?? kSequenceElements);
      for (let i = 0; i < value.length; ++i) one(`${name}[${i}]`, value[i]);
    }
  };
  walk(withoutKind(type), definitions[0], message);
  return leaves;
}

let types = 0;
let leaves = 0;
for (const line of readFileSync(process.argv[2], "utf8").split("\n").filter(Boolean)) {
  const sample = JSON.parse(line);
  const cdr = Buffer.from(sample.cdr, "hex");
  const theirs = published(withoutKind(sample.type));
  if (sample.published !== theirs.length > 0) {
    console.error(`${sample.type}: published definitions: ${theirs.length}`);
    process.exit(1);
  }
  if (theirs.length > 0) leaves += check(sample.type, theirs, cdr);
  leaves += check(sample.type, parse(sample.definition, { ros2: true }), cdr);
  ++types;
}
console.log(`${types} types, ${leaves} values, all as sent`);
