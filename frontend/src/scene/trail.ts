// A path through space as a line of even width on the screen.

import { Color, Group } from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";

export class Trail {
  readonly object = new Group();
  private readonly material: LineMaterial;
  private line: Line2 | undefined;
  private count = 0;

  /** width: pixels. order: paths with a higher one are drawn over others. */
  constructor(width: number, private readonly order: number, private readonly dashed = false) {
    // Paths lie upon each other: the later in order shows, whatever the depth of its pixels.
    this.material = new LineMaterial({ linewidth: width, dashed, depthWrite: false });
  }

  colour(colour: string): void {
    this.material.color = new Color(colour);
  }

  /** The points of the path, (x, y, z, ...). */
  set(points: Float32Array, size: number): void {
    this.line?.geometry.dispose();
    if (this.line) this.object.remove(this.line);
    this.line = undefined;
    this.count = points.length / 3;
    if (this.count < 2) return;
    const geometry = new LineGeometry();
    geometry.setPositions(points);
    this.line = new Line2(geometry, this.material);
    this.line.frustumCulled = false;
    this.line.renderOrder = this.order;
    if (this.dashed) {
      this.line.computeLineDistances();
      this.material.dashSize = size / 90;
      this.material.gapSize = size / 90;
    }
    this.object.add(this.line);
  }

  /** Show only the first so many points. */
  upTo(points: number): void {
    if (!this.line) return;
    const segments = Math.min(Math.max(Math.floor(points) - 1, 0), this.count - 1);
    this.line.visible = segments > 0;
    this.line.geometry.instanceCount = segments;
  }
}
