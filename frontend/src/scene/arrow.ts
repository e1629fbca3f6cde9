// An arrow for a vector; wind has a broken shaft, so that shape tells it from a force as well as colour.

import { Color, ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, type Vector3, Vector3 as V } from "three";

const UP = new V(0, 1, 0);
const PIECES = 3;

export class Arrow {
  readonly object = new Group();
  private readonly material = new MeshBasicMaterial();
  private readonly head = new Mesh(new ConeGeometry(1, 1, 20), this.material);
  private readonly shaft: Mesh[] = [];

  constructor(broken: boolean) {
    const pieces = broken ? PIECES : 1;
    for (let i = 0; i < pieces; i++) this.shaft.push(new Mesh(new CylinderGeometry(1, 1, 1, 12), this.material));
    this.object.add(this.head, ...this.shaft);
  }

  colour(colour: string): void {
    this.material.color = new Color(colour);
  }

  /** From a point along a vector [m]; too short to see: not shown. thick: radius of the shaft [m]. */
  set(from: Vector3, along: Vector3, thick: number): void {
    const length = along.length();
    this.object.visible = length > thick;
    if (!this.object.visible) return;
    const tip = Math.min(thick * 6, length * 0.6);
    this.object.position.copy(from);
    this.object.quaternion.setFromUnitVectors(UP, along.clone().divideScalar(length));
    this.head.scale.set(thick * 2.6, tip, thick * 2.6);
    this.head.position.y = length - tip / 2;
    const share = (length - tip) / this.shaft.length;
    this.shaft.forEach((piece, i) => {
      const part = this.shaft.length > 1 ? 0.62 : 1;
      piece.scale.set(thick, share * part, thick);
      piece.position.y = share * (i + 0.5);
    });
  }
}
