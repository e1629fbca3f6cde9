// The one time cursor that scene and plots share.

import { Watched } from "./events";

const SLOWLY = 0.2; // times as fast as it was
const LONGEST = 0.5; // s between pictures: after a longer pause (another tab) the flight does not leap

export class Clock {
  readonly time = new Watched(0);
  readonly playing = new Watched(false);
  readonly speed = new Watched(1);
  readonly end = new Watched(1);
  /** From here to there time passes slowly while it plays: what happened last should be seen. */
  slow: { readonly from: number; readonly to: number } | undefined;
  /** Where it pauses: what is on the screen ends there. */
  pause = Infinity;
  private previous = 0;
  private frame = 0;

  /** onFrame: told how much flight time has passed since the last picture [s]. */
  constructor(private readonly onFrame: (passed: number) => void) {
    this.playing.follow((playing) => {
      cancelAnimationFrame(this.frame);
      if (!playing) return;
      if (this.time.value >= this.end.value) this.time.set(0);
      this.previous = performance.now();
      this.frame = requestAnimationFrame(this.advance);
    });
  }

  toggle(): void {
    this.playing.set(!this.playing.value);
  }

  /** To a time within the flight. */
  seek(t: number): void {
    this.time.set(Math.min(Math.max(Number.isFinite(t) ? t : 0, 0), this.end.value));
  }

  /** The flight has another length: stay within it. */
  setEnd(t: number): void {
    this.end.set(t > 0 ? t : 1);
    this.seek(this.time.value);
  }

  private readonly advance = (now: number): void => {
    const t = this.time.value;
    const pace = this.slow && t >= this.slow.from && t < this.slow.to ? Math.min(this.speed.value, SLOWLY) : this.speed.value;
    const passed = Math.min(Math.max(now - this.previous, 0) / 1000, LONGEST) * pace; // a picture's time may lie before the click that began it
    this.previous = now;
    this.seek(this.time.value + passed);
    this.onFrame(passed);
    const pauses = t < this.pause && this.time.value >= this.pause;
    if (pauses) this.seek(this.pause);
    if (pauses || this.time.value >= this.end.value) this.playing.set(false);
    else this.frame = requestAnimationFrame(this.advance);
  };
}
