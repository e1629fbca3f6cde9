// A table: the first line names its columns, with units in brackets as quadstep writes them; one column is the time.

import { count } from "../view/notation";
import { BadFile, type Log, MOST_NUMBERS, type Series, started } from "./log";

const CLOCKS: Readonly<Record<string, number>> = { s: 1, ms: 1e-3, us: 1e-6, "µs": 1e-6, ns: 1e-9 };
const TIMES = /^(t|time|timestamp|time_s|times|t_s)$/i;

export function readCsv(name: string, text: string): Log {
  const lines = text.replace(/^\ufeff/, "").split(/\r\n|\n|\r/).filter((line) => line.trim() && !line.startsWith("#"));
  const mark = (lines[0] ?? "").includes(";") ? ";" : (lines[0] ?? "").includes("\t") ? "\t" : ",";
  const header = (lines[0] ?? "").split(mark).map((entry) => entry.trim().replace(/^"(.*)"$/, "$1"));
  if (header.length < 2 || lines.length < 3) throw new BadFile(`${name}: it is not a table; the first line should name at least two columns, followed by rows`);
  if (header.length * lines.length > MOST_NUMBERS) throw new BadFile(`${name}: more than ${MOST_NUMBERS / 1e6} million numbers`);
  const columns = header.map((entry) => {
    const found = /^(.*?)\s*[[(](.*)[\])]$/.exec(entry);
    return { name: (found?.[1] ?? entry).trim(), unit: found?.[2] ?? "" };
  });
  const place = Math.max(columns.findIndex((column) => TIMES.test(column.name)), 0);
  const rows = columns.map(() => new Float64Array(lines.length - 1));
  for (let row = 1; row < lines.length; row++) {
    const entries = lines[row]!.split(mark);
    if (entries.length !== header.length) throw new BadFile(`${name}: line ${row + 1} has ${count(entries.length, "entry", "entries")}, but the first line has ${header.length}`);
    entries.forEach((entry, k) => (rows[k]![row - 1] = number(entry)));
  }
  const clock = rows[place]!.map((t) => t * (CLOCKS[columns[place]!.unit] ?? 1));
  const wrong = clock.findIndex((t, i) => !Number.isFinite(t) || (i > 0 && t < clock[i - 1]!));
  if (wrong >= 0) throw new BadFile(`${name}: line ${wrong + 2}: its time, column ${columns[place]!.name}, is not a number or is earlier than the one above`);
  const series = columns.flatMap((column, k): Series[] => (k === place ? [] : [{ ...column, times: clock, values: rows[k]! }]));
  return started(name, "CSV", series);
}

function number(entry: string): number {
  const text = entry.trim().replace(/^"(.*)"$/, "$1");
  if (/^true$/i.test(text)) return 1;
  if (/^false$/i.test(text)) return 0;
  return text === "" ? Number.NaN : Number(text);
}
