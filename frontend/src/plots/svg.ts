// A surface that becomes an SVG file.

import type { Piece } from "../view/notation";
import { type Box, FONT, LOW, type Lettering, type Stroke, type Surface } from "./surface";

const SVG = "http://www.w3.org/2000/svg";

export class SvgSurface implements Surface {
  readonly root: SVGSVGElement;
  private group: Element;
  private clips = 0;

  constructor(width: number, height: number, background: string) {
    this.root = document.createElementNS(SVG, "svg");
    this.set(this.root, { xmlns: SVG, viewBox: `0 0 ${width} ${height}`, width, height, "font-family": FONT });
    this.group = this.root;
    this.rectangle({ left: 0, top: 0, width, height }, background);
  }

  polyline(points: ArrayLike<number>, stroke: Stroke): void {
    let path = "";
    let down = false;
    for (let i = 0; i + 1 < points.length; i += 2) {
      const y = points[i + 1]!;
      if (!Number.isNaN(y)) path += `${down ? "L" : "M"}${short(points[i]!)} ${short(y)}`;
      down = !Number.isNaN(y);
    }
    this.add("path", {
      d: path,
      fill: "none",
      stroke: stroke.colour,
      "stroke-width": stroke.width,
      "stroke-linejoin": "round",
      ...(stroke.dash.length ? { "stroke-dasharray": stroke.dash.join(" ") } : {}),
      ...(stroke.opacity === undefined ? {} : { opacity: stroke.opacity }),
    });
  }

  rectangle(box: Box, fill: string, opacity = 1): void {
    this.add("rect", { x: box.left, y: box.top, width: box.width, height: box.height, fill, opacity });
  }

  circle(x: number, y: number, radius: number, fill: string, ring: string): void {
    this.add("circle", { cx: short(x), cy: short(y), r: radius, fill, stroke: ring });
  }

  text(x: number, y: number, text: string | readonly Piece[], lettering: Lettering): void {
    const anchor = { left: "start", center: "middle", right: "end" }[lettering.align];
    const element = this.add("text", {
      x: short(x),
      y: short(y),
      fill: lettering.colour,
      "font-size": lettering.size,
      "font-weight": lettering.weight ?? 400,
      "text-anchor": anchor,
      "dominant-baseline": "central",
    });
    if (typeof text === "string") element.textContent = text;
    else this.append(element, text, lettering.size);
  }

  /** Pieces of a line, each where the one before it ends in whatever typeface the file is shown with. */
  private append(line: Element, text: readonly Piece[], size: number): void {
    const drop = short(LOW.drop * size);
    let below = false;
    for (const { text: piece, low } of text) {
      const part = document.createElementNS(SVG, "tspan");
      this.set(part, { ...(low === below ? {} : { dy: low ? drop : `-${drop}` }), ...(low ? { "font-size": short(LOW.size * size) } : {}) });
      part.textContent = piece;
      line.append(part);
      below = low;
    }
  }

  clipped(box: Box, draw: () => void): void {
    const id = `clip${this.clips++}`;
    const outer = this.group;
    const clip = this.add("clipPath", { id });
    this.group = clip;
    this.rectangle(box, "#000");
    this.group = outer;
    this.group = this.add("g", { "clip-path": `url(#${id})` });
    draw();
    this.group = outer;
  }

  /** The file's text. */
  serialise(): string {
    return new XMLSerializer().serializeToString(this.root);
  }

  private add(tag: string, attributes: Record<string, string | number>): Element {
    const element = document.createElementNS(SVG, tag);
    this.set(element, attributes);
    this.group.append(element);
    return element;
  }

  private set(element: Element, attributes: Record<string, string | number>): void {
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  }
}

function short(x: number): string {
  return String(Math.round(x * 100) / 100);
}
