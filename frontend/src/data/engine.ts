// A flight flown in the page: settings become parameters, and the compiled law flies them.

import type { Controller, Effect, FlightData, Law, PageData, Ticks } from "./contract";
import { Flight } from "./flight";
import { lawCode, unpack } from "./page";
import { short } from "../view/format";
import { FILE, type Settings, controllerOf, controlsOf, valuesOf } from "./settings";

/** Every number of a flight. */
export interface Inputs {
  readonly controller: Controller;
  readonly names: ReadonlyMap<string, number>;
  readonly parameters: Float64Array;
  readonly start: Float64Array;
  readonly tables: Float64Array[];
  readonly ticks: Ticks;
}

/** The numbers that a controller flies with under these settings; `own` false: its gains as in the file. */
export function inputs(page: PageData, flight: FlightData, controller: Controller, settings: Settings, own = true): Inputs | undefined {
  const law = page.laws[controller.law];
  if (!law) return undefined;
  const names = indexed(law.names);
  const starts = indexed(law.starts);
  const parameters = unpack(`preset ${controller.preset}`, page.presets[controller.preset]).slice();
  for (const [index, value] of controller.overrides) parameters[index] = Number(value);
  const start = Float64Array.from(controller.start, Number);
  const tables = controller.tables.map((key) => unpack(`table ${key}`, page.tables[key]));
  const ticks = { ...flight.ticks, every: [...flight.ticks.every] };
  let duration = ticks.last * ticks.step;

  const place = (effect: Effect, value: number): void => {
    if (effect.what === "hover") {
      hover(value, parameters, names).forEach((speed, i) => (start[starts.get(`speeds.${i}`)!] = speed));
      return;
    }
    const factor = Number(effect.factor);
    const result = plus(effect.power === -1 ? factor / value : factor * value, Number(effect.offset));
    if (effect.what === "duration") {
      duration = effect.add ? plus(duration, result) : result;
      return;
    }
    const [vector, index] = effect.what === "start" ? [start, starts.get(effect.name)] : [parameters, names.get(effect.name)];
    if (index !== undefined) vector[index] = effect.add ? plus(vector[index]!, result) : result;
  };

  const asFiled = { ...settings, values: {} };
  for (const [control, owner] of controlsOf(flight, controller)) {
    const values = valuesOf(owner && !own ? asFiled : settings, control, owner);
    control.components.forEach((component, i) => {
      const value = values[i]!;
      if (control.kind === "neurons") {
        for (const neuron of law.neurons.slice(value)) neuron.parameters.forEach((at, k) => (parameters[at] = neuron.off[k]!));
      } else if (control.kind !== "toggle" || value === 0) {
        for (const effect of component.sets) place(effect, value);
      }
    });
  }
  ticks.last = Math.max(ticks.log, Math.round(duration / ticks.step));
  return { controller, names, parameters, start, tables, ticks };
}

/** The speeds [rad/s] at which rotors carry a mass [kg], to the bit as quadstep/vehicle/allocation.py, allocate, has them. */
function hover(mass: number, parameters: Float64Array, names: ReadonlyMap<string, number>): number[] {
  const of = (name: string): number => parameters[names.get(name) ?? -1] ?? Number.NaN;
  const [least, most, squared] = [of("allocation.least"), of("allocation.most"), 1 / of("allocation.thrust")];
  const lift: number[] = [];
  while (names.has(`allocation.matrix.${lift.length}.0`)) lift.push(of(`allocation.matrix.${lift.length}.0`));
  const [bottom, top] = [Math.max(...lift.map((part) => least * (1 / part))), Math.min(...lift.map((part) => most * (1 / part)))];
  const lifted = Math.min(top, Math.max(bottom, mass * of("airframe.gravity")));
  return lift.map((part) => Math.sqrt(Math.min(most, Math.max(least, lifted * part)) * squared));
}

/** The sum; with nothing added it is a to the bit, so that a file's own numbers fly as Python flies them. */
function plus(a: number, b: number): number {
  return b === 0 ? a : a + b;
}

/** Flown by the law compiled for its controller. */
export function fly(page: PageData, given: Inputs): Flight | undefined {
  const law = page.laws[given.controller.law];
  const code = lawCode(given.controller.law);
  if (!law || !code) return undefined;
  const width = law.columns.length;
  const { ticks } = given;
  const table = new Float64Array((Math.floor(ticks.last / ticks.log) + 1) * width);
  const end = code.fly(given.parameters, given.tables, given.start, ticks, table);
  const outcome = page.outcomes[end.code];
  return new Flight(
    law.columns.map(([name]) => name),
    law.columns.map(([, unit]) => unit),
    table.subarray(0, end.rows * width),
    outcome?.ended ? why(outcome, given) : "",
    end.tick * ticks.step,
  );
}

/** Why a flight was lost, with the number of the limit that it passed. */
function why({ text, limit }: PageData["outcomes"][number], given: Inputs): string {
  const value = limit ? given.parameters[given.names.get(limit.name) ?? -1] : undefined;
  return limit && value !== undefined ? limit.text.replace("{}", short(limit.factor * value, 4)) : text;
}

/** The first net of a flight. neurons: those in use. rows, one after the other, as `Law.net` says. */
export interface Net {
  readonly neurons: number;
  readonly width: number;
  readonly rows: Float64Array;
  readonly times: Float64Array;
}

/** Flies once more, for what is seen of the net. */
export function flyNet(given: Inputs, law: Law): Net | undefined {
  const code = lawCode(given.controller.law);
  if (!code) return undefined;
  const { ticks } = given;
  const [count, columns, width] = [Math.floor(ticks.last / ticks.log) + 1, law.columns.length, 4 * law.net + 6];
  const table = new Float64Array(count * columns);
  const net = new Float64Array(count * width);
  const end = code.fly(given.parameters, given.tables, given.start, ticks, table, net);
  const time = law.columns.findIndex(([name]) => name === "t");
  const times = Float64Array.from({ length: end.rows }, (_, row) => table[row * columns + time]!);
  const off = law.neurons.findIndex(({ parameters, off }) => parameters.every((at, k) => given.parameters[at] === off[k]));
  return { neurons: off < 0 ? law.net : off, width, rows: net.subarray(0, end.rows * width), times };
}

/** The controller that is the ghost, and whether it flies with its own settings; undefined: no ghost. */
export function ghostOf(flight: FlightData, settings: Settings): { controller: Controller; own: boolean } | undefined {
  const id = settings.ghost === FILE ? settings.controller : settings.ghost;
  const controller = id ? controllerOf(flight, id) : undefined;
  return settings.ghost && controller ? { controller, own: settings.ghost !== FILE } : undefined;
}

function indexed(names: readonly string[]): Map<string, number> {
  return new Map(names.map((name, i) => [name, i]));
}
