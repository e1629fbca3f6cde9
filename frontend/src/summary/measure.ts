// What a flight was like, in the numbers that `quadstep fly` reports, to the bit: sums in NumPy's order, angles by the laws' own functions.

import type { FlightData } from "../data/contract";
import type { Inputs } from "../data/engine";
import type { Flight } from "../data/flight";
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
}

export function measure(flight: Flight, data: FlightData, given: Inputs | undefined): Measures {
  const forces = sums(columns(flight, (name) => /^f\d+$/.test(name)));
  const thrust = flight.rows > 1 ? greatest(forces) : undefined;
  const most = given?.parameters[given.names.get(data.summary.limit ?? "") ?? -1] ?? Number.NaN;
  const full = most * flight.names.filter((name) => /^f\d+$/.test(name)).length;
  const share = thrust !== undefined && Number.isFinite(full) && full > 0 ? thrust / full : undefined;
  return { ...errors(flight, data.summary.since), tilt: tilt(flight, given), share, thrust };
}

function errors(flight: Flight, since: number): { rmse: number | undefined; largest: number | undefined } {
  const axes = flight.names.filter((name, i) => flight.units[i] === "m" && flight.has(`${name}_d`));
  const first = flight.times.findIndex((t) => t >= since);
  if (!axes.length || flight.rows < 2 || first < 0 || flight.last <= since) return { rmse: undefined, largest: undefined };
  const squares = sums(
    axes.map((axis) => {
      const wanted = flight.column(`${axis}_d`)!;
      return flight.column(axis)!.subarray(first).map((value, i) => (wanted[first + i]! - value) * (wanted[first + i]! - value));
    }),
  );
  const distances = squares.map(Math.sqrt);
  const mean = pairwise(distances.map((value) => value * value)) / distances.length;
  return { rmse: Math.sqrt(mean), largest: greatest(distances) };
}

function tilt(flight: Flight, given: Inputs | undefined): number | undefined {
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
  return greatest(cosines.map((c) => Math.min(Math.max(c, -1), 1)).map((c) => atan2(Math.sqrt((1 - c) * (1 + c)), c)));
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

function greatest(values: Float64Array): number {
  let most = -Infinity;
  for (const value of values) if (value > most) most = value;
  return most;
}

const BLOCK = 128;
const LANES = 8;

/** The sum as NumPy forms it: halves of halves down to blocks, eight running sums in each. */
export function pairwise(values: Float64Array): number {
  const n = values.length;
  if (n < LANES) return values.reduce((sum, value) => sum + value, 0);
  if (n > BLOCK) {
    const half = (n >> 1) - ((n >> 1) % LANES);
    return pairwise(values.subarray(0, half)) + pairwise(values.subarray(half));
  }
  const lanes = values.slice(0, LANES);
  const whole = n - (n % LANES);
  for (let i = LANES; i < whole; i++) lanes[i % LANES]! += values[i]!;
  const [a, b, c, d, e, f, g, h] = lanes as unknown as [number, number, number, number, number, number, number, number];
  let sum = a + b + (c + d) + (e + f + (g + h));
  for (let i = whole; i < n; i++) sum += values[i]!;
  return sum;
}
