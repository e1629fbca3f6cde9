// Where the vehicle is and how it is turned, out of the columns of a flight.

import { Quaternion, Vector3 } from "three";

import type { SceneData } from "../data/contract";
import type { Flight } from "../data/flight";
import { extent, indexAt } from "../plots/curve";

const X = new Vector3(1, 0, 0);
const Y = new Vector3(0, 1, 0);
const Z = new Vector3(0, 0, 1);

/** Three columns at time t; NaN becomes 0. */
export function vectorAt(flight: Flight, columns: readonly [string, string, string], t: number, out: Vector3): Vector3 {
  const [x, y, z] = columns.map((name) => flight.at(name, t) || 0);
  return out.set(x!, y!, z!);
}

/**
 * Body to world. The paper's angles are left-handed, R = Rx(-phi) Ry(-theta) Rz(-psi) with yaw innermost; airframes log a quaternion.
 */
export function attitudeAt(flight: Flight, attitude: SceneData["attitude"], t: number): Quaternion {
  if (attitude.kind === "lagrange") {
    const [psi, theta, phi] = attitude.columns.map((name) => flight.at(name, t) || 0);
    return turn(X, -phi!).multiply(turn(Y, -theta!)).multiply(turn(Z, -psi!));
  }
  // Between rows the shorter way: q and -q are one attitude, and a log may go from one to the other.
  const [w, x, y, z] = attitude.columns;
  const i = indexAt(flight.times, t);
  const row = (k: number): Quaternion => {
    const of = (name: string): number => flight.column(name)?.[Math.min(k, flight.rows - 1)] ?? 0;
    const q = new Quaternion(of(x), of(y), of(z), of(w));
    return q.length() > 0 ? q.normalize() : q.identity();
  };
  const here = flight.times[i] ?? 0;
  const step = (flight.times[i + 1] ?? here) - here;
  return row(i).slerp(row(i + 1), step > 0 ? Math.min(Math.max((t - here) / step, 0), 1) : 0);
}

function turn(axis: Vector3, angle: number): Quaternion {
  return new Quaternion().setFromAxisAngle(axis, angle);
}

/** Points (x, y, z, ...) of a path and the rows that they are of. */
export interface Path {
  readonly points: Float32Array;
  readonly rows: readonly number[];
}

/**
 * The path of three columns, 0 where a plant has none, in as few points as keep it within `tolerance` [m] of itself: a point is left out while
 * the path stays that near the ray on which it set out from the last one (Reumann and Witkam 1974). First and last row are always there.
 */
export function pathOf(flight: Flight, columns: readonly [string, string, string], tolerance: number): Path {
  const axes = columns.map((name) => flight.column(name));
  const length = Math.max(...axes.map((axis) => axis?.length ?? 0));
  const [xs, ys, zs] = axes.map((axis) => axis ?? new Float64Array(length)) as [Float64Array, Float64Array, Float64Array];
  const rows: number[] = length ? [0] : [];
  const from = new Vector3(xs[0], ys[0], zs[0]);
  const way = new Vector3();
  const here = new Vector3();
  for (let i = 1; i < length; i++) {
    const away = here.set(xs[i]!, ys[i]!, zs[i]!).sub(from);
    if (way.lengthSq() === 0) {
      if (away.length() > tolerance) way.copy(away).normalize();
      continue;
    }
    const along = away.dot(way);
    if (along >= 0 && away.addScaledVector(way, -along).length() <= tolerance) continue;
    rows.push(i - 1);
    from.set(xs[i - 1]!, ys[i - 1]!, zs[i - 1]!);
    way.set(0, 0, 0);
  }
  if (length > 1) rows.push(length - 1);
  return { points: Float32Array.from(rows.flatMap((row) => [xs[row]!, ys[row]!, zs[row]!])), rows };
}

/** The diagonal of the box that holds the path of three columns [m]. */
export function extentOf(flight: Flight, columns: readonly [string, string, string]): number {
  const spans = columns.map((name) => {
    const [low, high] = extent(flight.column(name) ?? [], 0, Infinity) ?? [0, 0];
    return high - low;
  });
  return Math.hypot(...spans);
}
