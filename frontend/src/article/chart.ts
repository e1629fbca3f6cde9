// Plots as SVG text: the same text is the live figure and, taken once, the still one.

import { labels, ticks } from "../plots/ticks";

export type Span = readonly [number, number];

/** Where a plot stands in its drawing [px]. */
export interface Box {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

/** A drawing less wide [px] has room for one thing in a line. */
export const NARROW = 440;

/** A curve with what is written beside it. */
export interface Named {
  readonly ys: ArrayLike<number>;
  readonly said: string;
  readonly look: string;
  readonly symbol?: string;
}

const px = (value: number): string => String(Math.round(value * 10) / 10);

export class Plot {
  constructor(readonly box: Box, readonly xs: Span, readonly ys: Span) {}

  x(value: number): number {
    return ((value - this.xs[0]) / (this.xs[1] - this.xs[0])) * this.box.width;
  }

  y(value: number): number {
    return (1 - (value - this.ys[0]) / (this.ys[1] - this.ys[0])) * this.box.height;
  }

  /** The values at a place of the drawing. */
  at(left: number, top: number): readonly [number, number] {
    const { box } = this;
    const x = this.xs[0] + ((left - box.left) / box.width) * (this.xs[1] - this.xs[0]);
    return [x, this.ys[1] - ((top - box.top) / box.height) * (this.ys[1] - this.ys[0])];
  }

  /** Grid, numbers and names of the axes, and inside them what is drawn. */
  framed(xName: string, yName: string, ...inside: string[]): string {
    const { left, top, width, height } = this.box;
    const across = ticks(this.xs[0], this.xs[1], Math.max(2, Math.floor(width / 90)));
    const many = Math.max(2, Math.floor(height / (height > 200 ? 56 : 22)));
    const few = ticks(this.ys[0], this.ys[1], many);
    const up = few.length > 1 ? few : ticks(this.ys[0], this.ys[1], 2 * many); // one number gives no scale
    const [names, heights] = [labels(across), labels(up)];
    const grid = [
      ...across.map((v, i) => `<path class="grid" d="M${px(left + this.x(v))} ${px(top)}v${px(height)}"/><text class="tick" text-anchor="middle" x="${px(left + this.x(v))}" y="${px(top + height + 15)}">${names[i]}</text>`),
      ...up.map((v, i) => `<path class="grid" d="M${px(left)} ${px(top + this.y(v))}h${px(width)}"/><text class="tick" text-anchor="end" x="${px(left - 6)}" y="${px(top + this.y(v) + 4)}">${heights[i]}</text>`),
    ];
    const said = `<text class="axis" x="${px(left)}" y="${px(top - 7)}">${low(yName)}</text>`;
    const below = xName ? `<text class="axis" text-anchor="end" x="${px(left + width)}" y="${px(top + height + 30)}">${low(xName)}</text>` : "";
    return `${grid.join("")}${said}${below}<svg x="${px(left)}" y="${px(top)}" width="${px(width)}" height="${px(height)}" overflow="hidden">${inside.join("")}</svg>`;
  }

  /** A line through points. look: classes; symbol: which formula lights it up. */
  line(xs: ArrayLike<number>, ys: ArrayLike<number>, look: string, symbol = ""): string {
    const parts = this.#points(xs, ys, 1);
    return parts.length ? `<path class="curve ${look}"${lit(symbol)} d="M${parts.join("L")}"/>` : "";
  }

  /** The area between two curves. */
  area(xs: ArrayLike<number>, low: ArrayLike<number>, high: ArrayLike<number>, look: string, symbol = ""): string {
    const edges = [...this.#points(xs, low, 2), ...this.#points(xs, high, 2).reverse()];
    return edges.length ? `<path class="area ${look}"${lit(symbol)} d="M${edges.join("L")}Z"/>` : "";
  }

  /** A curve's points as far as it is finite, the first, the last and those between that are so far apart [px]. */
  #points(xs: ArrayLike<number>, ys: ArrayLike<number>, apart: number): string[] {
    const parts: string[] = [];
    let [left, top] = [-Infinity, 0];
    for (let i = 0; i < xs.length && Number.isFinite(ys[i]!); i++) {
      const [x, y] = [this.x(xs[i]!), Math.min(Math.max(this.y(ys[i]!), -999), 9999)];
      const last = i === xs.length - 1 || !Number.isFinite(ys[i + 1]!);
      if (!last && Math.abs(x - left) < apart && Math.abs(y - top) < apart) continue;
      parts.push(`${px(x)} ${px(y)}`);
      [left, top] = [x, y];
    }
    return parts;
  }

  dot(x: number, y: number, look: string, symbol = "", radius = 4): string {
    return `<circle class="dot ${look}"${lit(symbol)} cx="${px(this.x(x))}" cy="${px(this.y(y))}" r="${radius}"/>`;
  }

