// Prints every message of MCAP files as topic and hex bytes, by @mcap/core: by their indexes, then as streams. Those of the
// streams are decoded as Foxglove decodes them; one that cannot be is an error.
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { open } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const decompressHandlers = await loadDecompressHandlers();
const lines = [];
const text = (data) => new TextDecoder().decode(data);
const print = (how, topic, message) => lines.push(`${how} ${topic} ${Buffer.from(message.data).toString("hex")}`);

async function readIndexed(file) {
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      await file.read(buffer, 0, Number(length), Number(offset));
      return buffer;
    },
  };
  let reader;
  try {
    reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  } catch (error) {
    console.error(`${error}`);
    return;
  }
  for await (const message of reader.readMessages()) {
    print("indexed", reader.channelsById.get(message.channelId).topic, message);
  }
}

async function readStream(file) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const decoders = new Map();
  const channels = new Map();
  reader.append(await file.readFile());
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") decoders.set(record.id, new MessageReader(parse(text(record.data), { ros2: true })));
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    decoders.get(channel.schemaId).readMessage(record.data);
    print("stream", channel.topic, record);
  }
}

for (const path of process.argv.slice(2)) {
  const file = await open(path);
  await readIndexed(file);
  await readStream(file);
  await file.close();
}
console.log(lines.join("\n"));
