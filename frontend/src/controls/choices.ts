// Who flies, and who flies beside as a ghost.

import type { FlightData } from "../data/contract";
import { FILE, type Settings } from "../data/settings";
import type { Session } from "../session";
import { h } from "../view/dom";
import type { Changes } from "./changes";

export type Choice = "controller" | "ghost";

/** A labelled list; id: of the list. */
export function choice(which: Choice, id: string, data: FlightData, settings: Settings, session: Session, changes: Changes): HTMLElement {
  const controllers = data.controllers.map((one): [string, string] => [one.id, one.label]);
  const options = which === "controller" ? controllers : [["", "none"], [FILE, "same controller, original settings"], ...controllers];
  const select = h("select", { id }, ...options.map(([value, text]) => h("option", { value: value! }, text)));
  select.value = settings[which];
  select.addEventListener("change", () => session.apply({ ...changes.settings(), [which]: select.value }));
  return h("label", { class: "pick" }, h("span", {}, which === "controller" ? "Flown by" : "Ghost"), select);
}
