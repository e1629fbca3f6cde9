// What a control does once it is moved: plots follow while it moves as long as flying is quick, else it flies when let go.

import type { Control, Controller } from "../data/contract";
import { type Settings, withValues } from "../data/settings";
import type { Session } from "../session";

const QUICK = 45; // ms

export class Changes {
  private waiting: Settings | undefined;

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
    const settings = withValues(this.settings(), control, owner, values);
    if (final) {
      this.waiting = undefined;
      this.session.apply(settings);
    } else if ((this.session.shown.value?.took ?? Infinity) <= QUICK) {
      const flying = this.waiting !== undefined;
      this.waiting = settings;
      if (!flying) requestAnimationFrame(() => this.waiting && this.session.apply(this.waiting));
    }
  }
}
