// Where the vehicle is and how it is turned, out of the columns of a flight.

import { Quaternion, Vector3 } from "three";

import type { SceneData } from "../data/contract";
import type { Flight } from "../data/flight";
import { indexAt } from "../plots/curve";

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

/** Points (x, y, z, ...) of three columns, 0 where a plant has none, at most `most` of them, and the rows from one to the next. */
export function pathOf(flight: Flight, columns: readonly [string, string, string], most: number): { points: Float32Array; stride: number } {
  const axes = columns.map((name) => flight.column(name));
  const length = Math.max(...axes.map((axis) => axis?.length ?? 0));
  const stride = Math.max(1, Math.ceil(length / most));
  const points: number[] = [];
  for (let i = 0; i < length; i += stride) points.push(...axes.map((axis) => axis?.[i] ?? 0));
  return { points: new Float32Array(points), stride };
}
