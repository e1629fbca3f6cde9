// What of a campaign's flights counts: which of them succeed, by the numbers that `quadstep campaign` has, to the bit.

import type { Rate } from "../data/contract";
import type { Done } from "./worker";

/** Rows of a result: the outcome's code, its tick, and of the score the first three. */
const [CODE, TICK, SAMPLES, SQUARES, LARGEST] = [0, 1, 2, 3, 4];

export class Tally {
  readonly code: Float64Array;
  /** Ticks that were flown. */
  readonly ended: Float64Array;
  readonly position_rmse: Float64Array;
  readonly largest_error: Float64Array;
  readonly success: Uint8Array;
  flown = 0;
  failures = 0;

  constructor(private readonly rate: Rate) {
    [this.code, this.ended, this.position_rmse, this.largest_error] = Array.from({ length: 4 }, () => new Float64Array(rate.flights).fill(Number.NaN)) as [Float64Array, Float64Array, Float64Array, Float64Array];
    this.success = new Uint8Array(rate.flights);
  }

  get done(): boolean {
    return this.flown === this.rate.flights;
  }

  add({ first, past, rows }: Done): void {
    const { rate } = this;
    const count = past - first;
    const round = rate.double ? (value: number): number => value : Math.fround;
    for (let i = 0; i < count; i++) {
      const at = (row: number): number => rows[row * count + i]!;
      const flight = first + i;
      const sampled = at(SAMPLES!) > 0;
      this.code[flight] = at(CODE!);
      this.ended[flight] = at(TICK!);
      this.position_rmse[flight] = sampled ? round(Math.sqrt(at(SQUARES!) / at(SAMPLES!))) : Number.NaN;
      this.largest_error[flight] = sampled ? round(Math.sqrt(at(LARGEST!))) : Number.NaN;
      let good = at(CODE!) === 0 && sampled;
      for (let row = SQUARES!; row < rate.results; row++) good &&= Number.isFinite(at(row));
      for (const [name, most] of Object.entries(rate.failure)) good &&= this[name as keyof Rate["failure"]][flight]! <= most;
      this.success[flight] = Number(good);
      if (!good) this.failures++;
    }
    this.flown += count;
  }
}
