// The vehicle as its mission describes it: rotors where they are, as large as they are, turning the way they turn.

import {
  BoxGeometry,
  CircleGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Group,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  SphereGeometry,
  TorusGeometry,
  Vector3,
} from "three";

import type { SceneData } from "../data/contract";
import type { Palette } from "../view/theme";

const SPIN = 24; // rad of blade a second on the screen at hover; true speeds would only flicker

export class Vehicle {
  readonly object = new Group();
  /** Radius that holds everything [m]. */
  readonly size: number;
  private readonly frame = new MeshStandardMaterial({ roughness: 0.55, metalness: 0.15 });
  private readonly nose = new MeshStandardMaterial({ roughness: 0.5, metalness: 0.05 });
  private readonly ring = new MeshStandardMaterial({ roughness: 0.6 });
  private readonly disc = new MeshBasicMaterial({ transparent: true, side: DoubleSide, depthWrite: false });
  private readonly blades: { mesh: Mesh; spin: number }[] = [];

  constructor(private readonly data: SceneData, private readonly ghost = false) {
    this.size = Math.max(data.arm + data.radius, 1e-3);
    this.build();
  }

  colour(palette: Palette, identity: string): void {
    const body = new Color(this.ghost ? identity : palette.dark ? "#cfd4d8" : "#353c43");
    this.frame.color = body;
    this.ring.color = body;
    this.nose.color = new Color(identity);
    this.disc.color = new Color(identity);
    this.disc.opacity = palette.dark ? 0.22 : 0.16;
    const see: Material[] = [this.frame, this.ring, this.nose];
    for (const material of see) {
      material.transparent = this.ghost;
      material.opacity = this.ghost ? 0.5 : 1;
    }
  }

  /** Turn the blades by what passes in `seconds`; forces: of each rotor as a part of hover, at least 0. */
  spin(seconds: number, forces: readonly number[]): void {
    this.blades.forEach(({ mesh, spin }, i) => {
      const force = forces[i] ?? 1;
      mesh.rotation.z += spin * SPIN * Math.sqrt(Math.max(Number.isFinite(force) ? force : 0, 0)) * seconds;
    });
  }

  dispose(): void {
    this.object.traverse((part) => {
      if (part instanceof Mesh) part.geometry.dispose();
    });
    for (const material of [this.frame, this.nose, this.ring, this.disc]) material.dispose();
  }

  private build(): void {
    const { arm, radius, rotors } = this.data;
    const thick = arm * 0.05;
    const hub = new Mesh(new SphereGeometry(arm * 0.24, 20, 12), this.frame);
    hub.scale.set(1, 1, 0.42);
    const nose = new Mesh(new BoxGeometry(arm * 0.16, arm * 0.1, arm * 0.06), this.nose);
    nose.position.set(arm * 0.23, 0, arm * 0.01);
    this.object.add(hub, nose);
    const foremost = Math.max(...rotors.map((rotor) => rotor.position[0]));
    for (const rotor of rotors) {
      const place = new Vector3(...rotor.position);
      const front = rotor.position[0] > foremost - arm * 0.02 && rotor.position[0] > arm * 0.1;
      const paint = front ? this.nose : this.frame;
      const bar = new Mesh(new CylinderGeometry(thick, thick, place.length(), 12), paint);
      bar.position.copy(place).multiplyScalar(0.5);
      bar.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), place.clone().normalize());
      const motor = new Mesh(new CylinderGeometry(thick * 1.9, thick * 1.9, thick * 3.4, 20), this.frame);
      motor.rotation.x = Math.PI / 2;
      motor.position.copy(place);
      this.object.add(bar, motor, this.rotor(place, radius, thick, rotor.spin));
    }
  }

  private rotor(place: Vector3, radius: number, thick: number, spin: number): Group {
    const group = new Group();
    group.position.copy(place).add(new Vector3(0, 0, thick * 2));
    const ring = new Mesh(new TorusGeometry(radius, thick * 0.28, 6, 40), this.ring);
    const disc = new Mesh(new CircleGeometry(radius, 40), this.disc);
    const blade = new Mesh(new BoxGeometry(radius * 1.9, radius * 0.13, thick * 0.35), this.frame);
    blade.rotation.z = Math.atan2(place.y, place.x) + 0.4;
    this.blades.push({ mesh: blade, spin });
    group.add(ring, disc, blade);
    return group;
  }
}
