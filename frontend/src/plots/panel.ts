// What a plot shows: curves over time with names, units and strokes.

import type { Palette } from "../view/theme";
import { indexAt } from "./curve";

export type Hue = "blue" | "orange" | "green" | "vermillion" | "pink" | "sky" | "ink" | "muted";

/** Flown: a thin line. Desired: the pale band it should stay on. Ghost: the other controller, dotted. Kept: an earlier flight, faint. File: a log that was opened. */
export type Role = "flown" | "desired" | "ghost" | "kept" | "file";

export interface Curve {
  /** As quadstep logs it, and as it can stand on a canvas. */
  readonly label: string;
  readonly name: string;
  readonly role: Role;
  readonly hue: Hue;
  readonly dash: readonly number[];
  readonly times: Float64Array;
  readonly values: Float64Array;
  /** Where `times` are not times: those of the points. */
  readonly clock?: Float64Array;
}

export interface Panel {
  readonly id: string;
  readonly title: string;
  readonly note: string;
  readonly unit: string;
  readonly logarithmic: boolean;
  readonly curves: readonly Curve[];
  /** Until when errors do not count [s]. */
  readonly uncounted?: number;
  /** When the flight was lost [s]. */
  readonly lost?: number;
  /** What runs across, if not time; of a logarithmic range the exponents of ten. */
  readonly across?: { readonly label: string; readonly logarithmic: boolean; readonly range: { readonly least: number; readonly most: number } };
}

export const SOLID: readonly number[] = [];
export const DASHES: readonly (readonly number[])[] = [SOLID, [7, 3], [2, 2.5], [9, 3, 2, 3], [12, 3], [4, 2], [1, 2], [6, 2, 1, 2]];
const GHOST: readonly number[] = [1.5, 3.5];
const FILE: readonly number[] = [10, 3, 1.5, 3];

/** How a curve is drawn. */
export function strokeOf(curve: Curve, palette: Palette): { colour: string; width: number; dash: readonly number[]; opacity: number } {
  const colour = palette[curve.hue];
  if (curve.role === "desired") return { colour, width: 5, dash: SOLID, opacity: palette.dark ? 0.34 : 0.26 };
  if (curve.role === "ghost") return { colour, width: 1.5, dash: GHOST, opacity: 0.85 };
  if (curve.role === "kept") return { colour, width: 1.2, dash: SOLID, opacity: 0.5 };
  if (curve.role === "file") return { colour, width: 1.3, dash: FILE, opacity: 0.95 };
  return { colour, width: 1.6, dash: curve.dash, opacity: 1 };
}

/** What a curve is at time t, at the sample before it; NaN beyond its end: a flight that is lost ends up to a sample after its last row. */
export function valueAt(curve: Curve, t: number): number {
  const [before, last] = [curve.times[curve.times.length - 2], curve.times[curve.times.length - 1]];
  if (last === undefined || t > last + (last - (before ?? last)) + 1e-9) return Number.NaN;
  return curve.values[indexAt(curve.times, t)]!;
}
