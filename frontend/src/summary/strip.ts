// What this flight did, in four numbers and a sentence, with the file's numbers beside them.

import type { Session, Shown } from "../session";
import { fill, h } from "../view/dom";
import { join, number, quantity } from "../view/format";
import type { Measures } from "./measure";

const QUIET = 700; // ms without a change before a screen reader is told

export class SummaryStrip {
  private readonly words = h("p", { id: "summary-words" });
  private readonly figures = h("dl", { id: "summary-figures" });
  private readonly told = h("p", { class: "unseen", role: "status" });
  private waiting = 0;

  constructor(host: HTMLElement, session: Session) {
    fill(host, this.words, this.figures, this.told);
    session.shown.watch((shown) => shown && this.show(shown, session.filed(shown)));
  }

  private show(shown: Shown, filed: Measures): void {
    const { measures } = shown;
    const cells = entries(measures).map(({ label, text, hint }, i) => {
      const theirs = entries(filed)[i]!.text;
      const beside = shown.asFiled ? null : h("span", { class: "filed" }, theirs === text ? "as in the file" : `file ${theirs}`);
      return h("div", { title: hint }, h("dt", {}, label), h("dd", {}, text, beside));
    });
    fill(this.figures, ...cells);
    this.words.textContent = ending(shown);
    this.words.classList.toggle("bad", !shown.flight.held);
    clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => (this.told.textContent = spoken(shown)), QUIET);
  }
}

interface Entry {
  readonly label: string;
  readonly text: string;
  readonly hint: string;
}

function entries({ rmse, largest, tilt, share, thrust }: Measures): Entry[] {
  const of = (value: number | undefined, unit: string): string => (value === undefined ? "–" : quantity(value, unit));
  const limited = share !== undefined;
  return [
    { label: "RMSE", text: of(rmse, "m"), hint: "Root mean square of the distance to the desired position" },
    { label: "Largest error", text: of(largest, "m"), hint: "Largest distance to the desired position" },
    { label: "Largest tilt", text: tilt === undefined ? "–" : join(number((tilt * 180) / Math.PI, 3), "°"), hint: "Largest angle between thrust and vertical" },
    limited
      ? { label: "Thrust margin", text: join(number(100 - 100 * share, 3), "%"), hint: "Share of the full rotor thrust left at the worst moment" }
      : { label: "Largest thrust", text: of(thrust, "N"), hint: "Of all rotors together; this vehicle’s rotors have no limit, so there is no margin" },
  ];
}

/** How it ended and why. */
export function ending({ flight, data }: Shown): string {
  if (flight.held) return `Completed all ${number(flight.ended, 3)} s.`;
  return `Diverged at ${flight.ended.toFixed(2)} s${flight.why ? `: ${flight.why}` : ""}.${data.whyNot ? "" : " Numbers up to that point."}`;
}

function spoken(shown: Shown): string {
  const figures = entries(shown.measures).map(({ label, text }) => `${label} ${text}`);
  return `${ending(shown)} ${figures.join(", ")}.`;
}
