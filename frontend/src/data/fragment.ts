// Settings in the address bar: #flight=case1&controller=...&ghost=...&set=backstepping.K_r1:2,2,3&keep=case2&plot=attitude&t=12.5. Whatever does not fit is
// left out and said; nothing of it is ever run.

import type { FlightData, PageData } from "./contract";
import { FILE, type Settings, controllerOf, controlsOf, fresh, keyOf, withValues, hold } from "./settings";

export interface Link {
  readonly settings: Settings;
  /** Time of the cursor [s], if the link says. */
  readonly time: number | undefined;
  /** Step of the walk, from 0, if the link says. */
  readonly step: number | undefined;
  /** A plot to stand first, if the link says. */
  readonly plot: string | undefined;
  /** A flight to lay behind those that are shown, if the link says. */
  readonly keep: FlightData | undefined;
  /** Whether it says nothing but the step. */
  readonly bare: boolean;
  /** Sentences on what was not understood. */
  readonly complaints: readonly string[];
}

const LONGEST = 8000;
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?$/;

/** The fragment that reproduces these settings, with its #. step: of the walk, from 0. */
export function write(settings: Settings, first: FlightData | undefined, time?: number, step?: number): string {
  const parts: string[] = [`flight=${encode(settings.flight)}`];
  if (settings.controller && settings.controller !== first?.controllers[0]?.id) parts.push(`controller=${encode(settings.controller)}`);
  if (settings.ghost) parts.push(`ghost=${encode(settings.ghost)}`);
  for (const [key, values] of Object.entries(settings.values)) parts.push(`set=${encode(key)}:${values.map(String).join(",")}`);
  if (step !== undefined) parts.push(`step=${step + 1}`);
  if (time !== undefined) parts.push(`t=${time.toFixed(2)}`);
  return `#${parts.join("&")}`;
}

/** What a fragment says, as far as it can be understood. */
export function read(fragment: string, page: PageData): Link | undefined {
  const first = page.flights[0];
  const text = fragment.replace(/^#/, "");
  if (!text || !first) return undefined;
  if (text.length > LONGEST) {
    return { settings: fresh(first), time: undefined, step: undefined, plot: undefined, keep: undefined, bare: false, complaints: ["The link is too long for this page; it was ignored."] };
  }
  const complaints: string[] = [];
  const pairs = text.split("&").map(pair);
  const named = (name: string): string | undefined => pairs.find((p) => p?.[0] === name)?.[1];

  const id = named("flight");
  const flight = page.flights.find((candidate) => candidate.id === id) ?? first;
  if (id !== undefined && flight.id !== id) complaints.push("The link names a flight that this page does not have; the first one is shown.");
  let settings = fresh(flight);
  let time: number | undefined;
  let step: number | undefined;
  let plot: string | undefined;
  let keep: FlightData | undefined;
  for (const entry of pairs) {
    const [name, value] = entry ?? ["", ""];
    if (name === "flight") continue;
    if (name === "controller" && controllerOf(flight, value)) settings = { ...settings, controller: value };
    else if (name === "ghost" && (value === FILE || controllerOf(flight, value))) settings = { ...settings, ghost: value };
    else if (name === "step" && page.story?.steps[Number(value) - 1]) step = Number(value) - 1;
    else if (name === "plot" && flight.panels.some((panel) => panel.id === value)) plot = value;
    else if (name === "keep" && page.flights.some((candidate) => candidate.id === value)) keep = page.flights.find((candidate) => candidate.id === value);
    else if (name === "t" && NUMBER.test(value)) time = Number(value);
    else {
      const changed = name === "set" ? withPart(settings, flight, value, complaints) : undefined;
      if (changed) settings = changed;
      else complaints.push(`Ignored part of the link: “${shown(name || "?", value)}”.`);
    }
  }
  return { settings, time, step, plot, keep, bare: pairs.length === 1, complaints: complaints.slice(0, 3) };
}

/** Settings after one "key:1,2,3", or "key:1" for all axes; undefined if it does not fit the flight. */
function withPart(settings: Settings, flight: FlightData, part: string, complaints: string[]): Settings | undefined {
  const colon = part.indexOf(":");
  const key = part.slice(0, colon);
  const numbers = part.slice(colon + 1).split(",");
  if (colon < 1 || !numbers.every((text) => NUMBER.test(text) && Number.isFinite(Number(text)))) return undefined;
  const known = [undefined, ...flight.controllers].flatMap((controller) => controlsOf(flight, controller));
  const own = controlsOf(flight, controllerOf(flight, settings.controller));
  const found = known.find(([control, owner]) => keyOf(control, owner) === key) ?? own.find(([control]) => control.id === key);
  if (!found || ![1, found[0].components.length].includes(numbers.length)) return undefined;
  const wanted = found[0].components.map((_, i) => Number(numbers[i] ?? numbers[0]));
  if (wanted.some((value) => hold(found[0], value) !== value)) complaints.push(`The link sets ${key} to what is not allowed; the nearest allowed value is used.`);
  return withValues(settings, found[0], found[1], wanted);
}

function pair(text: string): readonly [string, string] | undefined {
  const equals = text.indexOf("=");
  try {
    return equals < 0 ? [decodeURIComponent(text), ""] : [text.slice(0, equals), decodeURIComponent(text.slice(equals + 1))];
  } catch {
    return undefined; // a broken %-escape
  }
}

function encode(text: string): string {
  return encodeURIComponent(text);
}

function shown(name: string, value: string): string {
  const text = value ? `${name}=${value}` : name;
  return text.length > 40 ? `${text.slice(0, 40)}…` : text;
}
