// What a plot is drawn on: the screen's canvas or an SVG document, through one small set of strokes.

import type { Piece } from "../view/notation";

export interface Stroke {
  readonly colour: string;
  readonly width: number;
  readonly dash: readonly number[];
  readonly opacity?: number;
}

export interface Lettering {
  readonly colour: string;
  readonly size: number;
  readonly align: "left" | "center" | "right";
  readonly weight?: number;
}

export interface Box {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

export interface Surface {
  /** A line through points (x0, y0, x1, y1, ...); NaN lifts the pen. */
  polyline(points: ArrayLike<number>, stroke: Stroke): void;
  rectangle(box: Box, fill: string, opacity?: number): void;
  circle(x: number, y: number, radius: number, fill: string, ring: string): void;
  /** Pieces are set from the left, those that are low as subscripts. */
  text(x: number, y: number, text: string | readonly Piece[], lettering: Lettering): void;
  /** Draw with everything outside the box cut off. */
  clipped(box: Box, draw: () => void): void;
}

/** Of a subscript: its size, and how far below the line it stands, in sizes of the line's letters. */
export const LOW = { size: 0.72, drop: 0.26 };

export const FONT = 'Inter, system-ui, -apple-system, "Segoe UI", sans-serif';
