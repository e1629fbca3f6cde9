// One plot drawn on any surface: frame, ticks, curves.

import type { Scale } from "../view/format";
import type { Palette } from "../view/theme";
import { indexAt, trace } from "./curve";
import { type Panel, strokeOf } from "./panel";
import type { Range } from "./range";
import type { Box, Surface } from "./surface";
import { decade, decades, labels, ticks } from "./ticks";

export interface Frame {
  readonly box: Box;
  readonly time: Range;
  readonly value: Range;
  readonly scale: Scale;
}

/** The part of a picture this large that curves are drawn in. */
export function plotBox(width: number, height: number, top = 6): Box {
  const left = 48;
  return { left, top, width: Math.max(width - left - 10, 10), height: Math.max(height - top - 20, 10) };
}

export function xOf(frame: Frame, t: number, panel?: Panel): number {
  const { box, time } = frame;
  if (panel?.across?.logarithmic) t = t > 0 ? Math.log10(t) : time.least;
  return box.left + ((t - time.least) / (time.most - time.least)) * box.width;
}

export function timeAt(frame: Frame, x: number): number {
  const { box, time } = frame;
  return time.least + ((x - box.left) / box.width) * (time.most - time.least);
}

/** Pixels down from the top for a value of the panel in SI. */
export function yOf(panel: Panel, frame: Frame, value: number): number {
  const { box, value: range } = frame;
  const v = panel.logarithmic ? (value > 0 ? Math.log10(value) : range.least) : value;
  return box.top + box.height * (1 - (v - range.least) / (range.most - range.least));
}

export function drawFigure(surface: Surface, panel: Panel, frame: Frame, palette: Palette): void {
  const { box, time } = frame;
  const shade = xOf(frame, panel.uncounted ?? time.least) - box.left;
  if (shade > 0) surface.rectangle({ ...box, width: Math.min(shade, box.width) }, palette.muted, 0.14);
  drawAxes(surface, panel, frame, palette);
  const mapping = {
    x: (t: number): number => xOf(frame, t, panel),
    turn: panel.unit === "rad" ? Math.PI : Infinity,
    y: (v: number): number => (Number.isFinite(v) ? yOf(panel, frame, v) : Number.NaN),
  };
  surface.clipped({ ...box, top: box.top - 2, height: box.height + 4 }, () => {
    const order = { desired: 0, kept: 1, file: 2, ghost: 3, flown: 4 };
    for (const curve of [...panel.curves].sort((a, b) => order[a.role] - order[b.role])) {
      const first = panel.across ? 0 : indexAt(curve.times, time.least) - 1;
      const last = panel.across ? curve.times.length : indexAt(curve.times, time.most) + 1;
      surface.polyline(trace(curve.times, curve.values, first, last, mapping), strokeOf(curve, palette));
    }
  });
}

function drawAxes(surface: Surface, panel: Panel, frame: Frame, palette: Palette): void {
  const { box, time, value, scale } = frame;
  const grid = { colour: palette.grid, width: 1, dash: [] };
  const small = { colour: palette.muted, size: 11 };
  const right = box.left + box.width;
  const bottom = box.top + box.height;

  const marks = panel.logarithmic
    ? decades(value.least, value.most, box.height / 26).map((e) => ({ at: e, label: decade(e) }))
    : linearMarks(value, scale.factor, box.height / 26);
  for (const mark of marks) {
    const y = Math.round(box.top + box.height * (1 - (mark.at - value.least) / (value.most - value.least))) + 0.5;
    surface.polyline([box.left, y, right, y], grid);
    surface.text(box.left - 7, y, mark.label, { ...small, size: mark.label.length > 6 ? 9 : 11, align: "right" }); // −1.5×10⁻⁴ fits
  }

  const { across } = panel;
  const times = across?.logarithmic ? decades(time.least, time.most, box.width / 70) : ticks(time.least, time.most, box.width / 70);
  const names = across?.logarithmic ? times.map(decade) : labels(times);
  times.forEach((t, i) => {
    const x = Math.round(xOf(frame, t)) + 0.5;
    surface.polyline([x, bottom, x, bottom + 4], { ...grid, colour: palette.line });
    const last = i === times.length - 1;
    const beside = last ? ` ${across ? across.label : "s"}` : "";
    surface.text(Math.min(x, right - 2), bottom + 12, `${names[i]}${beside}`, { ...small, align: last && across ? "right" : "center" });
  });
  surface.polyline([box.left, bottom + 0.5, right, bottom + 0.5], { ...grid, colour: palette.line });
}

function linearMarks(value: Range, factor: number, count: number): { at: number; label: string }[] {
  const [least, most] = [value.least * factor, value.most * factor];
  const usual = ticks(least, most, count);
  const found = usual.length > 2 ? usual : ticks(least, most, count * 2);
  const names = labels(found);
  return found.map((v, i) => ({ at: v / factor, label: names[i]! }));
}
