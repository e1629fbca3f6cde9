// Words in the scene: elements over the canvas, each held at a point of the world.

import { type PerspectiveCamera, Vector3 } from "three";

import { byId, h } from "../view/dom";

export type Kind = "axis" | "tick" | "thrust" | "force" | "wind" | "lost" | "end";

const INSET = 14; // px from the edge for what must not leave the picture
const TOP = 58; // below the badge and the camera's switch

export class Labels {
  private readonly host = byId("labels");
  private readonly pool: HTMLElement[] = [];
  private used = 0;
  private readonly seen = new Vector3();

  /** Begin a picture. */
  begin(): void {
    this.used = 0;
  }

  /** keep: hold it within the picture even where its point is outside. */
  put(kind: Kind, text: string, at: Vector3, camera: PerspectiveCamera, keep = false): void {
    const { seen } = this;
    seen.copy(at).project(camera);
    const behind = seen.z > 1;
    if ((behind || Math.abs(seen.x) > 1.02 || Math.abs(seen.y) > 1.02) && !keep) return;
    const { clientWidth: width, clientHeight: height } = this.host;
    const turn = behind ? -1 : 1;
    let x = ((turn * seen.x + 1) / 2) * width;
    let y = ((1 - turn * seen.y) / 2) * height;
    if (keep) {
      x = Math.min(Math.max(x, INSET), width - INSET);
      y = Math.min(Math.max(y, TOP), height - INSET);
    }
    const element = (this.pool[this.used] ??= this.make());
    this.used++;
    const name = `label ${kind}${x > width * 0.7 ? " left" : ""}`;
    if (element.className !== name) element.className = name;
    if (element.textContent !== text) element.textContent = text;
    element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    element.hidden = false;
  }

  /** End it: what was not used is gone. */
  end(): void {
    for (let i = this.used; i < this.pool.length; i++) this.pool[i]!.hidden = true;
  }

  private make(): HTMLElement {
    const made = h("span");
    this.host.append(made);
    return made;
  }
}
