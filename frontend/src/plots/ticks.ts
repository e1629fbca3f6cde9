// Round numbers along an axis.

import { powerOfTen, scientific } from "../view/format";

/** About `count` round numbers between least and most. */
export function ticks(least: number, most: number, count: number): number[] {
  const step = roundStep((most - least) / Math.max(count, 1));
  if (!(step > 0) || !Number.isFinite(step)) return [];
  const found: number[] = [];
  const first = Math.ceil(least / step - 1e-9);
  for (let i = first; i * step <= most + 1e-9 * step && found.length < 50; i++) found.push(i * step);
  return found;
}

/** 1, 2 or 5 times a power of ten, at least x. */
export function roundStep(x: number): number {
  const power = 10 ** Math.floor(Math.log10(x));
  const leading = x / power;
  return power * (leading <= 1 ? 1 : leading <= 2 ? 2 : leading <= 5 ? 5 : 10);
}

/** Powers of ten between exponents, thinned out to about `count`. */
export function decades(least: number, most: number, count: number): number[] {
  const step = Math.max(1, Math.ceil((most - least) / Math.max(count, 1)));
  const found: number[] = [];
  for (let e = Math.ceil(least / step) * step; e <= most; e += step) found.push(e);
  return found;
}

/** The labels of evenly spaced numbers: all with the same decimals. */
export function labels(values: readonly number[]): string[] {
  const step = values.length > 1 ? Math.abs(values[1]! - values[0]!) : Math.abs(values[0] ?? 1) || 1;
  const largest = Math.max(...values.map(Math.abs), 0);
  if (largest >= 1e5 || (largest > 0 && largest < 1e-3)) return values.map((v) => (Math.abs(v) < step * 1e-6 ? "0" : scientific(v, below(v, step))));
  const decimals = Math.min(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0), 8);
  return values.map((value) => minus((Math.abs(value) < step * 1e-6 ? 0 : value).toFixed(decimals)));
}

/** A decade's label. */
export function decade(e: number): string {
  return e >= 0 && e <= 3 ? String(10 ** e) : powerOfTen(e);
}

/** Decimals that the factor of v needs to tell it from a neighbour: decades between it and the step. */
function below(v: number, step: number): number {
  return Math.max(Math.floor(Math.log10(Math.abs(v)) + 1e-9) - Math.floor(Math.log10(step) + 1e-9), 0);
}

function minus(text: string): string {
  return text.replace(/-/g, "−");
}
