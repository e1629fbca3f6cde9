// The theorem's conditions, worked out on the numbers in use.

import type { Condition, Operation, Term } from "./contract";
import type { Inputs } from "./engine";

export interface Judged {
  readonly condition: Condition;
  readonly left: number;
  readonly right: number;
  readonly holds: boolean;
}

export function judge(given: Inputs): Judged[] {
  return given.controller.conditions.map((condition) => {
    const left = evaluate(condition.left, given);
    const right = evaluate(condition.right, given);
    return { condition, left, right, holds: condition.orEqual ? left >= right : left > right };
  });
}

function evaluate(term: Term, given: Inputs): number {
  if (typeof term !== "object") return Number(term);
  if ("name" in term) return given.parameters[given.names.get(term.name) ?? -1] ?? Number.NaN;
  const [a = Number.NaN, b = Number.NaN, c = Number.NaN] = term.of.map((part) => evaluate(part, given));
  return OPERATIONS[term.op](a, b, c);
}

const OPERATIONS: Readonly<Record<Operation, (a: number, b: number, c: number) => number>> = {
  "+": (a, b) => a + b,
  "-": (a, b) => a - b,
  "*": (a, b) => a * b,
  "/": (a, b) => a / b,
  max: (a, b) => Math.max(a, b),
  min: (a, b) => Math.min(a, b),
  negative: (a) => -a,
  magnitude: (a) => Math.abs(a),
  sqrt: (a) => Math.sqrt(a),
  "<": (a, b) => Number(a < b),
  "<=": (a, b) => Number(a <= b),
  ">": (a, b) => Number(a > b),
  ">=": (a, b) => Number(a >= b),
  where: (a, b, c) => (a !== 0 ? b : c),
};
