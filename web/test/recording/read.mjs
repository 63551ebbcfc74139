// Recordings by MCAP's own readers.
import { readFileSync } from 'node:fs';
import { open } from 'node:fs/promises';
import { createFileRegistry, fromBinary } from '@bufbuild/protobuf';
import { FileDescriptorSetSchema } from '@bufbuild/protobuf/wkt';
import { McapIndexedReader, McapStreamReader } from '@mcap/core';

/** Messages of one file, decoded by the schemas that it brings along. */
class Decoded {
  byTopic = new Map();
  lastNs = 0n;
  #types = new Map();
  add(channel, schema, message) {
    if (!this.#types.has(channel.id)) {
      const files = createFileRegistry(fromBinary(FileDescriptorSetSchema, schema.data));
      this.#types.set(channel.id, files.getMessage(schema.name));
    }
    const value = fromBinary(this.#types.get(channel.id), message.data);
    if (!this.byTopic.has(channel.topic)) this.byTopic.set(channel.topic, []);
    this.byTopic.get(channel.topic).push({ logNs: message.logTime, value });
    if (message.logTime > this.lastNs) this.lastNs = message.logTime;
  }
  of(topic) {
    return this.byTopic.get(topic) ?? [];
  }
}

export async function readWhole(file) {
  const handle = await open(file);
  const { size } = await handle.stat();
  const readable = {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      await handle.read(buffer, 0, Number(length), Number(offset));
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  const decoded = new Decoded();
  let messages = 0n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    decoded.add(channel, reader.schemasById.get(channel.schemaId), message);
    ++messages;
  }
  decoded.counted = messages === reader.statistics.messageCount;
  decoded.metadata = [];
  for await (const each of reader.readMetadata()) decoded.metadata.push(each);
  // By the index: what is read of the last second begins there.
  const seekNs = reader.statistics.messageEndTime - 1_000_000_000n;
  const begin = performance.now();
  for await (const message of reader.readMessages({
    startTime: seekNs,
    topics: ['/camera/video'],
  })) {
    decoded.soughtNs = message.logTime - seekNs;
    break;
  }
  decoded.soughtMs = performance.now() - begin;
  await handle.close();
  return decoded;
}

/** As far as it goes. */
export function readCut(file) {
  const reader = new McapStreamReader({ validateCrcs: true });
  const decoded = new Decoded();
  const channels = new Map();
  const schemas = new Map();
  reader.append(readFileSync(file));
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    if (record.type === 'Schema') schemas.set(record.id, record);
    if (record.type === 'Channel') channels.set(record.id, record);
    if (record.type !== 'Message') continue;
    const channel = channels.get(record.channelId);
    decoded.add(channel, schemas.get(channel.schemaId), record);
  }
  decoded.ended = reader.done();
  return decoded;
}
