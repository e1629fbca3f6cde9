// What a flight was like, in the numbers that `quadstep fly` reports, to the bit: sums in NumPy's order, angles by the laws' own functions.

import type { FlightData, SummaryData } from "../data/contract";
import type { Inputs } from "../data/engine";
import { type Flight, difference, shorterWay } from "../data/flight";
import { lawCode } from "../data/page";

/** undefined: the flight does not tell. */
export interface Measures {
  /** Root of the mean square of the distance to the wanted position [m]. */
  readonly rmse: number | undefined;
  /** The greatest of these distances [m]. */
  readonly largest: number | undefined;
  /** The greatest angle between thrust and vertical [rad]. */
  readonly tilt: number | undefined;
  /** The greatest part of the rotors' full thrust that was used. */
  readonly share: number | undefined;
  /** The greatest thrust of all rotors together [N]. */
  readonly thrust: number | undefined;
  /** RMSE as a share of what it is measured against, see quadstep/metrics/quantities.py, error_against_path. */
  readonly relative: number | undefined;
  /** Whether its path is a point to hold or to step to. */
  readonly holds: boolean;
  /** RMS of the angle between yaw and the heading asked for [rad]. */
  readonly heading: number | undefined;
  /** How many times the error, and the angular rates, grow towards the end. */
  readonly growth: number | undefined;
  readonly rateGrowth: number | undefined;
  /** The greatest tilt after it was first within 90 degrees of upright [rad]. */
  readonly overturned: number | undefined;
  /** RMS swing of the thrust's axis, see quadstep/metrics/quantities.py, swings [rad]. */
  readonly shaking: number | undefined;
  /** The share of the rows at which the rotors were at their limits. */
  readonly saturated: number | undefined;
}

const ARMS = 10;
const ARM = 0.1;
const POINT = 1e-6;
const FAR = 30;
const RATE_SCALE = 1e3;
const SATURATED = 1e-3;
const FORCE = /^f\d+$/;

export function measure(flight: Flight, data: FlightData, given: Inputs | undefined): Measures {
  const largest = (forces: readonly Float64Array[]): number | undefined => (flight.rows > 1 && forces.length ? greatest(sums(forces)) : undefined);
  const [thrust, turning] = [largest(columns(flight, (name) => FORCE.test(name))), asTurning(flight)];
  const most = given?.parameters[given.names.get(data.summary.limit ?? "") ?? -1] ?? Number.NaN;
  const full = most * turning.length;
  const share = thrust !== undefined && Number.isFinite(full) && full > 0 ? largest(turning)! / full : undefined;
  const tilts = tiltOf(flight, given);
  const axes = axesOf(flight);
  const asked = accelerations(flight, axes);
  return {
    ...errors(flight, data.summary, axes, asked),
    heading: heading(flight, data.summary.since),
    tilt: tilts && greatest(tilts),
    overturned: tilts && overturned(tilts),
    rateGrowth: rates(flight, asked),
    shaking: shaking(flight, axes, asked),
    saturated: saturated(flight, data.summary, given),
    share,
    thrust,
  };
}

type Errors = Pick<Measures, "rmse" | "largest" | "relative" | "growth" | "holds">;

function errors(flight: Flight, { since, arm }: SummaryData, axes: readonly string[], asked: readonly Float64Array[]): Errors {
  const first = flight.times.findIndex((t) => t >= since);
  const none = { rmse: undefined, largest: undefined, relative: undefined, growth: undefined, holds: false };
  if (!axes.length || flight.rows < 2 || first < 0 || flight.last <= since) return none;
  const wanted = axes.map((axis) => flight.column(`${axis}_d`)!.subarray(first));
  const flown = axes.map((axis) => flight.column(axis)!);
  const distances = lengths(flown.map((values, i) => values.subarray(first).map((value, k) => wanted[i]![k]! - value)));
  const found = { rmse: rms(distances), largest: greatest(distances), holds: !moving(wanted) };
  const count = distances.length;
  if (count < 2) return { ...found, relative: undefined, growth: undefined };
  const arms = arm || ARM;
  const from = (places: readonly number[]): number => rms(lengths(wanted.map((values, i) => values.map((value) => value - places[i]!))).map((value) => Math.min(value, FAR)));
  const scale = found.holds ? ARMS * arms : Math.max(Math.min(from(flown.map((values) => values[0]!)), from(wanted.map((values) => values[0]!))), arms);
  const counted = found.holds ? distances.subarray(count >> 1) : distances;
  return { ...found, relative: scale > 0 ? rms(counted) / scale : undefined, growth: growth(distances, scale, lengths(asked).subarray(first)) };
}

/** Along which its position is asked for. */
function axesOf(flight: Flight): string[] {
  return flight.names.filter((name, i) => flight.units[i] === "m" && flight.has(`${name}_d`));
}

