// What Python tells the article (src/quadstep/proofs/article/__init__.py), and its one law, which flies every figure.

import type { LawCode, Ticks } from "../data/contract";
import { doubles } from "../data/packed";

interface Data {
  readonly links?: readonly { readonly label: string; readonly href: string }[];
  readonly names: readonly string[];
  readonly starts: readonly string[];
  readonly columns: readonly (readonly [name: string, unit: string])[];
  /** Names of the numbers that the law shows beside its log. */
  readonly shown: readonly string[];
  readonly neurons: number;
  readonly outcomes: readonly string[];
  readonly flights: Readonly<Record<string, { readonly parameters: string; readonly start: string; readonly ticks: Readonly<Ticks> }>>;
}

/** Between the times that can be chosen [s]: a whole number of rows of any figure's log. */
export const TIME_STEP = 0.02;

type Triple = readonly [number, number, number];

/** Functions of the package that figures call by themselves. */
export interface Tools {
  /** Thrust, pitch and roll that make a force (Eqs 40 to 52). */
  invert(x: number, y: number, z: number): Triple;
  /** The roll as Eq. 52 prints it. */
  printedRoll(x: number, y: number, z: number): readonly [number];
  /** Where the thrust points at this pitch and roll (Eq. 7). */
  direction(theta: number, phi: number): Triple;
  /** b_r, and b_r as printed (Eq. 63). */
  ball(kappa: number, weights: number, error: number, gain: number): readonly [number, number];
}

const code = globalThis.quadstepLaws as unknown as { readonly article: LawCode; readonly tools: Tools };
export const data = JSON.parse(document.getElementById("quadstep-data")?.textContent ?? "{}") as Data;
export const tools = code.tools;

/** Numbers to change, by their names among the parameters or the start. */
export type Settings = Readonly<Record<string, number>>;

/** All entries of a vector. */
export function each(name: string, value: number): Settings {
  return { [`${name}.0`]: value, [`${name}.1`]: value, [`${name}.2`]: value };
}

/** A flight: its log and what the law showed beside it, by name, row by row. */
export class Flown {
  constructor(
    private readonly table: Float64Array,
    private readonly seen: Float64Array,
    readonly rows: number,
    /** Between rows [s]. */
    readonly period: number,
    /** Why it was lost; "" if it was not. */
    readonly lost: string,
  ) {}

  column(name: string): Float64Array {
    const logged = data.columns.findIndex(([one]) => one === name);
    const [from, width, at] = logged >= 0 ? [this.table, data.columns.length, logged] : [this.seen, data.shown.length, data.shown.indexOf(name)];
    if (at < 0) throw new Error(`no column ${name}`);
    const column = new Float64Array(this.rows);
    for (let row = 0; row < this.rows; row++) column[row] = from[row * width + at]!;
    return column;
  }

  get times(): Float64Array {
    return this.column("t");
  }
}

const last: Record<string, readonly [string, Flown]> = {};

/** A figure's mission flown with some of its numbers changed; while they stay, the flight before. */
export function fly(figure: string, settings: Settings): Flown {
  const key = JSON.stringify(settings);
  if (last[figure]?.[0] !== key) last[figure] = [key, fresh(figure, settings)];
  return last[figure]![1];
}

function fresh(figure: string, settings: Settings): Flown {
  const mission = data.flights[figure]!;
  const [parameters, start] = [doubles(mission.parameters), doubles(mission.start)];
  for (const [name, value] of Object.entries(settings)) {
    const [vector, names] = data.names.includes(name) ? [parameters, data.names] : [start, data.starts];
    const at = names.indexOf(name);
    if (at < 0) throw new Error(`no number ${name}`);
    vector[at] = value;
  }
  const count = Math.floor(mission.ticks.last / mission.ticks.log) + 1;
  const table = new Float64Array(count * data.columns.length);
  const seen = new Float64Array(count * data.shown.length);
  const end = code.article.fly(parameters, [], start, { ...mission.ticks, every: [...mission.ticks.every] }, table, seen);
  return new Flown(table, seen, end.rows, mission.ticks.log * mission.ticks.step, end.code === 0 ? "" : `lost after ${(end.tick * mission.ticks.step).toFixed(1)} s`);
}
