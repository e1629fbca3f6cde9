// The path that a flight should take, the dot where it ends, and how large the scene is with it.

import { CircleGeometry, Mesh, MeshBasicMaterial, Vector3 } from "three";

import type { SceneData } from "../data/contract";
import type { Flight } from "../data/flight";
import { FINE } from "./flyer";
import { extentOf, pathOf } from "./pose";
import { Trail } from "./trail";

export class Wanted {
  readonly trail = new Trail(7, -3);
  readonly target = new Mesh(new CircleGeometry(1, 32), new MeshBasicMaterial({ transparent: true, depthWrite: false }));
  readonly centre = new Vector3();
  radius = 1;
  /** The height of the ground [m]. */
  level = 0;
  private lowest = 0;
  private whole: { readonly flight: Flight; readonly data: SceneData } | undefined; // the last that was not a beginning

  constructor() {
    this.target.renderOrder = -1;
  }

  /** The path of a flight; whether it is another. vehicle: its size [m]. beginning: the path goes on where the flight does not, if it is the one known. */
  show(flight: Flight, data: SceneData, vehicle: number, beginning: boolean): boolean {
    if (beginning && this.knows(flight, data)) return false;
    if (!beginning) this.whole = { flight, data };
    const fine = FINE * Math.max(extentOf(flight, data.wanted), vehicle);
    const { points } = pathOf(flight, data.wanted, fine);
    this.measure(points, pathOf(flight, data.position, fine).points, vehicle);
    this.level = Math.min(data.ground, Math.floor(this.lowest));
    this.trail.set(points, this.radius);
    const end = points.length >= 3 ? points.slice(-3) : [0, 0, 0];
    this.target.position.set(end[0]!, end[1]!, end[2]!);
    this.target.visible = points.length >= 3;
    return true;
  }

  /** Whether the last whole flight had the path of this one, as it has where this one ends. */
  private knows(flight: Flight, data: SceneData): boolean {
    const { whole } = this;
    const last = flight.rows - 1;
    return whole?.data === data && data.wanted.every((name) => Object.is(flight.column(name)?.[last], whole.flight.column(name)?.[last]));
  }

  /** Centre and size of the wanted path, and of what was flown near it: a diverged flight may end anywhere. */
  private measure(wanted: Float32Array, flown: Float32Array, vehicle: number): void {
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = low.clone().negate();
    const take = (points: Float32Array, reach: number): void => {
      const [from, to] = [low.clone().subScalar(reach), high.clone().addScalar(reach)];
      for (let i = 0; i + 2 < points.length; i += 3) {
        const point = new Vector3(points[i], points[i + 1], points[i + 2]);
        if (reach && (point.clone().max(from).distanceTo(point) > 0 || point.clone().min(to).distanceTo(point) > 0)) continue;
        low.min(point);
        high.max(point);
      }
    };
    take(wanted, 0);
    if (low.x > high.x) take(flown, 0);
    const size = high.distanceTo(low);
    take(flown, Math.max(size * 0.35, vehicle * 10 || 1));
    if (!(low.x <= high.x)) return void ([this.radius, this.lowest] = [1, 0]);
    this.lowest = low.z;
    this.centre.addVectors(low, high).multiplyScalar(0.5);
    this.radius = Math.max(high.distanceTo(low) * 0.57, (vehicle || 0.3) * 4);
  }
}
