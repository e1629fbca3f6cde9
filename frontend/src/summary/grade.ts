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
  const broken = rules.filter(({ metric, most }) => (measures[metric] ?? 0) > most);
  return {
    grade: broken.length ? "flew, but" : "as asked",
    reasons: broken.map(({ metric, text, factor }) => text.replace("{}", short(factor * (measures[metric] ?? 0), 3))),
    labels: broken.map(({ label }) => label),
  };
}
