// The page's own data and laws, as Python left them in it.

import type { LawCode, PageData } from "./contract";
import { run } from "../view/dom";
import { doubles } from "./packed";
import { runner } from "./webassembly";

declare global {
  /** Laws, each as text until it flies: a page has many, and reading all of them takes longer than its first flight should wait. */
  var quadstepLaws: Record<string, LawCode | string> | undefined;
  /** The same for WebAssembly, which a page may lack, and a browser: it flies them in half the time. */
  var quadstepModules: Record<string, string> | undefined;
}

const EMPTY: PageData = {
  format: 1,
  version: "",
  title: "quadstep",
  intro: [],
  links: [],
  laws: {},
  presets: {},
  tables: {},
  outcomes: [],
  rules: [],
  left: ["", "", ""],
  flights: [],
  claims: [],
  story: null,
};

/** The data, or an empty page if there is none. Throws if the data is of a format that this page does not read. */
export function readPage(): PageData {
  const text = document.getElementById("quadstep-data")?.textContent ?? "{}";
  const read = JSON.parse(text) as Partial<PageData> & { shared?: unknown[] };
  if (read.format !== undefined && read.format !== 1) throw new Error(`data of format ${String(read.format)}; this page reads format 1`);
  const { shared = [], ...rest } = read;
  return { ...EMPTY, ...(resolve(rest, shared) as Partial<PageData>) };
}

/** The value with what { "$": n } stands for in its place, everywhere in it. */
function resolve(value: unknown, shared: readonly unknown[]): unknown {
  if (typeof value !== "object" || value === null) return value;
  if ("$" in value) return shared[Number(value.$)];
  const parts = value as Record<string, unknown>;
  for (const key in parts) if (typeof parts[key] === "object") parts[key] = resolve(parts[key], shared);
  return parts;
}

/** A compiled law, if the page has it. */
export function lawCode(id: string): LawCode | undefined {
  const { quadstepLaws: laws, quadstepModules: modules } = globalThis;
  if (!laws || !Object.hasOwn(laws, id)) return undefined;
  if (typeof laws[id] === "string") {
    run(`quadstepLaws[${JSON.stringify(id)}]=${laws[id]}`);
    const module = modules?.[id];
    if (module) (laws as Record<string, LawCode>)[id]!.run = runner(module);
  }
  return laws[id] as LawCode;
}

const unpacked = new Map<string, Float64Array>();

/** Numbers unpacked once; key tells them from others. */
export function unpack(key: string, packed: string | undefined): Float64Array {
  let found = unpacked.get(key);
  if (!found) unpacked.set(key, (found = doubles(packed ?? "")));
  return found;
}
