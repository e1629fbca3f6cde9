// One set of axes of a figure: its curves as points, read off the drawing, and the drawing of a part of them.

import { decade, labels, ticks } from "../plots/ticks";
import { type Axis, share, valueAt } from "./scale";

/** What Python says of a set of axes. box: left, top, width, height. ours: whether all that is drawn can be drawn anew. */
export interface Told {
  readonly id: string;
  readonly box: readonly [number, number, number, number];
  readonly x: Axis;
  readonly y: Axis;
  readonly across: string;
  readonly up: string;
  readonly ours: boolean;
  readonly curves: readonly { readonly id: string; readonly name: string }[];
  readonly bars: readonly Bar[];
  readonly spots: readonly Spot[];
  /** All that stands in the axes. along: the axes in whose values it does, "xy", "x", "y" or none. */
  readonly drawn: readonly { readonly id: string; readonly along: string }[];
}

/** A point or a cell: left, top, width and height, its name, and what is said of it. */
export type Spot = readonly [number, number, number, number, string, readonly (readonly [string, string])[]];

/** A bar from one value to another. */
export interface Bar {
  readonly id: string;
  readonly name: string;
  readonly along: "x" | "y";
  readonly low: number;
  readonly high: number;
}

export interface Curve {
  readonly name: string;
  readonly x: Float64Array; // values
  readonly y: Float64Array;
  readonly rising: boolean; // a function of x
}

const SVG = "http://www.w3.org/2000/svg";

export class Panel {
  readonly curves: readonly Curve[];
  readonly group: Element;
  readonly svg: SVGSVGElement; // which it stands in
  private readonly shapes: readonly Shape[];
  x: Axis;
  y: Axis;
  private fresh: Element[] = [];

  constructor(drawn: Element, readonly told: Told) {
    const group = (this.group = found(drawn, told.id)!);
    this.svg = group.closest("svg")!;
    this.x = told.x;
    this.y = told.y;
    this.curves = told.curves.flatMap(({ id, name }) => {
      const path = found(group, id)?.querySelector("path");
      return path ? [this.curve(path, name)] : [];
    });
    this.shapes = told.drawn.flatMap(({ id, along }) => {
      const part = along && found(group, id);
      return part ? [...part.querySelectorAll<SVGElement>(MOVED)].map((element) => new Shape(element, along)) : [];
    });
  }

  /** Whether its curves are functions of x, which can be read at one place. */
  get over(): boolean {
    return this.curves.length > 0 && this.curves.every((one) => one.rising);
  }

  /** Whether a part of x can be shown. */
  get parts(): boolean {
    return this.told.ours && (this.over || this.told.bars.some((one) => one.along === "x"));
  }

  /** The bar that an element draws. */
  bar(element: EventTarget | null): Bar | undefined {
    const id = element instanceof Element ? element.closest("g[id]")?.id : undefined;
    return this.told.bars.find((one) => id === one.id || id?.endsWith(`-${one.id}`));
  }

  /** The point or cell at a place: what it is in, or else the nearest within `reach`. */
  spot(at: DOMPoint, reach: number): Spot | undefined {
    const off = ([left, top, width, height]: Spot): number =>
      Math.hypot(Math.max(left - at.x, 0, at.x - left - width), Math.max(top - at.y, 0, at.y - top - height));
    let best: Spot | undefined;
    for (const one of this.told.spots) if (off(one) < (best ? off(best) : reach)) best = one;
    return best;
  }

  private curve(path: SVGPathElement, name: string): Curve {
    const [left, top, width, height] = this.told.box;
    const drawn = path.getAttribute("d") ?? "";
    const places = [...drawn.matchAll(/[ML] (\S+) (\S+)/g)];
    const x = Float64Array.from(places, (one) => valueAt(this.told.x, (Number(one[1]) - left) / width));
    const y = Float64Array.from(places, (one) => valueAt(this.told.y, 1 - (Number(one[2]) - top) / height));
    return { name, x, y, rising: x.length > 1 && x.every((value, i) => i === 0 || value >= x[i - 1]! - 1e-9 * Math.abs(value)) };
  }

  /** Show the part of x from low to high, and the values that are there. */
  show(low: number, high: number): void {
    this.x = { ...this.told.x, low, high };
    this.y = this.told.y.kind === "linear" ? this.around(low, high) : this.told.y;
    const { told } = this;
    const [left, top, width, height] = told.box;
    const across = (at: number): number => left + width * share(this.x, valueAt(told.x, (at - left) / width));
    const up = (at: number): number => top + height * (1 - share(this.y, valueAt(told.y, 1 - (at - top) / height)));
    for (const one of this.shapes) one.move(across, up, told.box);
    this.scales();
  }

  /** Show all again, as it was drawn. */
  reset(): void {
    this.x = this.told.x;
    this.y = this.told.y;
    for (const one of this.shapes) one.reset();
    for (const one of this.fresh) one.remove();
    this.fresh = [];
    for (const one of this.old()) one.removeAttribute("display");
  }

  private around(low: number, high: number): Axis {
    let [least, most] = [Infinity, -Infinity];
    for (const one of this.curves) {
      one.x.forEach((x, i) => {
        const inside = x >= low && x <= high;
        if (!inside && !(one.x[i + 1]! >= low && x <= high) && !(one.x[i - 1]! <= high && x >= low)) return;
        least = Math.min(least, one.y[i]!);
        most = Math.max(most, one.y[i]!);
      });
    }
    if (!(most > least)) return this.told.y;
    const room = 0.06 * (most - least);
    return { ...this.told.y, low: least - room, high: most + room };
  }

