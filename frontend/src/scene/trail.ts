// A path through space as a line of even width on the screen.

import { Color, Group, type InterleavedBufferAttribute, type Vector3 } from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";

export class Trail {
  readonly object = new Group();
  private readonly material: LineMaterial;
  private line: Line2 | undefined;
  private points: Float32Array = new Float32Array();

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
    this.points = points;
    if (points.length < 6) return;
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

  /** Show the path up to a point, and from there straight to `tip`. */
  upTo(point: number, tip: Vector3): void {
    if (!this.line) return;
    const { points } = this;
    const ends = this.line.geometry.attributes["instanceEnd"] as InterleavedBufferAttribute;
    const last = ends.count - 1;
    const segment = Math.min(point, last);
    const shown = this.line.geometry.instanceCount;
    const before = shown > 0 && shown <= last ? shown - 1 : last; // whose end is perhaps not its own
    ends.setXYZ(before, points[3 * before + 3]!, points[3 * before + 4]!, points[3 * before + 5]!);
    ends.setXYZ(segment, tip.x, tip.y, tip.z);
    ends.data.needsUpdate = true;
    this.line.geometry.instanceCount = segment + 1;
  }
}
