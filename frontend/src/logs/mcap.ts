// MCAP (mcap.dev/spec): messages in JSON, in chunks that are not compressed. Other encodings are counted and named.

import { BadFile, Collected, type Log, MOST_NUMBERS, MOST_SERIES, type Series, started } from "./log";

const MAGIC = 8;
const [SCHEMA_END, CHANNEL, MESSAGE, CHUNK] = [0x0f, 0x04, 0x05, 0x06] as const;
const DEEPEST = 6;

interface Channel {
  readonly topic: string;
  readonly json: boolean;
  readonly times: Collected;
  readonly values: Map<string, Collected>;
}

export function readMcap(name: string, buffer: ArrayBuffer): Log {
  const view = new DataView(buffer);
  const text = new TextDecoder();
  const channels = new Map<number, Channel>();
  const unread = new Set<string>();
  let numbers = 0;

  const string = (at: number): [string, number] => {
    const length = view.getUint32(at, true);
    return [text.decode(new Uint8Array(buffer, at + 4, length)), at + 4 + length];
  };
  const message = (at: number, end: number): void => {
    const channel = channels.get(view.getUint16(at, true));
    if (!channel?.json) return;
    const time = Number(view.getBigUint64(at + 6, true)) * 1e-9;
    const found = new Map<string, number>();
    flatten(JSON.parse(text.decode(new Uint8Array(buffer, at + 22, end - at - 22))), "", found, DEEPEST);
    const row = channel.times.length;
    channel.times.push(time);
    for (const [key, value] of found) {
      let column = channel.values.get(key);
      if (!column) channel.values.set(key, (column = new Collected()));
      while (column.length < row) column.push(Number.NaN);
      column.push(value);
      if (++numbers > MOST_NUMBERS) throw new BadFile(`${name}: more than ${MOST_NUMBERS / 1e6} million numbers`);
    }
  };
  const records = (from: number, to: number): void => {
    for (let at = from; at + 9 <= to; ) {
      const kind = view.getUint8(at);
      const body = at + 9;
      const end = body + Number(view.getBigUint64(at + 1, true));
      if (end > to) throw new BadFile(`${name}: the MCAP file ends within a record`);
      if (kind === CHANNEL) {
        const [topic, next] = string(body + 4);
        const [encoding] = string(next);
        if (encoding !== "json") unread.add(encoding || "unnamed");
        channels.set(view.getUint16(body, true), { topic: topic.replace(/^\//, "").replaceAll("/", "."), json: encoding === "json", times: new Collected(), values: new Map() });
      } else if (kind === MESSAGE) message(body, end);
      else if (kind === CHUNK) {
        const [compression, next] = string(body + 28);
        if (compression) unread.add(`${compression} compression`);
        else records(next + 8, end);
      } else if (kind === SCHEMA_END) return;
      at = end;
    }
  };
  try {
    records(MAGIC, buffer.byteLength);
  } catch (error) {
    if (error instanceof BadFile) throw error;
    throw new BadFile(`${name}: the MCAP file is damaged`);
  }
  const series = [...channels.values()].flatMap(({ topic, times, values }): Series[] => {
    const clock = times.done();
    return [...values].map(([key, column]) => {
      while (column.length < clock.length) column.push(Number.NaN);
      return { name: `${topic}.${key}`, unit: "", times: clock, values: column.done() };
    });
  });
  if (!series.length && unread.size) throw new BadFile(`${name}: the MCAP file contains ${[...unread].join(", ")}; the page reads JSON messages in uncompressed chunks`);
  if (series.length > MOST_SERIES) throw new BadFile(`${name}: more than ${MOST_SERIES} signals`);
  return started(name, "MCAP", series);
}

/** The numbers of a message by dotted name. */
function flatten(value: unknown, name: string, found: Map<string, number>, deeper: number): void {
  if (typeof value === "number" || typeof value === "boolean") found.set(name, Number(value));
  else if (Array.isArray(value)) {
    if (deeper && value.length <= 16) value.forEach((one, i) => flatten(one, `${name}[${i}]`, found, deeper - 1));
  } else if (typeof value === "object" && value !== null && deeper) {
    for (const [key, one] of Object.entries(value)) flatten(one, name ? `${name}.${key}` : key, found, deeper - 1);
  }
}
