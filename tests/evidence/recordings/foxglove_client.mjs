// SPDX-License-Identifier: Apache-2.0
// Watches a run by Foxglove's own client until it ends, and decodes each message by the schema that was advertised.
//   node foxglove_client.mjs WS_ADDRESS
// Prints the number of messages of each topic.
import WebSocket from 'ws';
import client from '@foxglove/ws-protocol';
import protobuf from 'protobufjs';
import 'protobufjs/ext/descriptor.js';

const { FoxgloveClient } = client;
const counts = {};
const decoders = new Map();
let wrong = 0;
const socket = new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const foxglove = new FoxgloveClient({ ws: socket });
foxglove.on('serverInfo', (info) => console.log(`server ${info.name}`));
foxglove.on('status', (status) => console.log(`status ${status.level} ${status.message}`));
foxglove.on('advertise', (channels) => {
  for (const channel of channels) {
    const bytes = channel.encoding === 'protobuf' ? Buffer.from(channel.schema, 'base64') : undefined;
    const type = bytes && protobuf.Root.fromDescriptor(bytes).lookupType(channel.schemaName);
    const decode = type ? (data) => type.decode(data) : (data) => JSON.parse(new TextDecoder().decode(data));
    decoders.set(foxglove.subscribe(channel.id), [channel.topic, decode]);
  }
});
foxglove.on('message', ({ subscriptionId, data }) => {
  const [topic, decode] = decoders.get(subscriptionId);
  counts[topic] = (counts[topic] ?? 0) + 1;
  try {
    decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
  } catch {
    wrong += 1;
  }
});
socket.on('close', () => {
  for (const [topic, count] of Object.entries(counts).sort()) console.log(`${topic} ${count}`);
  console.log(`not_decoded ${wrong}`);
  process.exit(0);
});
socket.on('error', (error) => {
  console.log(`error ${error.message}`);
  process.exit(1);
});
