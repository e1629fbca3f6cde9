// What a step asks of its reader: a guess before the flight, and a flight whose numbers are as wanted.

import type { Guess, StepData } from "../data/contract";
import type { Shown } from "../session";
import { fill, h } from "../view/dom";
import { quantity } from "../view/format";
import { rich } from "../view/notation";

/** The question, and what answers it without a guess. made: called once, with what is then said, and whether the guess, if there was one, was right. */
export function question(guess: Guess, made: (verdict: HTMLElement, right: boolean | undefined) => void): { host: HTMLElement; show: () => void } {
  const host = h("div", { class: "guide-guess", role: "group", "aria-label": "Guess first" });
  const take = (place?: number): void => {
    const right = guess.choices[guess.answer]!;
    const said = place === undefined ? `The answer: ${right}.` : place === guess.answer ? `✓ You guessed right: ${right}.` : `✕ You guessed “${guess.choices[place]!}”; the answer is “${right}”.`;
    const verdict = h("p", { class: "guide-text", tabindex: -1, id: "guess-verdict" }, ...rich(said));
    fill(host, h("p", { class: "guide-text" }, ...rich(guess.ask)), verdict);
    made(verdict, place === undefined ? place : place === guess.answer);
  };
  const buttons = guess.choices.map((choice, place) => {
    const button = h("button", { type: "button", class: "plain choice" }, ...rich(choice));
    button.addEventListener("click", () => take(place));
    return button;
  });
  fill(host, h("h3", { class: "guide-what" }, "Guess first"), h("p", { class: "guide-text" }, ...rich(guess.ask)), h("div", { class: "guide-choices" }, ...buttons));
  return { host, show: take };
}

const MEASURES = { rmse: ["an RMSE", "m"], largest: ["a largest error", "m"], tilt: ["a largest tilt", "rad"] } as const;

/** What a step wants of its flight, in words; empty: nothing. */
export function wanted({ success, asCommanded }: StepData): string {
  const parts = goals(success).map(([name, [low, high]]) => {
    const [label, unit] = MEASURES[name];
    if (high === undefined) return `${label} of at least ${quantity(low, unit)}`;
    return low > 0 ? `${label} from ${quantity(low, unit)} to ${quantity(high, unit)}` : `${label} of up to ${quantity(high, unit)}`;
  });
  return parts.length ? `a ${asCommanded ? "flight as commanded" : "completed flight"} with ${parts.join(" and ")}` : "";
}

/** Whether a flight is what its step wants: all of it flown, of the grade wanted, and every number within its range. */
export function succeeded({ success, asCommanded }: StepData, { flight, whole, measures, graded }: Shown): boolean {
  return (asCommanded ? graded.grade === "as commanded" : flight.held) && whole === undefined && goals(success).every(([name, [low, high = Infinity]]) => measures[name]! >= low && measures[name]! <= high);
}

/** What is still wrong with a flight that is what its step wants, as the badge says it; empty: nothing. */
export function yet({ graded }: Shown): string {
  return [...graded.above, ...graded.labels].join(", ");
}

function goals(success: StepData["success"]): ["rmse" | "largest" | "tilt", readonly [number, number?]][] {
  return Object.entries(success) as ["rmse" | "largest" | "tilt", readonly [number, number?]][];
}
