// Words in the scene: elements over the canvas, each held at a point of the world, and none where others stand already.

import { type PerspectiveCamera, Vector3 } from "three";

import { FONT } from "../plots/surface";
import { byId, h } from "../view/dom";

export type Kind = "axis" | "tick" | "thrust" | "force" | "wind" | "end";

const INSET = 14; // px from the edge for what must not leave the picture
const GAP = 8; // px between the vehicle and what is said of it
const LETTER = 5.9; // px, about
const HEIGHT = 11; // px
/** How far below its point a label begins [px], as the style has it. */
const RISE: Readonly<Record<Kind, number>> = { axis: -5, tick: 4, thrust: -13, force: -13, wind: -13, end: -13 };
const OTHERS = "#badge > *, #camera, #legend, #caption";

/** A box in the picture [px]. */
interface Area {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

/** A point in the picture [px], and the radius of what is drawn there. */
export interface Spot {
  readonly x: number;
  readonly y: number;
  readonly radius: number;
}

export class Labels {
  private readonly host = byId("labels");
  private readonly pool: HTMLElement[] = [];
  private readonly call = h("span", { class: "label call", hidden: true });
  private used = 0;
  private taken: Area[] = [];
  private whole: Area = { left: 0, top: 0, right: 0, bottom: 0 };
  private readonly seen = new Vector3();

  constructor() {
    this.host.append(this.call);
  }

  /** Begin a picture; paper: of this size [px], with nothing before it. */
  begin(paper?: { readonly width: number; readonly height: number }): void {
    this.used = 0;
    this.call.hidden = true;
    const { left, top, width, height } = this.host.getBoundingClientRect();
    this.whole = { left: 0, top: 0, right: paper?.width ?? width, bottom: paper?.height ?? height };
    this.taken = paper ? [] : [...document.querySelectorAll(OTHERS)].map((other) => {
      const box = other.getBoundingClientRect();
      return { left: box.left - left, top: box.top - top, right: box.right - left, bottom: box.bottom - top };
    });
  }

  /** Where a point of the world is in the picture; undefined: behind the camera or outside. */
  spot(at: Vector3, camera: PerspectiveCamera): { x: number; y: number } | undefined {
    const { x, y, z } = this.seen.copy(at).project(camera);
    if (z > 1 || Math.abs(x) > 1.02 || Math.abs(y) > 1.02) return undefined;
    return { x: ((x + 1) / 2) * this.whole.right, y: ((1 - y) / 2) * this.whole.bottom };
  }

  /** Words at a point; none where something else stands. */
  put(kind: Kind, text: string, at: Vector3, camera: PerspectiveCamera): void {
    const spot = this.spot(at, camera);
    if (!spot) return;
    const { x, y } = spot;
    const long = text.length * LETTER + 6;
    const past = x + long > this.whole.right;
    const left = past && kind !== "axis" && kind !== "tick";
    if (past && kind === "tick") return;
    const top = y + RISE[kind];
    const area = { left: left ? x - long : x, right: left ? x : x + long, top, bottom: top + HEIGHT };
    if (this.clash(area)) return;
    this.taken.push(area);
    const element = (this.pool[this.used] ??= this.make());
    this.used++;
    const name = `label ${kind}${left ? " left" : ""}`;
    if (element.className !== name) element.className = name;
    if (element.textContent !== text) element.textContent = text;
    element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    element.hidden = false;
  }

  /** One sentence beside what is drawn at a spot, wholly in the picture; above it rather than below it, or the other way round. */
  callOut(text: string, { x, y, radius }: Spot, above: boolean): void {
    const { call, whole } = this;
    if (call.textContent !== text) call.textContent = text;
    call.hidden = false;
    const [width, height] = [call.offsetWidth, call.offsetHeight];
    const [across, up] = [radius + GAP + width / 2, (radius + GAP + height / 2) * (above ? -1 : 1)];
    const boxes = [[0, up], [0, -up], [-across, 0], [across, 0], ...[1.5, 2].flatMap((far) => [[0, far * up], [0, -far * up]])].map(([dx = 0, dy = 0]): Area => {
      const left = Math.max(Math.min(x + dx - width / 2, whole.right - INSET - width), INSET);
      const top = Math.max(Math.min(y + dy - height / 2, whole.bottom - INSET - height), INSET);
      return { left, top, right: left + width, bottom: top + height };
    });
    const drawn = { left: x - radius, top: y - radius, right: x + radius, bottom: y + radius };
    const box = boxes.find((one) => !overlap(one, drawn) && !this.clash(one)) ?? boxes.find((one) => !this.clash(one)) ?? boxes[0]!;
    this.taken.push(box);
    call.style.transform = `translate(${box.left.toFixed(1)}px, ${box.top.toFixed(1)}px)`;
  }

  /** What was put into the picture, on a canvas. */
  print(pen: CanvasRenderingContext2D, colour: string): void {
    Object.assign(pen, { font: `${HEIGHT}px ${FONT}`, fillStyle: colour, textBaseline: "top" });
    for (const { textContent, style, className } of this.pool.slice(0, this.used)) {
      const [x, y] = [...style.transform.matchAll(/-?[\d.]+/g)].map(Number) as [number, number];
      const kind = Object.keys(RISE).find((one) => className.split(" ").includes(one)) as Kind;
      pen.textAlign = className.endsWith(" left") ? "right" : "left";
      pen.fillText(textContent ?? "", x, y + RISE[kind]);
    }
  }

  /** End it: what was not used is gone. */
  end(): void {
    for (let i = this.used; i < this.pool.length; i++) this.pool[i]!.hidden = true;
  }

  private clash(area: Area): boolean {
    return this.taken.some((other) => overlap(area, other));
  }

  private make(): HTMLElement {
    const made = h("span");
    this.host.append(made);
    return made;
  }
}

function overlap(a: Area, b: Area): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}
