// The theorem's conditions, worked out on the numbers in use.

import type { Condition, Term } from "./contract";
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
  if (typeof term === "number") return term;
  if ("name" in term) return given.parameters[given.names.get(term.name) ?? -1] ?? Number.NaN;
  const [first, ...rest] = term.of.map((part) => evaluate(part, given));
  return rest.reduce((left, right) => combine(term.op, left, right), first ?? Number.NaN);
}

function combine(op: "+" | "-" | "*" | "/" | "max" | "min", left: number, right: number): number {
  switch (op) {
    case "+":
      return left + right;
    case "-":
      return left - right;
    case "*":
      return left * right;
    case "/":
      return left / right;
    case "max":
      return Math.max(left, right);
    case "min":
      return Math.min(left, right);
  }
}