  /** Marks, numbers and grid of both axes. */
  private scales(): void {
    for (const one of this.fresh) one.remove();
    const old = this.old();
    for (const one of old) one.setAttribute("display", "none");
    const numbered = old.some((one) => one.id.includes("xtick") && one.querySelector("text"));
    const [left, top, width, height] = this.told.box;
    const place = document.createElementNS(SVG, "g");
    for (const [value, text] of marks(this.x, 6)) {
      const x = left + width * share(this.x, value);
      place.append(line(x, top, x, top + height));
      if (numbered) place.append(word(x, top + height + 14, text, "middle"));
    }
    for (const [value, text] of this.y === this.told.y ? [] : marks(this.y, 4)) {
      const y = top + height * (1 - share(this.y, value));
      place.append(line(left, y, left + width, y), word(left - 7, y + 3.2, text, "end"));
    }
    this.group.querySelector('g[id*="patch"]')!.after(place); // the ground of the axes, below all curves
    this.fresh = [place];
  }

  private old(): Element[] {
    const kept = this.y === this.told.y ? /(xtick|grid)/ : /(xtick|ytick|grid)/;
    return [...this.group.querySelectorAll("g[id]")].filter((one) => kept.test(one.id.replace(/^.*-/, "")));
  }
}

const MOVED = ":is(path, use, text, g[transform^=translate]):not(defs *, g[transform] *)";
const PAIR = /(-?[\d.]+(?:e[-+]?\d+)?)[ ,](-?[\d.]+(?:e[-+]?\d+)?)/g;

/** Something drawn at values of x, of y or both, as the drawing has it. */
class Shape {
  private readonly was: readonly (readonly [string, string | null])[];

  constructor(
    private readonly element: SVGElement,
    private readonly along: string,
  ) {
    this.was = ["d", "x", "y", "transform", "visibility"].map((name) => [name, element.getAttribute(name)]);
  }

  /** across, up: where a place goes. Words outside of the box are not shown. */
  move(across: (at: number) => number, up: (at: number) => number, [left, top, width, height]: Told["box"]): void {
    this.reset();
    const { element, along } = this;
    const at = (x: string, y: string): [number, number] => [along.includes("x") ? across(Number(x)) : Number(x), along.includes("y") ? up(Number(y)) : Number(y)];
    const pair = (_: string, x: string, y: string): string => at(x, y).map((one) => one.toFixed(2)).join(" ");
    const place = /translate\(([^)]*)\)/.exec(element.getAttribute("transform") ?? "")?.[1];
    let [x, y] = [left, top];
    if (element.hasAttribute("x")) {
      [x, y] = at(element.getAttribute("x")!, element.getAttribute("y")!);
      element.setAttribute("x", String(x));
      element.setAttribute("y", String(y));
      const turned = /rotate\(([-\d.]+)/.exec(element.getAttribute("transform") ?? "");
      if (turned) element.setAttribute("transform", `rotate(${turned[1]} ${x} ${y})`);
    } else if (place) {
      const moved = place.replace(PAIR, pair);
      [x, y] = moved.split(" ").map(Number) as [number, number];
      element.setAttribute("transform", element.getAttribute("transform")!.replace(place, moved));
    } else element.setAttribute("d", (element.getAttribute("d") ?? "").replace(PAIR, pair));
    if (x < left - 1 || x > left + width + 1 || y < top - 1 || y > top + height + 1) element.setAttribute("visibility", "hidden");
  }

  /** As it was drawn. */
  reset(): void {
    for (const [name, value] of this.was) {
      if (value === null) this.element.removeAttribute(name);
      else this.element.setAttribute(name, value);
    }
  }
}

function marks(axis: Axis, count: number): [number, string][] {
  if (axis.kind === "log" && axis.high / axis.low > 30) {
    const found: [number, string][] = [];
    for (let e = Math.ceil(Math.log10(axis.low)); 10 ** e <= axis.high; e++) found.push([10 ** e, decade(e)]);
    return found;
  }
  const values = ticks(axis.low, axis.high, count).filter((one) => axis.kind !== "log" || one > 0);
  return labels(values).map((text, i) => [values[i]!, text]);
}

function line(x1: number, y1: number, x2: number, y2: number): SVGElement {
  const made = document.createElementNS(SVG, "path");
  made.setAttribute("d", `M${x1} ${y1}L${x2} ${y2}`);
  made.setAttribute("style", "fill: none; stroke: color-mix(in srgb, var(--ink) 12%, transparent); stroke-width: 0.5");
  return made;
}

function word(x: number, y: number, text: string, anchor: string): SVGElement {
  const made = document.createElementNS(SVG, "text");
  made.setAttribute("x", String(x));
  made.setAttribute("y", String(y));
  made.setAttribute("style", `font-size: 9px; font-family: Inter, sans-serif; text-anchor: ${anchor}`);
  made.textContent = text;
  return made;
}

/** The part of a drawing with this id, which a report has put the figure's name before. */
function found(group: Element, id: string): Element | undefined {
  return [...group.querySelectorAll("g[id]")].find((one) => one.id === id || one.id.endsWith(`-${id}`));
}
