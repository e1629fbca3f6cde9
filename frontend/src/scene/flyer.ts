// One flight in the scene: its vehicle, the path it leaves behind, and the arrows of what acts on it.

import { Group, Quaternion, Vector3 } from "three";

import type { SceneData } from "../data/contract";
import type { Flight } from "../data/flight";
import { indexAt } from "../plots/curve";
import type { Palette } from "../view/theme";
import { Arrow } from "./arrow";
import { attitudeAt, pathOf, vectorAt } from "./pose";
import { Trail } from "./trail";
import { Vehicle } from "./vehicle";

/** How far a drawn path may be from the flown one, as a part of the scene's size: less than half a pixel. */
export const FINE = 4e-4;
const UP = new Vector3(0, 0, 1);

/** A vector drawn as an arrow; at: what it is now, in the world's axes. */
export interface Drawn {
  readonly label: string;
  readonly unit: string;
  readonly kind: "thrust" | "force" | "wind";
  /** Where it ends now, and its size. */
  readonly tip: Vector3;
  size: number;
  readonly arrow: Arrow;
  /** How long it is drawn: vehicle sizes a unit. */
  scale: number;
  at(t: number, out: Vector3): Vector3;
}

export class Flyer {
  readonly object = new Group();
  readonly position = new Vector3();
  readonly drawn: Drawn[] = [];
  private readonly attitude = new Quaternion();
  private readonly trail: Trail;
  private readonly blowing = new Vector3();
  private rows: readonly number[] = [];
  private flight: Flight | undefined;
  readonly vehicle: Vehicle;

  constructor(
    private readonly data: SceneData,
    private readonly ghost: boolean,
  ) {
    this.vehicle = new Vehicle(data, ghost);
    this.trail = new Trail(ghost ? 2.4 : 2.6, ghost ? -1 : -2, ghost);
    this.object.add(this.vehicle.object, this.trail.object);
    if (!ghost) this.addArrows();
  }

  colour(palette: Palette): void {
    const identity = this.ghost ? palette.vermillion : palette.blue;
    this.vehicle.colour(palette, identity);
    this.trail.colour(identity);
    const of = { thrust: palette.orange, force: palette.pink, wind: palette.sky };
    for (const { arrow, kind } of this.drawn) arrow.colour(of[kind]);
  }

  /** constant: a parameter in use, by name. size: of the whole scene [m]. */
  show(flight: Flight, size: number, constant: (name: string) => number): void {
    this.flight = flight;
    const { points, rows } = pathOf(flight, this.data.position, FINE * size);
    this.rows = rows;
    this.trail.set(points, size);
    this.data.arrows.forEach((arrow, i) => {
      const drawn = this.drawn[i + 1];
      if (!drawn) return;
      const { columns, parameters } = arrow;
      if (columns) drawn.at = (t, out) => vectorAt(flight, columns, t, out);
      else if (parameters) drawn.at = (_, out) => out.set(...parameters.map((name) => constant(name) || 0) as [number, number, number]);
      drawn.scale = 2.6 / greatest(drawn, flight);
    });
  }

  /** To where it is at time t; magnify: how much larger than true the vehicle is drawn. */
  place(t: number): void {
    const { flight } = this;
    if (!flight?.rows) return;
    vectorAt(flight, this.data.position, t, this.position);
    this.attitude.copy(attitudeAt(flight, this.data.attitude, t));
    this.trail.upTo(indexAt(this.rows, indexAt(flight.times, t)), this.position);
    this.vehicle.object.position.copy(this.position);
    this.vehicle.object.quaternion.copy(this.attitude);
  }

  /** Drawn so many times its size; arrows no thicker than this radius [m]. */
  magnify(times: number, t: number, thickest: number): void {
    this.vehicle.object.scale.setScalar(times);
    const unit = this.vehicle.size * times;
    const along = new Vector3();
    for (const drawn of this.drawn) {
      drawn.size = drawn.at(t, along).length();
      drawn.arrow.set(this.position, along.multiplyScalar(unit * Math.min(drawn.scale, LONGEST / Math.max(drawn.size, 1e-9))), Math.min(unit * 0.032, thickest));
      drawn.tip.copy(this.position).add(along);
    }
  }

  /** The wind at time t [m/s], if the flight has any. */
  wind(t: number): Vector3 | undefined {
    return this.flight && this.drawn.find((drawn) => drawn.kind === "wind")?.at(t, this.blowing);
  }

  spin(seconds: number, t: number): void {
    const { flight, data } = this;
    if (!flight) return;
    const forces = data.rotors.map((rotor) => (rotor.force ? flight.at(rotor.force, t) / data.hover : 1));
    this.vehicle.spin(seconds, forces);
  }

  dispose(): void {
    this.vehicle.dispose();
  }

  private addArrows(): void {
    const { thrust, rotors, hover } = this.data;
    const add = (label: string, unit: string, kind: Drawn["kind"], scale: number, at: Drawn["at"]): void => {
      const arrow = new Arrow(kind === "wind");
      this.object.add(arrow.object);
      this.drawn.push({ label, unit, kind, arrow, scale, at, tip: new Vector3(), size: 0 });
    };
    const all = Math.max(rotors.length * hover, 1e-9);
    const forces = rotors.flatMap(({ force }) => force ?? []); // what they make: commands leave out lag and faults
    const made = forces.length < rotors.length ? (thrust ? [thrust] : []) : forces;
    const sum = (t: number): number => made.reduce((so, name) => so + (this.flight?.at(name, t) || 0), 0);
    add("Thrust", "N", "thrust", 2 / all, (t, out) => out.copy(UP).applyQuaternion(this.attitude).multiplyScalar(sum(t)));
    for (const arrow of this.data.arrows) add(arrow.label, arrow.unit, arrow.kind, 1, (_, out) => out.set(0, 0, 0));
  }
}

const LONGEST = 3.2; // of an arrow, in sizes of the vehicle: beyond it only the number beside it grows

/** The length of the longest of a vector's values in a flight; 1 if it is always zero. */
function greatest(drawn: Drawn, flight: Flight): number {
  const value = new Vector3();
  const step = Math.max(1, Math.floor(flight.rows / 200));
  let most = 0;
  for (let i = 0; i < flight.rows; i += step) most = Math.max(most, drawn.at(flight.times[i]!, value).length());
  return most > 0 ? most : 1;
}
