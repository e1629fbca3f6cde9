// A file that was dropped on the page, told by its first bytes.

import { readCsv } from "./csv";
import { BadFile, type Log } from "./log";
import { readMcap } from "./mcap";
import { readUlog } from "./ulog";

const MOST_BYTES = 300e6;
const ULOG = [0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35];
const MCAP = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];

/** Throws BadFile. */
export function readLog(name: string, buffer: ArrayBuffer): Log {
  const short = name.length > 60 ? `${name.slice(0, 59)}…` : name;
  if (buffer.byteLength > MOST_BYTES) throw new BadFile(`${short}: larger than ${MOST_BYTES / 1e6} MB`);
  const bytes = new Uint8Array(buffer);
  const begins = (magic: readonly number[]): boolean => magic.every((byte, i) => bytes[i] === byte);
  if (begins(ULOG)) return readUlog(short, buffer);
  if (begins(MCAP)) return readMcap(short, buffer);
  if (bytes.subarray(0, 4096).includes(0)) throw new BadFile(`${short}: it is not a CSV, ULog or MCAP file${/\.(bin|bbl|bfl)$/i.test(name) ? "; “quadstep advise” reads it" : ""}`);
  return readCsv(short, new TextDecoder().decode(buffer));
}
