// A curve's points on the screen: never more than the eye can tell apart, and no peak lost.

/** From data to pixels along both axes; `y` gives NaN for what cannot be shown. */
export interface Mapping {
  readonly x: (t: number) => number;
  readonly y: (value: number) => number;
  /** A larger step from sample to sample is that of an angle to the other end of its range, and no line is drawn. */
  readonly turn: number;
}

/**
 * Pixels (x0, y0, x1, y1, ...) of values over times from index `first` to `last` inclusive. Where many samples share a
 * column of pixels, the first, least, greatest and last of them stand for all.
 */
export function trace(
  times: ArrayLike<number>,
  values: ArrayLike<number>,
  first: number,
  last: number,
  mapping: Mapping,
): number[] {
  const out: number[] = [];
  let column = Number.NaN;
  let entry = 0;
  let low = 0;
  let high = 0;
  let leave = 0;
  const flush = (): void => {
    if (Number.isNaN(column)) return;
    if (high - low < 0.5) return void out.push(column, (low + high) / 2); // pixels, which nobody tells apart
    out.push(column, entry);
    if (low !== entry) out.push(column, low);
    if (high !== low) out.push(column, high);
    if (leave !== high) out.push(column, leave);
  };
  for (let i = Math.max(first, 0); i <= last && i < times.length; i++) {
    const x = Math.round(mapping.x(times[i]!) * 2) / 2;
    const y = mapping.y(values[i]!);
    if (i > first && Math.abs(values[i]! - values[i - 1]!) > mapping.turn) {
      flush();
      out.push(x, Number.NaN);
      column = Number.NaN;
    }
    if (x !== column || Number.isNaN(y) !== Number.isNaN(entry)) {
      flush();
      column = x;
      entry = low = high = leave = y;
    } else {
      low = Math.min(low, y);
      high = Math.max(high, y);
      leave = y;
    }
  }
  flush();
  return thinned(out);
}

const SEEN = 0.1; // pixels by which a line may be off

/** The same line in fewer points: one is left out where the straight line between those before and after it passes it by less than is seen. */
function thinned(points: readonly number[]): number[] {
  const out: number[] = [];
  let [low, high] = [-Infinity, Infinity]; // slopes from the last point kept that pass all points left out since
  for (let i = 0; i < points.length; i += 2) {
    const [x, y] = [points[i]!, points[i + 1]!];
    const [across, up] = [x - out[out.length - 2]!, y - out[out.length - 1]!]; // NaN at the first, and where there is a gap
    const [nextX, nextY] = [points[i + 2]!, points[i + 3]!];
    if (across > 0 && nextX > x) {
      low = Math.max(low, (up - SEEN) / across);
      high = Math.min(high, (up + SEEN) / across);
      const slope = (nextY - out[out.length - 1]!) / (nextX - out[out.length - 2]!);
      if (slope >= low && slope <= high) continue;
    }
    out.push(x, y);
    [low, high] = [-Infinity, Infinity];
  }
  return out;
}

/** Index of the last time that is not after t; 0 before the first. Times ascend. */
export function indexAt(times: ArrayLike<number>, t: number): number {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle]! <= t) low = middle;
    else high = middle - 1;
  }
  return Math.max(low, 0);
}

/** Least and greatest finite value of a stretch; undefined if there is none. */
export function extent(values: ArrayLike<number>, first: number, last: number): [number, number] | undefined {
  let low = Infinity;
  let high = -Infinity;
  for (let i = Math.max(first, 0); i <= last && i < values.length; i++) {
    const value = values[i]!;
    if (!Number.isFinite(value)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : undefined;
}
