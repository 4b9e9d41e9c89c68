// Reads files with @mcap/core and prints what the test compares: a line of JSON for each.
import { open } from 'node:fs/promises';
import { McapIndexedReader } from '@mcap/core';
import { parse } from '@foxglove/rosmsg';
import { MessageReader } from '@foxglove/rosmsg2-serialization';
import { decompress } from 'fzstd';

const zstd = (data, length) => decompress(data, new Uint8Array(Number(length)));

for (const path of process.argv.slice(2)) {
  const file = await open(path, 'r');
  const { size } = await file.stat();
  const readable = {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      await file.read(buffer, 0, Number(length), Number(offset));
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: { zstd } });

  const counts = {};
  const stamps = [];
  const wrench = [];
  const decoders = new Map();
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
    if (!decoders.has(channel.id)) {
      const schema = reader.schemasById.get(channel.schemaId);
      const definition = parse(new TextDecoder().decode(schema.data), { ros2: true });
      decoders.set(channel.id, new MessageReader(definition));
    }
    const decoded = decoders.get(channel.id).readMessage(message.data);
    if (channel.topic === '/wrench') {
      const { force, torque } = decoded.wrench;
      wrench.push([force.x, force.y, force.z, torque.x, torque.y, torque.z]);
      stamps.push(Number(message.logTime));
    }
  }
  const attachments = [];
  for await (const attachment of reader.readAttachments()) {
    attachments.push(attachment.name);
  }
  console.log(JSON.stringify({ counts, stamps, wrench, attachments }));
  await file.close();
}
