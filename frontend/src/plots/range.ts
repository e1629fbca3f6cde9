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
  whole: Range = { least: 0, most: 1 };

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
  const { least: low, most: high } = calm(panel, time) ?? reached(panel, time);
  if (low > high) return { least: 0, most: 1 };
  if (panel.logarithmic) return { least: Math.max(low, high - 12) - 0.2, most: high + 0.2 };
  const size = Math.max(Math.abs(low), Math.abs(high));
  const constant = high - low <= size * 1e-9;
  const span = constant ? size * 0.2 || 2 / scaleFor(panel.unit, 0).factor : Math.max(high - low, size * 1e-3, LEAST);
  const middle = (low + high) / 2;
  return { least: middle - span * 0.56, most: middle + span * 0.56 };
}

/** What the curves reach in a stretch of time. */
function reached(panel: Panel, time: Range): Range {
  const found = panel.curves.flatMap((curve) => {
    const first = panel.across ? 0 : indexAt(curve.times, time.least);
    const last = panel.across ? curve.times.length : indexAt(curve.times, time.most) + 1;
    const values = panel.logarithmic ? curve.values.map((v) => (v > 0 ? Math.log10(v) : Number.NaN)) : curve.values;
    return [extent(values, first, last) ?? []].flat();
  });
  return { least: Math.min(...found), most: Math.max(...found) };
}

/** Of a flight that is lost in a stretch of time, what it reached before the last tenth, with room, if its end would dwarf that; else undefined. */
export function calm(panel: Panel, time: Range): Range | undefined {
  const { lost } = panel;
  if (lost === undefined || panel.logarithmic || panel.across || lost <= time.least || lost > time.most) return undefined;
  const before = reached(panel, { least: time.least, most: lost - 0.1 * (lost - time.least) });
  const [all, span] = [reached(panel, time), before.most - before.least];
  return span > LEAST && all.most - all.least > 4 * span ? { least: before.least - 0.3 * span, most: before.most + 0.3 * span } : undefined;
}

/** Largest size of a panel's values over the whole flight, for its unit's prefix. */
export function largest(panel: Panel): number {
  const whole = { least: 0, most: Infinity };
  const { least, most } = calm(panel, whole) ?? reached({ ...panel, logarithmic: false }, whole);
  return least > most ? 0 : Math.max(Math.abs(least), Math.abs(most));
}
