// The world's axes, with a mark and a number at round distances.

import { BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments, type PerspectiveCamera, Vector3 } from "three";

import { plain } from "../view/format";
import type { Labels } from "./labels";

const NAMES = ["x", "y", "z"] as const;
const MARKS = 4; // numbers along an axis

export class Axes {
  private readonly material = new LineBasicMaterial({ transparent: true, opacity: 0.75 });
  readonly object = new LineSegments(new BufferGeometry(), this.material);
  private step = 0;
  private readonly at = new Vector3();
  private floor = 0;

  constructor() {
    this.object.frustumCulled = false;
  }

  colour(ink: string): void {
    this.material.color = new Color(ink);
  }

  /** From the world's origin, on the ground, with a mark every `step` [m]. */
  place(level: number, step: number): void {
    if (step === this.step && level === this.floor) return;
    this.step = step;
    this.floor = level;
    const long = step * (MARKS + 0.6);
    const tick = step * 0.09;
    const points: number[] = [];
    NAMES.forEach((_, axis) => {
      const end = [0, 0, level];
      end[axis] = long;
      points.push(0, 0, level, ...end);
      for (let k = 1; k <= MARKS; k++) {
        const mark = [0, 0, level];
        mark[axis] = k * step;
        const across = axis === 0 ? 1 : 0;
        const [from, to] = [[...mark], [...mark]];
        from[across]! -= tick;
        to[across]! += tick;
        points.push(...from, ...to);
      }
    });
    this.object.geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  }

  label(labels: Labels, camera: PerspectiveCamera): void {
    const { step, floor, at } = this;
    const put = (kind: "axis" | "tick", text: string, axis: number, far: number): void =>
      labels.put(kind, text, at.set(0, 0, floor).setComponent(axis, far), camera);
    NAMES.forEach((name, axis) => put("axis", name, axis, step * (MARKS + 0.9))); // before numbers, which make room for them
    for (let k = MARKS; k > 0; k -= 2) {
      NAMES.forEach((_, axis) => put("tick", `${plain(Number((k * step).toPrecision(6)))} m`, axis, k * step));
    }
  }
}
