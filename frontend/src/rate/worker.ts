// What a worker does: flies spans of flights with the module it was given. It is written out as text, so it uses nothing from outside.

export interface Setup {
  readonly module: WebAssembly.Module;
  readonly double: boolean;
  readonly flights: number;
  /** Numbers that all flights share. */
  readonly constants: number;
  /** Rows that a module writes. */
  readonly results: number;
  readonly step: number;
  readonly every: readonly number[];
  /** One row a varying number. */
  readonly columns: Float64Array;
  readonly tables: Float64Array;
}

export interface Job {
  readonly id: number;
  readonly constants: Float64Array;
  /** Its last tick. */
  readonly last: number;
  readonly first: number;
  readonly past: number;
}

export interface Done {
  readonly id: number;
  readonly first: number;
  readonly past: number;
  /** One row after the other, of these flights alone. */
  readonly rows: Float64Array;
}

export function work(): void {
  const STACK = 1 << 21; // bytes, from 0 on: what the module itself holds lies at their beginning
  const PAGE = 1 << 16;
  const scope = globalThis as unknown as { onmessage: (event: MessageEvent) => void; postMessage: (message: unknown) => void };
  let fly: ((job: Job) => Float64Array) | undefined;

  const prepare = ({ module, double, flights, constants: shared, results, step, every, columns, tables }: Setup): void => {
    const size = double ? 8 : 4;
    const width = 16 / size; // one vector
    const length = Math.ceil(flights / width) * width; // the last flight is repeated to fill up
    const Numbers = double ? Float64Array : Float32Array;
    const rows = Math.round(columns.length / flights);
    let end = STACK;
    const room = (bytes: number): number => {
      const at = end;
      end = (end + bytes + 63) & ~63;
      return at;
    };
    const [atEvery, atConstants, atColumns] = [room(8 * every.length), room(size * shared), room(size * rows * length)];
    const [atTables, atResults] = [room(size * tables.length), room(size * results * length)];
    const memory = new WebAssembly.Memory({ initial: Math.ceil(end / PAGE) });
    const stack = new WebAssembly.Global({ value: "i32", mutable: true }, STACK);
    const { exports } = new WebAssembly.Instance(module, { env: { __linear_memory: memory, __stack_pointer: stack } });
    const sweep = exports["sweep"] as (...given: (bigint | number)[]) => void;
    new BigInt64Array(memory.buffer, atEvery, every.length).set(every.map(BigInt));
    new Numbers(memory.buffer, atTables, tables.length).set(tables);
    const there = new Numbers(memory.buffer, atColumns, rows * length);
    for (let row = 0; row < rows; row++) {
      for (let i = 0; i < length; i++) there[row * length + i] = columns[row * flights + Math.min(i, flights - 1)]!;
    }
    const found = new Numbers(memory.buffer, atResults, results * length);
    fly = ({ constants, last, first, past }) => {
      new Numbers(memory.buffer, atConstants, shared).set(constants);
      const whole = Math.ceil((past - first) / width) * width;
      sweep(BigInt(first), BigInt(first + whole), BigInt(length), BigInt(last), step, atEvery, atConstants, atColumns, atTables, atResults);
      const taken = new Float64Array(results * (past - first));
      for (let row = 0; row < results; row++) taken.set(found.subarray(row * length + first, row * length + past), row * (past - first));
      return taken;
    };
  };

  scope.onmessage = ({ data }: MessageEvent<Setup | Job>) => {
    if ("module" in data) prepare(data);
    else if (fly) scope.postMessage({ id: data.id, first: data.first, past: data.past, rows: fly(data) } satisfies Done);
  };
}