/** What the path asks for along each axis [m/s^2]; 0 in the first and the last row. */
function accelerations(flight: Flight, axes: readonly string[]): Float64Array[] {
  const rows = flight.rows;
  const step = (flight.times[rows - 1]! - flight.times[0]!) / (rows - 1);
  return axes.map((axis) => {
    const path = flight.column(`${axis}_d`)!;
    return path.map((value, k) => (k > 0 && k < rows - 1 ? (path[k + 1]! - 2 * value + path[k - 1]!) / (step * step) : 0));
  });
}

/** Whether a path moves: one that is a point or steps to one does not. */
function moving(wanted: readonly Float64Array[]): boolean {
  let steps = 0;
  for (let row = 1; row < wanted[0]!.length && steps < 2; row++) if (wanted.some((values) => values[row] !== values[row - 1])) steps++;
  return steps > 1 && wanted.some((values) => greatest(values) + greatest(values.map((value) => -value)) > POINT);
}

function rates(flight: Flight, asked: readonly Float64Array[]): number | undefined {
  const names = [["p", "q", "r"], ["psi_dot", "theta_dot", "phi_dot"]].find((some) => flight.has(...some));
  return names && flight.rows > 1 ? growth(lengths(names.map((name) => flight.column(name)!)), RATE_SCALE, lengths(asked)) : undefined;
}

const SWING = 0.25;
const GRAVITY = 9.81;

function shaking(flight: Flight, axes: readonly string[], accelerations: readonly Float64Array[]): number | undefined {
  const rows = flight.rows;
  if (rows < 2) return undefined;
  const span = flight.times[rows - 1]! - flight.times[0]!;
  const half = Math.floor((SWING * (rows - 1)) / span);
  const first = Math.max(rows >> 1, half);
  const axis = thrustAxis(flight);
  if (!axis || half < 2 || rows - half - first < 2 * half) return undefined;
  const level = ["x", "y"].map((name) => accelerations[axes.indexOf(name)]?.map((value) => value / GRAVITY));
  const asked = level.every(Boolean) ? (level as Float64Array[]) : axis.map(() => new Float64Array(rows));
  const [swung, twice] = [axis, asked].map((parts) => rms(lengths(parts.map((values) => fromMean(values, half).subarray(first - half)))));
  return Math.sqrt(Math.max(swung! * swung! - 2 * twice! * (2 * twice!), 0));
}

function thrustAxis(flight: Flight): Float64Array[] | undefined {
  if (flight.has("q_w", "q_x", "q_y", "q_z")) {
    const [w, x, y, z] = ["q_w", "q_x", "q_y", "q_z"].map((name) => flight.column(name)!) as [Float64Array, Float64Array, Float64Array, Float64Array];
    return [x.map((value, i) => 2 * (value * z[i]! + w[i]! * y[i]!)), y.map((value, i) => 2 * (value * z[i]! - w[i]! * x[i]!))];
  }
  return flight.has("theta", "phi") ? [flight.column("theta")!, flight.column("phi")!] : undefined;
}

/** Each value less the mean of itself and `half` before and after it; of those that have so many. */
function fromMean(values: Float64Array, half: number): Float64Array {
  const all = new Float64Array(values.length + 1);
  values.forEach((value, i) => (all[i + 1] = all[i]! + value));
  return values.subarray(half, values.length - half).map((value, i) => value - (all[i + 2 * half + 1]! - all[i]!) / (2 * half + 1));
}

const PARTS = 8;
const FLOOR = 1e-4;
const ENDS = 64;
const END_FLOOR = 5e-4;
const ASKED = 0.02;

/** See quadstep/metrics/reductions.py, late_growth. */
function growth(values: Float64Array, scale: number, asked: Float64Array): number {
  const count = values.length;
  if (count < PARTS) return 0;
  const edge = (part: number): number => Math.floor((count * part) / PARTS);
  const parts = [4, 5, 6, 7].map((part) => rms(values.subarray(edge(part), edge(part + 1))));
  const ratio = Math.min(...[0, 1, 2].map((i) => (parts[i]! > 0 ? parts[i + 1]! / parts[i]! : 1)));
  const steady = parts[3]! > FLOOR * scale ? ratio * ratio * ratio : 0;
  const cut = count - Math.max(1, Math.floor(count / ENDS));
  const [before, late, end] = [[alike(asked, edge(7)), edge(7)], [edge(7), cut], [cut, count]].map(([a, b]) => greatest(values.subarray(a, b)));
  return Math.max(steady, end! > late! ? end! / (Math.max(before!, END_FLOOR * scale) || Infinity) : 0);
}

/** The row from which on to the row `last` a flight is like its end. */
function alike(asked: Float64Array, last: number): number {
  const since = asked.reduce((found, value, row) => (value > ASKED ? row + 1 : found), 0);
  return since <= asked.length >> 1 ? (since + last) >> 1 : 0;
}

function heading(flight: Flight, since: number): number | undefined {
  const names = [["heading_d", "yaw"], ["psi_d", "psi"]].find((pair) => flight.has(...pair));
  if (!names || flight.rows < 2 || flight.last <= since) return undefined;
  const first = flight.times.findIndex((t) => t >= since);
  const [wanted, yaw] = names.map((name) => flight.column(name)!.subarray(first));
  return rms(difference(yaw!, wanted!).map(shorterWay));
}

