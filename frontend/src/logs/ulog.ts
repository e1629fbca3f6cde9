// PX4's ULog (docs.px4.io, "ULog File Format"): the first instance of each topic, number fields and short arrays of numbers.

import { BadFile, Collected, type Log, MOST_NUMBERS, MOST_SERIES, type Series, started } from "./log";

const HEAD = 16;
const LONGEST_ARRAY = 16;

type Read = (view: DataView, at: number) => number;

const TYPES: Readonly<Record<string, readonly [size: number, read: Read]>> = {
  int8_t: [1, (v, at) => v.getInt8(at)],
  uint8_t: [1, (v, at) => v.getUint8(at)],
  bool: [1, (v, at) => v.getUint8(at)],
  char: [1, (v, at) => v.getUint8(at)],
  int16_t: [2, (v, at) => v.getInt16(at, true)],
  uint16_t: [2, (v, at) => v.getUint16(at, true)],
  int32_t: [4, (v, at) => v.getInt32(at, true)],
  uint32_t: [4, (v, at) => v.getUint32(at, true)],
  int64_t: [8, (v, at) => Number(v.getBigInt64(at, true))],
  uint64_t: [8, (v, at) => Number(v.getBigUint64(at, true))],
  float: [4, (v, at) => v.getFloat32(at, true)],
  double: [8, (v, at) => v.getFloat64(at, true)],
};

interface Field {
  readonly name: string;
  readonly offset: number;
  readonly read: Read;
}

interface Topic {
  readonly fields: readonly Field[];
  readonly stamp: Field;
  readonly size: number;
  readonly times: Collected;
  readonly values: readonly Collected[];
  readonly name: string;
}

export function readUlog(name: string, buffer: ArrayBuffer): Log {
  const view = new DataView(buffer);
  const text = new TextDecoder();
  const formats = new Map<string, string>();
  const topics = new Map<number, Topic>();
  let numbers = 0;
  for (let at = HEAD; at + 3 <= buffer.byteLength; ) {
    const size = view.getUint16(at, true);
    const kind = String.fromCharCode(view.getUint8(at + 2));
    const body = at + 3;
    at = body + size;
    if (at > buffer.byteLength) break; // power was cut while it was written
    if (kind === "F") {
      const [topic = "", fields = ""] = text.decode(new Uint8Array(buffer, body, size)).split(/:(.*)/s);
      formats.set(topic, fields);
    } else if (kind === "A" && size > 3 && view.getUint8(body) === 0) {
      const topic = text.decode(new Uint8Array(buffer, body + 3, size - 3));
      const made = laidOut(topic, formats);
      if (made) topics.set(view.getUint16(body + 1, true), made);
    } else if (kind === "D" && size >= 2) {
      const topic = topics.get(view.getUint16(body, true));
      if (!topic || size - 2 < topic.size) continue;
      numbers += topic.fields.length;
      if (numbers > MOST_NUMBERS) throw new BadFile(`${name}: more than ${MOST_NUMBERS / 1e6} million numbers`);
      topic.times.push(topic.stamp.read(view, body + 2 + topic.stamp.offset) * 1e-6);
      topic.fields.forEach((field, i) => topic.values[i]!.push(field.read(view, body + 2 + field.offset)));
    }
  }
  const series = [...topics.values()].flatMap((topic): Series[] => {
    const times = topic.times.done();
    return topic.fields.map((field, i) => ({ name: `${topic.name}.${field.name}`, unit: "", times, values: topic.values[i]!.done() }));
  });
  if (series.length > MOST_SERIES) throw new BadFile(`${name}: more than ${MOST_SERIES} signals`);
  return started(name, "ULog", [...upright(series), ...series]);
}

/** Where the numbers of a topic lie; undefined for one with messages within it. */
function laidOut(topic: string, formats: ReadonlyMap<string, string>): Topic | undefined {
  const fields: Field[] = [];
  let stamp: Field | undefined;
  let offset = 0;
  for (const entry of (formats.get(topic) ?? "").split(";").filter(Boolean)) {
    const found = /^(\w+)(?:\[(\d+)\])? (\w+)$/.exec(entry.trim());
    const type = found && Object.hasOwn(TYPES, found[1]!) ? TYPES[found[1]!] : undefined;
    if (!found || !type) return undefined;
    const [size, read] = type;
    const count = found[2] === undefined ? 1 : Number(found[2]);
    const name = found[3]!;
    if (name === "timestamp") stamp = { name, offset, read };
    else if (!name.startsWith("_padding") && found[1] !== "char" && count <= LONGEST_ARRAY) {
      for (let i = 0; i < count; i++) fields.push({ name: found[2] === undefined ? name : `${name}[${i}]`, offset: offset + i * size, read });
    }
    offset += size * count;
  }
  if (!stamp) return undefined;
  return { name: topic, fields, stamp, size: fields.reduce((most, field) => Math.max(most, field.offset + 1), 8), times: new Collected(), values: fields.map(() => new Collected()) };
}

/** PX4's position, north-east-down, as x, y, z with z up. */
function upright(series: readonly Series[]): Series[] {
  const signs = { x: 1, y: -1, z: -1, vx: 1, vy: -1, vz: -1 } as const;
  const names = { x: "x", y: "y", z: "z", vx: "x_dot", vy: "y_dot", vz: "z_dot" } as const;
  return Object.entries(signs).flatMap(([field, sign]) => {
    const found = series.find(({ name }) => name === `vehicle_local_position.${field}`);
    const key = field as keyof typeof names;
    return found ? [{ name: names[key], unit: field.length > 1 ? "m/s" : "m", times: found.times, values: found.values.map((value) => sign * value) }] : [];
  });
}
