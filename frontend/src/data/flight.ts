// A flight as flown: columns of numbers over time, and how it ended.

import { indexAt } from "../plots/curve";

export class Flight {
  readonly times: Float64Array;
  private readonly found = new Map<string, Float64Array>();

  /** `table` holds the rows one after the other. why: how it diverged, "" if it did not. ended: when it did [s]. */
  constructor(
    readonly names: readonly string[],
    readonly units: readonly string[],
    readonly table: Float64Array,
    readonly why: string,
    readonly ended: number,
  ) {
    this.times = this.column("t") ?? new Float64Array();
  }

  get rows(): number {
    return this.names.length ? this.table.length / this.names.length : 0;
  }

  /** Time of the last row [s]. */
  get last(): number {
    return this.times.length ? this.times[this.times.length - 1]! : 0;
  }

  get held(): boolean {
    return this.why === "";
  }

  has(...names: string[]): boolean {
    return names.every((name) => this.names.includes(name));
  }

  /** One column by name, made once. */
  column(name: string): Float64Array | undefined {
    const made = this.found.get(name);
    if (made) return made;
    const index = this.names.indexOf(name);
    if (index < 0) return undefined;
    const width = this.names.length;
    const column = new Float64Array(this.table.length / width);
    for (let row = 0, at = index; row < column.length; row++, at += width) column[row] = this.table[at]!;
    this.found.set(name, column);
    return column;
  }

  unit(name: string): string {
    return this.units[this.names.indexOf(name)] ?? "";
  }

  /** What a column is at time t, straight between rows; held after the last one. NaN if there is no such column. */
  at(name: string, t: number): number {
    const column = this.column(name);
    if (!column?.length) return Number.NaN;
    const i = indexAt(this.times, t);
    const t0 = this.times[i]!;
    const t1 = this.times[i + 1];
    const here = column[i]!;
    if (t1 === undefined || t <= t0) return here;
    return here + ((column[i + 1]! - here) * (t - t0)) / (t1 - t0);
  }
}

/** An angle [rad] that goes on where it jumped by a turn; itself if it never does. */
export function unwrapped(angle: Float64Array): Float64Array {
  let turns = 0;
  let made: Float64Array | undefined;
  for (let i = 1; i < angle.length; i++) {
    const step = angle[i]! - angle[i - 1]!;
    if (Math.abs(step) > Math.PI) {
      turns -= Math.round(step / (2 * Math.PI));
      made ??= angle.slice();
    }
    if (made) made[i] = angle[i]! + turns * 2 * Math.PI;
  }
  return made ?? angle;
}

/** A difference of angles [rad] less whole turns, as quadstep/metrics/quantities.py, shorter_way. */
export function shorterWay(turned: number): number {
  return turned - 2 * Math.PI * Math.floor(turned / (2 * Math.PI) + 0.5);
}

/** The difference of two columns, row by row. */
export function difference(a: Float64Array, b: Float64Array): Float64Array {
  return a.map((value, i) => value - b[i]!);
}
