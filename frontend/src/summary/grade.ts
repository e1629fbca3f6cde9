// How good a flight was, by the rules that Python left in the page (src/quadstep/metrics/verdict.py).

import type { Grade, PageData } from "../data/contract";
import type { Flight } from "../data/flight";
import { quantity, short } from "../view/format";
import { type Measures, greatest } from "./measure";

export interface Graded {
  readonly grade: Grade;
  /** Why it is not as asked, one clause each. */
  readonly reasons: readonly string[];
  /** The same in a word or two each. */
  readonly labels: readonly string[];
  /** That it left its path, in a sentence; "" where there is nothing to say. */
  readonly left: string;
}

export interface Mark {
  readonly glyph: string;
  readonly kind: string;
}

export const MARKS: Readonly<Record<Grade, Mark>> = {
  "as asked": { glyph: "✓", kind: "good" },
  "flew, but": { glyph: "!", kind: "fair" },
  lost: { glyph: "✕", kind: "bad" },
};

/** Of a flight of which only the beginning was flown nothing is said. */
export function markOf({ graded, whole }: { readonly graded: Graded; readonly whole: number | undefined }): Mark {
  return whole === undefined ? MARKS[graded.grade] : { glyph: "…", kind: "draft" };
}

export function grade(flight: Flight, measures: Measures, { rules, left }: PageData): Graded {
  if (!flight.held) return { grade: "lost", reasons: [], labels: [], left: "" };
  const broken = rules.map((rule) => ({ ...rule, value: measures[rule.metric] ?? 0 })).filter(({ value, most }) => value > most);
  return {
    grade: broken.length ? "flew, but" : "as asked",
    reasons: broken.map(({ text, factor, value, most }) => text.replace("{}", above(factor * value, factor * most))),
    labels: broken.map(({ label }) => label),
    left: broken.length ? leftPath(flight, measures.largest ?? 0, left) : "",
  };
}

/** See quadstep/studies/flight_report.py, left_path. */
function leftPath(flight: Flight, largest: number, [off, sank]: PageData["left"]): string {
  const axes = ["x", "y", "z"].filter((axis) => flight.has(axis, `${axis}_d`));
  const [flown, wanted] = ["", "_d"].map((suffix) => axes.map((axis) => flight.column(`${axis}${suffix}`)!)) as [Float64Array[], Float64Array[]];
  const size = Math.max(0, ...wanted.map((values) => greatest(values) - least(values)));
  const begun = Math.hypot(...flown.map((values, i) => values[0]! - wanted[i]![0]!));
  if (!size || largest <= Math.max(size, 1.01 * begun)) return "";
  const z = axes.indexOf("z");
  const low = z >= 0 && least(wanted[z]!) >= 0 ? least(flown[z]!) : 0;
  return `${[largest, size].reduce((text, value) => text.replace("{}", quantity(value, "m")), off)}${low < 0 ? sank.replace("{}", quantity(low, "m")) : ""}.`;
}

function least(values: Float64Array): number {
  return -greatest(values.map((value) => -value));
}

/** A number above another, to three digits, or as many more as show that it is. */
function above(value: number, most: number): string {
  let digits = 3;
  while (digits < 15 && !(Number(value.toPrecision(digits)) > (1 + 1e-9) * most)) digits++;
  return short(value, digits < 15 ? digits : 3);
}
