// Wind through the whole scene: streaks that move as the air does, as long as the way it goes in a moment.

import { BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments, Vector3 } from "three";

const COUNT = 160;
const MOMENT = 0.22; // s
const STILL = 0.05; // m/s

export class Streaks {
  private readonly material = new LineBasicMaterial({ transparent: true, opacity: 0.5, depthWrite: false });
  private readonly ends = new Float32Array(COUNT * 6);
  private readonly places = new Float32Array(COUNT * 3);
  readonly object = new LineSegments(new BufferGeometry(), this.material);
  private readonly centre = new Vector3();
  private reach = 1;
  private level = 0;

  constructor() {
    this.object.geometry.setAttribute("position", new BufferAttribute(this.ends, 3));
    this.object.frustumCulled = false;
    this.object.visible = false;
    // Spread evenly, the same every time: multiples of irrational steps.
    for (let i = 0; i < COUNT; i++) {
      this.places[3 * i] = (i * 0.8191725134) % 1;
      this.places[3 * i + 1] = (i * 0.6710436067) % 1;
      this.places[3 * i + 2] = (i * 0.5497004779) % 1;
    }
  }

  colour(colour: string, dark: boolean): void {
    this.material.color = new Color(colour);
    this.material.opacity = dark ? 0.55 : 0.7;
  }

  /** The box that is filled: around the centre, from the ground up. */
  fill(centre: Vector3, reach: number, level: number): void {
    this.centre.copy(centre);
    this.reach = reach;
    this.level = level;
  }

  /** Air that moves by wind [m/s] for `seconds`; undefined: this flight has none. */
  move(wind: Vector3 | undefined, seconds: number): void {
    const speed = wind?.length() ?? 0;
    this.object.visible = speed > STILL;
    if (!wind || !this.object.visible) return;
    const { places, ends, centre, reach, level } = this;
    const low = [centre.x - reach, centre.y - reach, Math.max(level, centre.z - reach)];
    const size = [2 * reach, 2 * reach, Math.max(centre.z + reach - low[2]!, reach)];
    const blow = [wind.x, wind.y, wind.z];
    for (let i = 0; i < COUNT; i++) {
      for (let k = 0; k < 3; k++) {
        const at = 3 * i + k;
        const moved = places[at]! + (blow[k]! * seconds) / size[k]!;
        places[at] = moved - Math.floor(moved);
        const head = low[k]! + places[at]! * size[k]!;
        ends[6 * i + k] = head;
        const tail = head - blow[k]! * MOMENT;
        ends[6 * i + 3 + k] = k === 2 ? Math.max(tail, level) : tail;
      }
    }
    this.object.geometry.attributes["position"]!.needsUpdate = true;
  }
}
