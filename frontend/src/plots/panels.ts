// The panels that Python asks for, as curves of the flight, the ghost and the wanted path.

import type { PanelData } from "../data/contract";
import { type Flight, difference, shorterWay, unwrapped } from "../data/flight";
import { flat } from "../view/notation";
import { type Curve, DASHES, type Hue, type Panel, type Role } from "./panel";

const HUES: readonly Hue[] = ["blue", "orange", "green", "pink", "vermillion", "sky", "muted", "ink"];

/** Another flight, or a log, that is laid over. */
export interface Overlay {
  readonly name: string;
  readonly role: Role;
  readonly flight: Flight;
}

/** A panel's curves; undefined if the flight has none of its columns. */
export function panelOf(data: PanelData, flight: Flight, overlays: readonly Overlay[]): Panel | undefined {
  const curves: Curve[] = [];
  let flown = 0;
  let wanted = 0;
  for (const line of data.lines) {
    const style = line.dashed ? wanted++ : flown++;
    const add = (of: string, from: Flight, role: Role): void => {
      const signed = valuesOf(from, line.column, line.minus);
      if (!signed) return;
      const { values, label } = data.log ? sizes(signed, line.label) : { values: signed, label: line.label };
      const hue = HUES[style % HUES.length]!;
      curves.push({ label: `${label}${of}`, name: flat(`${label}${of}`), role, hue, dash: DASHES[style % DASHES.length]!, times: from.times, values });
    };
    add("", flight, line.dashed ? "desired" : "flown");
    if (!line.dashed) for (const one of overlays) add(`, ${one.name}`, one.flight, one.role);
  }
  if (!curves.length) return undefined;
  return { id: data.id, title: flat(data.title), note: "", unit: data.unit, logarithmic: data.log && positive(curves), curves };
}

/** Whether all that a panel shows is zero. */
export function isZero(panel: Panel): boolean {
  return !panel.curves.some((curve) => curve.values.some((value) => value !== 0));
}

/** What a logarithmic axis shows of values, and what it is called then. */
export function sizes(values: Float64Array, label: string): { values: Float64Array; label: string } {
  return values.some((value) => value < 0) ? { values: values.map(Math.abs), label: `|${label}|` } : { values, label };
}

function valuesOf(flight: Flight, name: string, minus: string | null): Float64Array | undefined {
  const column = flight.column(name);
  const other = minus === null ? undefined : flight.column(minus);
  if (!column || (minus !== null && !other)) return undefined;
  const off = other && difference(column, other);
  const values = flight.unit(name) === "rad" ? (off?.map(shorterWay) ?? unwrapped(column)) : (off ?? column);
  const from = name.endsWith("_d") && flight.unit(name) === "rad" ? flight.column(name.slice(0, -2)) : undefined; // beside which it is drawn
  const flown = from && unwrapped(from);
  if (flown && !other) return column.map((value, i) => flown[i]! + shorterWay(value - flown[i]!));
  return values;
}

function positive(curves: readonly Curve[]): boolean {
  return curves.some((curve) => curve.values.some((value) => value > 0));
}