function overturned(tilts: Float64Array): number {
  const upright = tilts.findIndex((tilt) => tilt <= 0.5 * Math.PI);
  return greatest(tilts.subarray(Math.max(upright, 0)));
}

function saturated(flight: Flight, { limit, least }: SummaryData, given: Inputs | undefined): number | undefined {
  const asked = ["u", "tau_x", "tau_y", "tau_z"];
  if (flight.rows < 2) return undefined;
  if (flight.has(...asked, ...asked.map((name) => `${name}_a`))) {
    const scale = pairwise(flight.column("u")!.map(Math.abs)) / flight.rows;
    const pairs = asked.map((name, i) => [flight.column(name)!, flight.column(`${name}_a`)!, SATURATED * (i ? 0.1 * scale : scale)] as const);
    return share(flight.rows, (row) => pairs.some(([wanted, made, most]) => Math.abs(wanted[row]! - made[row]!) > most));
  }
  const number = (name: string | null): number => given?.parameters[given.names.get(name ?? "") ?? -1] ?? Number.NaN;
  const [low, high] = [number(least), number(limit)];
  if (!Number.isFinite(high)) return undefined;
  const forces = asTurning(flight);
  const tolerance = 1e-9 * high;
  return share(flight.rows, (row) => forces.some((force) => force[row]! <= low + tolerance || force[row]! >= high - tolerance));
}

/** Of the rows that are so. */
function share(rows: number, is: (row: number) => boolean): number {
  let count = 0;
  for (let row = 0; row < rows; row++) if (is(row)) count++;
  return count / rows;
}

/** Of each row's vector. */
export function lengths(entries: readonly Float64Array[]): Float64Array {
  const squares = new Float64Array(entries[0]?.length ?? 0);
  for (const values of entries) for (let i = 0; i < squares.length; i++) squares[i]! += values[i]! * values[i]!;
  for (let i = 0; i < squares.length; i++) squares[i] = Math.sqrt(squares[i]!);
  return squares;
}

/** Root of the mean square. */
function rms(values: Float64Array): number {
  return Math.sqrt(pairwise(values.map((value) => value * value)) / values.length);
}

function tiltOf(flight: Flight, given: Inputs | undefined): Float64Array | undefined {
  const { cos, atan2 } = (given && lawCode(given.controller.law)) ?? Math;
  if (flight.rows < 2) return undefined;
  let cosines: Float64Array;
  if (flight.has("q_x", "q_y")) {
    const [x, y] = [flight.column("q_x")!, flight.column("q_y")!];
    cosines = x.map((value, i) => 1 - 2 * (value * value + y[i]! * y[i]!));
  } else if (flight.has("theta", "phi")) {
    const [theta, phi] = [flight.column("theta")!, flight.column("phi")!];
    cosines = theta.map((value, i) => cos(value) * cos(phi[i]!));
  } else return undefined;
  return cosines.map((c) => Math.min(Math.max(c, -1), 1)).map((c) => atan2(Math.sqrt((1 - c) * (1 + c)), c));
}

/** Each rotor's thrust as it turns, without what a fault takes from it. */
function asTurning(flight: Flight): Float64Array[] {
  const whole = columns(flight, (name) => /^f\d+_whole$/.test(name));
  return whole.length ? whole : columns(flight, (name) => FORCE.test(name));
}

function columns(flight: Flight, wanted: (name: string) => boolean): Float64Array[] {
  return flight.names.filter(wanted).map((name) => flight.column(name)!);
}

/** Row by row, from the left. */
function sums(parts: readonly Float64Array[]): Float64Array {
  const [first, ...others] = parts;
  const sum = first?.slice() ?? new Float64Array();
  for (const part of others) for (let i = 0; i < sum.length; i++) sum[i]! += part[i]!;
  return sum;
}

export function greatest(values: Float64Array): number {
  let most = -Infinity;
  for (let i = 0; i < values.length; i++) if (values[i]! > most) most = values[i]!; // an iterator costs more than the rest
  return most;
}

const BLOCK = 128;
const LANES = 8;

/** The sum as NumPy forms it, from `first` to before `past`: halves of halves down to blocks, eight running sums in each. */
export function pairwise(values: Float64Array, first = 0, past = values.length): number {
  const n = past - first;
  let sum = 0;
  let i = first;
  if (n > BLOCK) {
    const half = first + (n >> 1) - ((n >> 1) % LANES);
    return pairwise(values, first, half) + pairwise(values, half, past);
  }
  if (n >= LANES) {
    const lanes = values.slice(first, (i += LANES));
    for (const whole = past - (n % LANES); i < whole; i++) lanes[(i - first) % LANES]! += values[i]!;
    const [a, b, c, d, e, f, g, h] = lanes as unknown as [number, number, number, number, number, number, number, number];
    sum = a + b + (c + d) + (e + f + (g + h));
  }
  for (; i < past; i++) sum += values[i]!;
  return sum;
}
