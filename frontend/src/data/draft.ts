// How much of a flight is flown while a control is dragged: as much as there is time for between two pictures.

import type { Ticks } from "./contract";

const BUDGET = 6; // ms that all laws may take together
const PATIENCE = 7; // budgets that they may take to reach the reader's cursor
const FIRST = 200; // ticks a millisecond, before a law has flown
const COARSEST = 6; // halvings

/** Knows how quickly each law flies here. */
export class Draft {
  private readonly pace = new Map<string, number>();

  /** A law flew so many ticks in so many milliseconds: the best of late, as other programs only ever hinder. */
  flew(law: string, ticks: number, took: number): void {
    const now = ticks / Math.max(took, 0.1);
    const known = this.pace.get(law) ?? now;
    this.pace.set(law, Math.max(now, 0.8 * known + 0.2 * now));
  }

  /** The whole flight, or its first half, quarter, ...: what these laws fly in time, if possible past the cursor [s]. Its numbers are those of the whole flight, to the bit. */
  ticks(whole: Ticks, laws: readonly string[], cursor: number): Ticks {
    const cost = laws.reduce((sum, law) => sum + 1 / (this.pace.get(law) ?? FIRST), 0);
    let { last } = whole;
    const limit = (): number => ((last * whole.step) / 2 < cursor ? PATIENCE * BUDGET : BUDGET);
    for (let i = 0; i < COARSEST && last * cost > limit(); i++) last /= 2;
    return { ...whole, last: Math.max(whole.log, Math.ceil(last / whole.log) * whole.log) };
  }
}
