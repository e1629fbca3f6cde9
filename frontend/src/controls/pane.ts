// All controls of a flight, in groups: which controller flies, which is its ghost, and every number that may be set.

import type { Controller, FlightData } from "../data/contract";
import { controllerOf, controlsOf, fresh, isFresh, valuesOf } from "../data/settings";
import type { Session, Shown } from "../session";
import { fill, h } from "../view/dom";
import { type Card, card } from "./card";
import type { Changes } from "./changes";
import { choice } from "./choices";
import { STALE } from "../walk/story";

const FIRST = ["Gains", "Nets", "Path"]; // open, and in this order before all others

type Entry = ReturnType<typeof controlsOf>[number];

export class ControlPane {
  private cards: { card: Card; owner: Controller | undefined }[] = [];
  private built = "";
  private readonly open = new Map<string, boolean>();
  private readonly hint = h("p", { class: "quiet" });

  constructor(
    private readonly host: HTMLElement,
    private readonly session: Session,
    private readonly changes: Changes,
  ) {
    session.shown.watch((shown) => shown && this.show(shown));
  }

  private show(shown: Shown): void {
    const { data, settings } = shown;
    const key = `${data.id} ${settings.controller}`;
    if (key !== this.built) {
      this.built = key;
      this.build(shown);
    }
    for (const { card, owner } of this.cards) card.show(valuesOf(settings, card.control, owner));
    this.hint.classList.toggle("hinted", data.note !== "");
    this.hint.textContent = data.note && !shown.asFiled && !document.body.dataset["walking"] ? STALE : "Drag a slider: the vehicle flies again as you drag."; // as high, or the slider would leave the hand
    const ghost = this.host.querySelector<HTMLSelectElement>("#ghost");
    if (ghost) ghost.value = settings.ghost;
    const reset = this.host.querySelector<HTMLButtonElement>("#reset");
    if (reset) reset.disabled = isFresh(settings, data);
  }

  private build({ data, settings, live }: Shown): void {
    this.cards = [];
    if (!live || !data.controllers.length) {
      fill(this.host, h("p", { class: "quiet" }, "No controls: this flight is a recording."));
      return;
    }
    const controller = controllerOf(data, settings.controller);
    const groups = new Map<string, Entry[]>();
    // A controller's own groups come first: they are what one turns most.
    const entries = [...controlsOf(data, controller)].sort((a, b) => Number(b[1] !== undefined) - Number(a[1] !== undefined));
    for (const entry of entries) groups.set(entry[0].group, [...(groups.get(entry[0].group) ?? []), entry]);
    const rank = (name: string): number => (FIRST.includes(name) ? FIRST.indexOf(name) : FIRST.length);
    const ordered = [...groups].sort((a, b) => rank(a[0]) - rank(b[0]));
    const picks = (["controller", "ghost"] as const).map((which) => choice(which, which, data, settings, this.session, this.changes));
    fill(this.host, this.hint, h("div", { class: "choices" }, ...picks), ...ordered.map(([name, inside]) => this.group(name, inside)), this.foot(data));
  }

  /** Its cards are made once it is open. */
  private group(name: string, entries: readonly Entry[]): HTMLElement {
    const details = h("details", { class: "group", open: this.open.get(name) ?? FIRST.includes(name) }, h("summary", {}, h("span", {}, name)));
    const make = (): void => {
      if (!details.open || details.childElementCount > 1) return;
      for (const [control, owner] of entries) {
        const made = card(control, (which, values, final) => this.changes.moved(which, owner, values, final));
        this.cards.push({ card: made, owner });
        details.append(made.element);
        made.show(valuesOf(this.changes.settings(), control, owner));
      }
    };
    make();
    details.addEventListener("toggle", () => {
      this.open.set(name, details.open);
      make();
    });
    return details;
  }

  private foot(data: FlightData): HTMLElement {
    const reset = h("button", { type: "button", id: "reset", class: "plain" }, "Reset everything");
    reset.addEventListener("click", () => this.session.apply({ ...fresh(data), ghost: this.changes.settings().ghost }));
    return h("div", { class: "foot" }, reset);
  }
}
