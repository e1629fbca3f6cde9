// Plots that the reader puts together: columns over time, their spectra, or one against another.

import type { Flight } from "../data/flight";
import type { Log } from "../logs/log";
import { flat } from "../view/notation";
import { plainUnit } from "../view/format";
import { type Curve, DASHES, type Hue, type Panel, type Role } from "./panel";
import type { Overlay } from "./panels";
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
      const label = signal.name ? `${columns[i]}, ${signal.name}` : columns[i]!;
      const shown = logarithmic && kind === "time" ? values.map(Math.abs) : values;
      return { label, name: flat(label), role: signal.role, hue: HUES[i % HUES.length]!, dash: DASHES[i % DASHES.length]!, times, values: shown };
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
  const curves = ys.flatMap((y): Curve[] => {
    const x = xs.find((one) => one.role === y.role);
    if (!x) return [];
    const count = Math.min(x.values.length, y.values.length);
    return [{ label: y.name || custom.columns[1]!, name: flat(y.name || custom.columns[1]!), role: y.role, hue: "blue", dash: DASHES[0]!, times: x.values.subarray(0, count), values: y.values.subarray(0, count), clock: y.times }];
  });
  const all = curves.flatMap(({ times }) => [times.reduce((a, b) => Math.min(a, b), Infinity), times.reduce((a, b) => Math.max(a, b), -Infinity)]).filter(Number.isFinite);
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

function signals(name: string, flight: Flight, overlays: readonly Overlay[], log: Log | undefined): Signal[] {
  const of = (from: Flight, role: Role, called: string): Signal[] => {
    const values = from.column(name);
    return values ? [{ unit: from.unit(name), times: from.times, values, role, name: called }] : [];
  };
  const own = of(flight, "flown", "");
  const series = log?.series.find((one) => one.name === name);
  const role = own.length ? "file" : "flown"; // a signal of the log alone is what is drawn
  return [...own, ...overlays.flatMap((one) => of(one.flight, one.role, one.name)), ...(series ? [{ ...series, role, name: own.length ? log!.name : "" } as Signal] : [])];
}
