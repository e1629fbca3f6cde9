// Plots that the reader puts together: columns over time, their spectra, or one against another.

import type { Flight } from "../data/flight";
import type { Log } from "../logs/log";
import { flat } from "../view/notation";
import { plainUnit } from "../view/format";
import { extent, indexAt } from "./curve";
import { type Curve, DASHES, type Hue, type Panel, type Role } from "./panel";
import { type Overlay, sizes } from "./panels";
import { spectrum } from "./spectrum";

export type Kind = "time" | "spectrum" | "phase";

export interface Custom {
  readonly id: string;
  readonly kind: Kind;
  /** Columns of the flight, or signals of the log; of a phase portrait the first is across. */
  readonly columns: readonly string[];
  readonly logarithmic: boolean;
}

interface Signal {
  readonly unit: string;
  readonly times: Float64Array;
  readonly values: Float64Array;
  readonly role: Role;
  readonly name: string;
  /** Where it is from: a flight as it is laid over, or the log. */
  readonly of: Role;
}

const HUES: readonly Hue[] = ["blue", "orange", "green", "pink", "vermillion", "sky", "muted", "ink"];

/** Every column that can be drawn: the flight's, then the log's. */
export function drawable(flight: Flight, log: Log | undefined): { name: string; unit: string; of: "flight" | "log" }[] {
  const own = flight.names.flatMap((name, i) => (name === "t" ? [] : [{ name, unit: flight.units[i] ?? "", of: "flight" as const }]));
  const theirs = (log?.series ?? []).filter(({ name }) => !flight.has(name)).map(({ name, unit }) => ({ name, unit, of: "log" as const }));
  return [...own, ...theirs];
}

/** undefined: nothing of it is there now. */
export function customPanel(custom: Custom, flight: Flight, overlays: readonly Overlay[], log: Log | undefined): Panel | undefined {
  const { kind, columns, id, logarithmic } = custom;
  const found = columns.map((name) => signals(name, flight, overlays, log));
  const units = [...new Set(found.flat().map(({ unit }) => plainUnit(unit)))];
  const names = columns.map(flat).join(", ");
  if (!found.some((one) => one.length)) return undefined;
  if (kind === "phase") return phase(custom, found);
  const curves = found.flatMap((all, i) =>
    all.map((signal): Curve => {
      const { times, values } = kind === "spectrum" ? spectrum(signal.times, signal.values) : signal;
      const shown = logarithmic && kind === "time" ? sizes(values, columns[i]!) : { values, label: columns[i]! };
      const label = signal.name ? `${shown.label}, ${signal.name}` : shown.label;
      return { label, name: flat(label), role: signal.role, hue: HUES[i % HUES.length]!, dash: DASHES[i % DASHES.length]!, times, values: shown.values };
    }),
  );
  const unit = units.length === 1 ? units[0]! : "";
  const able = logarithmic && curves.some((curve) => curve.values.some((value) => value > 0));
  const base = { id, title: kind === "spectrum" ? `Spectrum of ${names}` : names, note: "", unit, logarithmic: able, curves };
  if (kind === "time") return base;
  const frequencies = curves.flatMap(({ times }) => (times.length > 1 ? [times[1]!, times[times.length - 1]!] : []));
  const [least, most] = [Math.min(...frequencies), Math.max(...frequencies)];
  if (!(most > least)) return undefined;
  const across = { label: "Hz", logarithmic: true, range: { least: Math.log10(least), most: Math.log10(most) } };
  return { ...base, note: "Amplitude over frequency, with the mean removed and a Hann window.", across };
}

function phase(custom: Custom, [xs = [], ys = []]: Signal[][]): Panel | undefined {
  const alike = ys.flatMap((y) => xs.filter((one) => one.of === y.of).map((x) => [x, y] as const));
  const [x0, y0] = [xs[0], ys[0]];
  // What the log alone has, over what the flight alone has, or the other way round.
  const pairs = alike.length || !x0 || !y0 ? alike : [[x0, y0] as const];
  const curves = pairs.map(([x, y]): Curve => {
    const label = y.name || custom.columns[1]!;
    return { label, name: flat(label), role: y.role, hue: "blue", dash: DASHES[0]!, times: sampled(x, y.times), values: y.values, clock: y.times };
  });
  const all = curves.flatMap(({ times }) => extent(times, 0, times.length) ?? []);
  if (!all.length) return undefined;
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const air = 0.06 * (high - low || Math.abs(high) || 1);
  const [across = "", up = ""] = custom.columns.map(flat);
  const unit = plainUnit(xs[0]?.unit ?? "");
  return {
    id: custom.id, title: `${up} over ${across}`, note: "", unit: plainUnit(ys[0]?.unit ?? ""), logarithmic: false, curves,
    across: { label: unit ? `${across} [${unit}]` : across, logarithmic: false, range: { least: low - air, most: high + air } },
  };
}

/** A signal at other times, straight between its own; NaN where it has none. */
function sampled({ times, values }: Signal, at: Float64Array): Float64Array {
  if (times === at) return values;
  return at.map((t) => {
    const i = indexAt(times, t);
    const [before, after] = [times[i]!, times[i + 1]];
    if (t < before || (after === undefined && t > before)) return Number.NaN;
    return t === before ? values[i]! : values[i]! + ((values[i + 1]! - values[i]!) * (t - before)) / (after! - before);
  });
}

function signals(name: string, flight: Flight, overlays: readonly Overlay[], log: Log | undefined): Signal[] {
  const of = (from: Flight, role: Role, called: string): Signal[] => {
    const values = from.column(name);
    return values ? [{ unit: from.unit(name), times: from.times, values, role, name: called, of: role }] : [];
  };
  const own = of(flight, "flown", "");
  const laid = overlays.flatMap((one) => of(one.flight, one.role, one.name));
  if (own.length) return [...own, ...laid];
  const series = log?.series.find((one) => one.name === name);
  return [...laid, ...(series ? [{ ...series, role: "flown", name: "", of: "file" } as const] : [])]; // what is drawn is the log's alone
}
