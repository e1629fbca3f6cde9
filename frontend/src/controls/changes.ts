// What a control does once it is moved: the flight follows at the next picture, as much of it as there is time for; all of it once the
// control rests or is let go.

import type { Control, Controller } from "../data/contract";
import { type Settings, withValues } from "../data/settings";
import type { Session } from "../session";

const RESTS = 250; // ms without a move, from the picture on: a slow machine must not fly all between two moves

export class Changes {
  private waiting: Settings | undefined;
  private resting = 0;

  constructor(private readonly session: Session) {
    session.shown.follow(() => (this.waiting = undefined));
  }

  settings(): Settings {
    const shown = this.session.shown.value;
    if (!shown) throw new Error("nothing is shown");
    return shown.settings;
  }

  /** final: let go, or typed. */
  moved(control: Control, owner: Controller | undefined, values: readonly number[], final: boolean): void {
    const settings = withValues(this.waiting ?? this.settings(), control, owner, values);
    clearTimeout(this.resting);
    if (final) {
      this.session.apply(settings);
      return;
    }
    if (!this.waiting) requestAnimationFrame(() => this.draft());
    this.waiting = settings;
  }

  private draft(): void {
    if (!this.waiting) return;
    this.session.apply(this.waiting, true);
    clearTimeout(this.resting);
    this.resting = window.setTimeout(() => this.session.apply(this.settings()), RESTS);
  }
}
