// How good a flight was, by the rules that Python left in the page (src/quadstep/metrics/verdict.py).

import type { Grade, PageData, Rule } from "../data/contract";
import type { Flight } from "../data/flight";
import { quantity } from "../view/format";
import { type Measures, greatest } from "./measure";

export interface Graded {
  readonly grade: Grade;
  /** Why it is not as commanded, one clause each. */
  readonly reasons: readonly string[];
  /** The same in a word or two each. */
  readonly labels: readonly string[];
  /** The limits above which it failed, with what it reached; their reasons are the first. */
  readonly above: readonly string[];
  /** That it left its path, in a sentence; "" where there is nothing to say. */
  readonly left: string;
}

const LEFT = "left its path";
const ABOVE = "above the limit";

export interface Mark {
  readonly glyph: string;
  readonly kind: string;
}

export const MARKS: Readonly<Record<Grade | typeof LEFT, Mark>> = {
  "as commanded": { glyph: "✓", kind: "good" },
  "flew, but": { glyph: "!", kind: "fair" },
  [LEFT]: { glyph: "!", kind: "bad left" },
  [ABOVE]: { glyph: "✕", kind: "bad" },
  lost: { glyph: "✕", kind: "bad lost" },
};

/** Of how a flight ended; left: whether, or how, it left its path. */
export function graveness({ grade, left }: { readonly grade: Grade; readonly left: string | boolean }): keyof typeof MARKS {
  return left && grade !== ABOVE ? LEFT : grade;
}

/** Of a flight of which only the beginning was flown nothing is said. */
export function markOf({ graded, whole }: { readonly graded: Graded; readonly whole: number | undefined }): Mark {
  return whole === undefined ? MARKS[graveness(graded)] : { glyph: "…", kind: "draft" };
}

/** limits: of the flight's own. */
export function grade(flight: Flight, measures: Measures, { rules, left }: PageData, limits: readonly Rule[]): Graded {
  if (!flight.held) return { grade: "lost", reasons: [], labels: [], above: [], left: "" };
  const broken = (some: readonly Rule[]): readonly (Rule & { value: number })[] => some.map((rule) => ({ ...rule, value: measures[rule.metric] ?? 0 })).filter(({ value, most, measured }) => !measured || value > most);
  const [failed, broke] = [broken(limits), broken(rules)];
  const told = failed.filter(({ measured }) => measured).map((rule) => filled(rule.label, rule));
  return {
    grade: told.length ? ABOVE : failed.length + broke.length ? "flew, but" : "as commanded",
    reasons: [...failed, ...broke].map((rule) => filled((measures.holds && rule.held) || rule.text, rule)),
    labels: broke.map(({ label }) => label),
    above: told,
    left: broke.length ? leftPath(flight, measures, left) : "",
  };
}

function filled(text: string, { factor, value, most }: Rule & { value: number }): string {
  return text.replace("{}", above(factor * value, factor * most));
}

/** See quadstep/report/panels.py, left_path. */
function leftPath(flight: Flight, { largest = 0, relative = 0 }: Measures, [off, away, sank]: PageData["left"]): string {
  const axes = ["x", "y", "z"].filter((axis) => flight.has(axis, `${axis}_d`));
  const [flown, wanted] = ["", "_d"].map((suffix) => axes.map((axis) => flight.column(`${axis}${suffix}`)!)) as [Float64Array[], Float64Array[]];
  const size = Math.hypot(...wanted.map((values) => greatest(values) - least(values)));
  const begun = Math.hypot(...flown.map((values, i) => values[0]! - wanted[i]![0]!));
  if (largest <= 1.01 * Math.max(size, begun) || !(size || relative > 1)) return "";
  const z = axes.indexOf("z");
  const low = z >= 0 && least(wanted[z]!) >= 0 ? least(flown[z]!) : 0;
  return `${[largest, size].reduce((text, value) => text.replace("{}", quantity(value, "m")), size ? off : away)}${low < 0 ? sank.replace("{}", quantity(low, "m")) : ""}.`;
}

function least(values: Float64Array): number {
  return -greatest(values.map((value) => -value));
}

/** A number above another, to three digits, or as many more as show that it is. */
function above(value: number, most: number): string {
  let digits = 3;
  while (digits < 15 && !(Number(value.toPrecision(digits)) > (1 + 1e-9) * most)) digits++;
  return Number(value.toPrecision(digits < 15 ? digits : 3)).toLocaleString("en-US", { maximumFractionDigits: 14 });
}