  upright(x: number): string {
    return `<path class="cursor" d="M${px(this.x(x))} 0V${px(this.box.height)}"/>`;
  }

  level(y: number): string {
    return `<path class="zero" d="M0 ${px(this.y(y))}H${px(this.box.width)}"/>`;
  }

  /** What a curve is, written beside it; above it or below. */
  label(x: number, y: number, said: string, look: string, symbol = "", above = true): string {
    const [left, top] = [this.x(x), Math.min(Math.max(this.y(y) + (above ? -8 : 17), 13), this.box.height - 5)];
    return text(Math.max(Math.min(left, this.box.width - 7 * said.length), 2), top, said, `label ${look}`, "start", symbol);
  }

  /** What each of two curves is, where they are farthest apart between two shares of the axis. */
  labels(xs: ArrayLike<number>, curves: readonly [Named, Named], from = 0.03, to = 0.7): string {
    const [a, b] = curves;
    const gap = (i: number): number => Math.abs(this.y(a.ys[i]!) - this.y(b.ys[i]!));
    let at = -1;
    for (let i = 0; i < xs.length; i++) if (this.x(xs[i]!) >= from * this.box.width && this.x(xs[i]!) <= to * this.box.width && !(gap(i) <= gap(at))) at = i;
    if (at < 0) return "";
    if (gap(at) < 24) at = Math.round(0.45 * (xs.length - 1)); // they are one line anywhere
    const upper = a.ys[at]! >= b.ys[at]!;
    return [a, b].map(({ ys, said, look, symbol }, i) => this.label(xs[at]!, ys[at]!, said, look, symbol, (i === 0) === upper)).join("");
  }
}

/** The attribute by which a formula finds what it lights up. */
export function lit(symbol: string): string {
  return symbol ? ` data-s="${symbol}"` : "";
}

export function svg(width: number, height: number, ...inside: string[]): string {
  return `<svg viewBox="0 0 ${px(width)} ${px(height)}" width="${px(width)}" height="${px(height)}">${inside.join("")}</svg>`;
}

export function arrow(x0: number, y0: number, x1: number, y1: number, look: string, symbol = ""): string {
  const [dx, dy] = [x1 - x0, y1 - y0];
  const length = Math.hypot(dx, dy);
  if (length < 1) return "";
  const [ux, uy, head] = [dx / length, dy / length, Math.min(9, length)];
  const [bx, by] = [x1 - ux * head, y1 - uy * head];
  const tip = `${px(x1)} ${px(y1)}L${px(bx - uy * head * 0.42)} ${px(by + ux * head * 0.42)}L${px(bx + uy * head * 0.42)} ${px(by - ux * head * 0.42)}Z`;
  return `<g class="arrow ${look}"${lit(symbol)}><path class="shaft" d="M${px(x0)} ${px(y0)}L${px(bx)} ${px(by)}"/><path class="head" d="M${tip}"/></g>`;
}

/** What stands after an underscore is set low. */
function low(said: string): string {
  return said.replace(/_([\p{L}\d]+)([^_]*)/gu, '<tspan class="low" dy="3">$1</tspan><tspan dy="-3">$2</tspan>');
}

export function text(x: number, y: number, said: string, look = "", anchor = "start", symbol = ""): string {
  return `<text class="note ${look}"${lit(symbol)} text-anchor="${anchor}" x="${px(x)}" y="${px(y)}">${low(said)}</text>`;
}

/** What colours and strokes mean, from left to right and in as many lines as it takes: markup and height [px]. */
export function keys(left: number, top: number, width: number, all: readonly (readonly [said: string, look: string, symbol: string])[]): readonly [string, number] {
  let [x, y] = [left, top];
  const parts = all.map(([said, look, symbol]) => {
    const wide = 24 + 6.6 * said.replaceAll("_", "").length;
    if (x > left && x + wide > width) [x, y] = [left, y + 19];
    const mark = look.startsWith("area") ? `<rect class="${look}"${lit(symbol)} x="${px(x)}" y="${px(y - 10)}" width="13" height="11"/>` : `<path class="curve ${look}"${lit(symbol)} d="M${px(x)} ${px(y - 4)}h15"/>`;
    const made = mark + text(x + 19, y, said, "c-ink", "start", symbol);
    x += wide + 12;
    return made;
  });
  return [parts.join(""), y - top + 19];
}

/** The least and the most of some columns, within limits and at least so far apart, with a margin, room for labels if more. */
export function span(columns: readonly ArrayLike<number>[], least: number, most: number, apart: number, room = 0.06): Span {
  let [low, high] = [Infinity, -Infinity];
  for (const column of columns) for (const value of Array.from(column)) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (low > high) return [-apart, apart];
  [low, high] = [Math.max(low, least), Math.min(high, most)];
  const extra = Math.max(room * (high - low), (apart - (high - low)) / 2);
  return [low - extra, high + extra];
}
