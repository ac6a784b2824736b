// SPDX-License-Identifier: Apache-2.0
// Reads an exported run by @mcap/core through its index, decodes each message by the file's own schemas, and compares the
// schemas with those that Foxglove publishes and the images with the run's files.
//   node check_mcap.mjs FILE.mcap RUN_FOLDER
// Prints lines NAME VALUE.
import { createHash } from 'node:crypto';
import { open, readFile } from 'node:fs/promises';
import { McapIndexedReader } from '@mcap/core';
import { FileHandleReadable } from '@mcap/nodejs';
import zstd from '@foxglove/wasm-zstd';
import protobuf from 'protobufjs';
import 'protobufjs/ext/descriptor.js';
import * as published from '@foxglove/schemas/internal.js';

const [, , file, run] = process.argv;
await zstd.isLoaded;
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(await open(file)),
  decompressHandlers: { zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) },
});
console.log('chunks', reader.chunkIndexes.length);
console.log('messages_counted', Number(reader.statistics.messageCount));

// The fields of a type as text: name, number and type, whatever the order of its files.
function fieldsOf(type) {
  return type.fieldsArray.map((f) => `${f.name} ${f.id} ${f.type.replace(/^.*\./, '')} ${f.repeated}`).sort().join('\n');
}
function publishedType(name) {
  const { generateProto, foxgloveMessageSchemas, foxgloveEnumSchemas } = published.default ?? published;
  const enums = Object.values(foxgloveEnumSchemas).filter((e) => e.parentSchemaName === name);
  const text = generateProto(foxgloveMessageSchemas[name], enums);
  return protobuf.parse(text, { keepCase: true }).root.lookupType(`foxglove.${name}`);
}

const decoders = new Map();
let known = 0;
let differing = 0;
const seen = new Set();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  if (channel.messageEncoding === 'json') {
    decoders.set(channel.id, (bytes) => JSON.parse(new TextDecoder().decode(bytes)));
    continue;
  }
  const root = protobuf.Root.fromDescriptor(schema.data);
  const type = root.lookupType(schema.name);
  decoders.set(channel.id, (bytes) => type.decode(bytes));
  // The type, and all types that it uses.
  for (const one of root.lookup('foxglove').nestedArray.filter((t) => t instanceof protobuf.Type)) {
    if (seen.has(one.name)) continue;
    seen.add(one.name);
    known += 1;
    if (fieldsOf(one) !== fieldsOf(publishedType(one.name))) {
      differing += 1;
      console.error(`${one.name}:\n${fieldsOf(one)}\n--- published:\n${fieldsOf(publishedType(one.name))}`);
    }
  }
}
console.log('types_compared', known);
console.log('types_that_differ', differing);

const counts = {};
let images = 0;
const frames = { '/lower/image': 0, '/upper/image': 0 };
for await (const message of reader.readMessages()) {
  const topic = reader.channelsById.get(message.channelId).topic;
  counts[topic] = (counts[topic] ?? 0) + 1;
  const content = decoders.get(message.channelId)(message.data);
  if (!(topic in frames)) continue;
  const name = `${run}${topic.replace('image', '')}${String(frames[topic]).padStart(6, '0')}.png`;
  frames[topic] += 1;
  const same = createHash('sha256').update(content.data).digest('hex') ===
    createHash('sha256').update(await readFile(name)).digest('hex');
  if (same) images += 1;
}
console.log('messages_read', Object.values(counts).reduce((a, b) => a + b, 0));
console.log('images_equal', images);
console.log('topics', Object.entries(counts).map(([topic, count]) => `${topic} ${count}`).join(', '));
