// Laws as WebAssembly. Its memory: the stack, which grows down to what the module itself holds, then the buffers of a flight.

import type { LawCode } from "./contract";
import { bytes } from "./packed";

const STACK = 1 << 21; // bytes
const PAGE = 1 << 16;

/** undefined where a browser has no WebAssembly, or is told to run none. */
export function compiled(module: string): WebAssembly.Module | undefined {
  try {
    return new WebAssembly.Module(bytes(module));
  } catch {
    return undefined;
  }
}

/** What a module that exports `fly` does in place of a law in JavaScript; undefined as `compiled`. */
export function runner(module: string): LawCode["run"] {
  const code = compiled(module);
  if (!code) return undefined;
  const memory = new WebAssembly.Memory({ initial: STACK / PAGE });
  const stack = new WebAssembly.Global({ value: "i32", mutable: true }, STACK);
  const { exports } = new WebAssembly.Instance(code, { env: { __linear_memory: memory, __stack_pointer: stack } });
  const fly = exports["fly"] as (...given: (bigint | number)[]) => void;
  return (parameters, tables, start, { step, every, log, last }, rows) => {
    let end = STACK;
    const room = (count: number): number => (end += 8 * count) - 8 * count;
    const sizes = [every.length, parameters.length, ...tables.map((table) => table.length), start.length, rows.length, 2];
    const at = sizes.map(room);
    const lacking = end - memory.buffer.byteLength;
    if (lacking > 0) memory.grow(Math.ceil(lacking / PAGE));
    new BigInt64Array(memory.buffer, at[0], every.length).set(every.map(BigInt));
    [parameters, ...tables, start].forEach((values, i) => new Float64Array(memory.buffer, at[i + 1], values.length).set(values));
    const [atStart, atRows, atOutcome] = at.slice(-3);
    fly(BigInt(last), BigInt(log), step, at[0]!, at[1]!, at[2]!, atStart!, atRows!, atOutcome!); // tables stand one after the other
    rows.set(new Float64Array(memory.buffer, atRows, rows.length));
    const [code, tick] = new Float64Array(memory.buffer, atOutcome, 2);
    return [code!, tick!];
  };
}
