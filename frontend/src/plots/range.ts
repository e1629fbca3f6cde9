// The stretch of time that all plots show, and the range of values of one.

import { Watched } from "../view/events";
import { scaleFor } from "../view/format";
import { extent, indexAt } from "./curve";
import type { Panel } from "./panel";

const LEAST = 1e-9; // in SI units: what is smaller is round-off

export interface Range {
  readonly least: number;
  readonly most: number;
}

/** The stretch of time on the screen; undefined: the whole flight. */
export class TimeWindow {
  readonly zoomed = new Watched<Range | undefined>(undefined);
  private whole: Range = { least: 0, most: 1 };

  get range(): Range {
    return this.zoomed.value ?? this.whole;
  }

  setWhole(end: number): void {
    this.whole = { least: 0, most: end };
    const zoomed = this.zoomed.value;
    if (zoomed && (zoomed.least >= end || zoomed.most > end)) this.zoomed.set(undefined);
  }

  /** Show this stretch; one that is empty or beyond the flight shows what it can. */
  zoom(least: number, most: number): void {
    const low = Math.max(Math.min(least, most), this.whole.least);
    const high = Math.min(Math.max(least, most), this.whole.most);
    if (!(high - low > (this.whole.most - this.whole.least) * 1e-4)) return;
    const everything = low <= this.whole.least && high >= this.whole.most;
    this.zoomed.set(everything ? undefined : { least: low, most: high });
  }

  /** Closer (factor < 1) or further away, with time t staying where it is. */
  zoomAbout(t: number, factor: number): void {
    const { least, most } = this.range;
    this.zoom(t - (t - least) * factor, t + (most - t) * factor);
  }

  reset(): void {
    this.zoomed.set(undefined);
  }
}

/** Least and greatest value of a panel in a stretch of time, with a little air. Exponents of ten if logarithmic. */
export function valueRange(panel: Panel, time: Range): Range {
  let low = Infinity;
  let high = -Infinity;
  for (const curve of panel.curves) {
    const first = panel.across ? 0 : indexAt(curve.times, time.least);
    const last = panel.across ? curve.times.length : indexAt(curve.times, time.most) + 1;
    const values = panel.logarithmic ? curve.values.map((v) => (v > 0 ? Math.log10(v) : Number.NaN)) : curve.values;
    const found = extent(values, first, last);
    if (!found) continue;
    low = Math.min(low, found[0]);
    high = Math.max(high, found[1]);
  }
  if (low > high) return { least: 0, most: 1 };
  if (panel.logarithmic) return { least: Math.max(low, high - 12) - 0.2, most: high + 0.2 };
  const size = Math.max(Math.abs(low), Math.abs(high));
  const constant = high - low <= size * 1e-9;
  const span = constant ? size * 0.2 || 2 / scaleFor(panel.unit, 0).factor : Math.max(high - low, size * 1e-3, LEAST);
  const middle = (low + high) / 2;
  return { least: middle - span * 0.56, most: middle + span * 0.56 };
}

/** Largest size of a panel's values over the whole flight, for its unit's prefix. */
export function largest(panel: Panel): number {
  let size = 0;
  for (const curve of panel.curves) {
    const found = extent(curve.values, 0, curve.values.length - 1);
    if (found) size = Math.max(size, Math.abs(found[0]), Math.abs(found[1]));
  }
  return size;
}
