// A log that the reader brought: signals over time, each on its own clock, in seconds from the first of them.

import { Flight } from "../data/flight";

export interface Series {
  readonly name: string;
  readonly unit: string;
  readonly times: Float64Array;
  readonly values: Float64Array;
}

export interface Log {
  readonly name: string;
  /** What it was read as. */
  readonly kind: string;
  readonly series: readonly Series[];
}

/** A file that cannot be read; its message, file and reason, goes on from “Could not open”. */
export class BadFile extends Error {}

export const MOST_SERIES = 4000;
export const MOST_NUMBERS = 20_000_000;

/** Rows as they are collected, of a signal whose length nobody knows. */
export class Collected {
  private values = new Float64Array(256);
  length = 0;

  push(value: number): void {
    if (this.length === this.values.length) {
      const wider = new Float64Array(2 * this.length);
      wider.set(this.values);
      this.values = wider;
    }
    this.values[this.length++] = value;
  }

  done(): Float64Array {
    return this.values.slice(0, this.length);
  }
}

/** The log with its clock at zero; signals without two finite numbers are left out. Throws BadFile where none is left. */
export function started(name: string, kind: string, series: readonly Series[]): Log {
  const held = series.filter(({ times, values }) => times.length > 1 && values.some((value) => Number.isFinite(value)));
  if (!held.length) throw new BadFile(`${name}: ${kind} without a signal of at least two numbers`);
  let first = Infinity;
  for (const { times } of held) first = Math.min(first, times[0]!);
  const clocks = new Map<Float64Array, Float64Array>();
  const clock = (times: Float64Array): Float64Array => {
    const made = clocks.get(times) ?? times.map((t) => t - first);
    clocks.set(times, made);
    return made;
  };
  return { name, kind, series: held.map((one) => ({ ...one, times: clock(one.times) })) };
}

/** The path of a log as a flight, if it tells x, y and z. */
export function pathOfLog(log: Log): Flight | undefined {
  const axes = ["x", "y", "z"].map((axis) => log.series.find(({ name }) => name === axis));
  const [x, y, z] = axes;
  if (!x || !y || !z || x.times.length !== z.times.length || x.times.length !== y.times.length) return undefined;
  const table = new Float64Array(4 * x.times.length);
  x.times.forEach((t, row) => table.set([t, x.values[row]!, y.values[row]!, z.values[row]!], 4 * row));
  return new Flight(["t", "x", "y", "z"], ["s", "m", "m", "m"], table, "", x.times[x.times.length - 1]!);
}

/** Those signals of a log that have these names, as flights: one a clock. */
export function asFlights(log: Log, names: readonly string[]): Flight[] {
  const clocks = new Map<Float64Array, Series[]>();
  for (const one of log.series) if (names.includes(one.name)) clocks.set(one.times, [...(clocks.get(one.times) ?? []), one]);
  return [...clocks].map(([times, series]) => {
    const width = series.length + 1;
    const table = new Float64Array(width * times.length);
    times.forEach((t, row) => table.set([t, ...series.map(({ values }) => values[row]!)], width * row));
    return new Flight(["t", ...series.map(({ name }) => name)], ["s", ...series.map(({ unit }) => unit)], table, "", times[times.length - 1]!);
  });
}
