// How good a flight was, by the rules that Python left in the page (src/quadstep/metrics/verdict.py).

import type { Grade, Rule } from "../data/contract";
import { short } from "../view/format";
import type { Measures } from "./measure";

export interface Graded {
  readonly grade: Grade;
  /** Why it is not as asked, one clause each. */
  readonly reasons: readonly string[];
  /** The same in a word or two each. */
  readonly labels: readonly string[];
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

export function grade(held: boolean, measures: Measures, rules: readonly Rule[]): Graded {
  if (!held) return { grade: "lost", reasons: [], labels: [] };
  const broken = rules.map((rule) => ({ ...rule, value: measures[rule.metric] ?? 0 })).filter(({ value, most }) => value > most);
  return {
    grade: broken.length ? "flew, but" : "as asked",
    reasons: broken.map(({ text, factor, value, most }) => text.replace("{}", above(factor * value, factor * most))),
    labels: broken.map(({ label }) => label),
  };
}

/** A number above another, to three digits, or as many more as show that it is. */
function above(value: number, most: number): string {
  let digits = 3;
  while (digits < 15 && !(Number(value.toPrecision(digits)) > (1 + 1e-9) * most)) digits++;
  return short(value, digits < 15 ? digits : 3);
}
