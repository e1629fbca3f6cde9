// The walk: every flight of the page in a strip, one click each.

import type { Claim, FlightData, PageData } from "../data/contract";
import type { Session } from "../session";
import { field } from "./field";
import { MARKS, graveness } from "../summary/grade";
import { byId, fill, h } from "../view/dom";

const MANY = { holds: "hold", fails: "fail", undecided: "undecided" } as const;
const VERDICTS = ["holds", "fails", "undecided"] as const;

/** How many claims hold, fail and are undecided, in words. */
export function tally(verdicts: readonly Claim["verdict"][]): string {
  const counts = VERDICTS.map((verdict) => ({ verdict, count: verdicts.filter((one) => one === verdict).length })).filter(({ count }) => count);
  return counts.map(({ verdict, count }) => `${count} ${count === 1 ? verdict : MANY[verdict]}`).join(", ");
}

export class Strip {
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private readonly others = h("details", { class: "others" }); // closed, so that the flight itself is near the top

  constructor(host: HTMLElement, session: Session) {
    const groups = new Map<string, FlightData[]>();
    for (const flight of session.page.flights) groups.set(flight.group, [...(groups.get(flight.group) ?? []), flight]);
    const make = (flight: FlightData): HTMLButtonElement => {
      const button = this.button(flight, session);
      this.buttons.set(flight.id, button);
      return button;
    };
    const [first, ...others] = [...groups].map(([name, flights]) => stretch(name, flights, make, groups.size === 1));
    const marks = key(session.page);
    const count = session.page.flights.length - [...groups.values()][0]!.length;
    fill(this.others, h("summary", {}, `${count} more flight${count === 1 ? "" : "s"}${marks ? ", and what the marks mean" : ""}`), h("div", { class: "lane" }, ...others), marks);
    fill(host, h("div", { class: "lane" }, first), ...(others.length ? [this.others] : [marks]));
    host.hidden = session.page.flights.length < 2;
    const wide = matchMedia("(min-width: 1180px)"); // there a table stands beside the flight, elsewhere above it
    const place = (): void => (wide.matches ? byId("side").prepend(host) : byId("notice").before(host));
    if (first?.querySelector(".field")) {
      place();
      wide.addEventListener("change", place);
    }
    session.shown.watch((shown) => shown && this.mark(shown.data.id));
  }

  private button(flight: FlightData, session: Session): HTMLButtonElement {
    const first = flight.group === session.page.flights[0]!.group;
    const verdicts = first ? flight.claims.flatMap((index) => session.page.claims[index]?.verdict ?? []) : [];
    const said = tally(verdicts);
    const { reasons } = flight.outcome;
    const grade = graveness(flight.outcome);
    const state = [grade, ...reasons].join(" ");
    const button = h(
      "button",
      { type: "button", class: "stop", title: `${flight.name} · ${flight.outcome.text}${reasons.length ? `, but ${reasons.join(" and ")}` : ""}` },
      h("span", { class: `dot ${MARKS[grade].kind}`, "aria-hidden": "true" }),
      h("span", { class: "name" }, flight.name),
      h("span", { class: "unseen" }, `, ${state}`),
      said ? h("span", { class: "verdict", title: "the paper’s claims" }, h("span", { class: "unseen" }, ", claims: "), said) : null,
    );
    button.addEventListener("click", () => session.select(flight.id));
    return button;
  }

  private mark(id: string): void {
    for (const [key, button] of this.buttons) {
      const here = key === id;
      if (here && this.others.contains(button)) this.others.open = true;
      if (here && button.getAttribute("aria-current") !== "true") requestAnimationFrame(() => reveal(button)); // once it is laid out
      if (here) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    }
  }
}

/** What the marks mean, as far as they occur. */
function key({ flights, claims }: PageData): HTMLElement | null {
  const grades = (Object.keys(MARKS) as (keyof typeof MARKS)[]).filter((grade) => flights.some(({ outcome, cell }) => !cell?.colour && graveness(outcome) === grade));
  if (grades.length < (flights.some(({ cell }) => cell?.colour) ? 1 : 2)) return null;
  return h(
    "p",
    { class: "key-line" },
    ...grades.map((grade) => h("span", {}, h("span", { class: `dot ${MARKS[grade].kind}`, "aria-hidden": "true" }), grade)),
    claims.length ? "A claim may concern several flights, or none." : null,
  );
}

/** A group under its heading. Flights with places become a table of marks, and the heading says which one is meant. alone: whether the page's title names it. */
function stretch(name: string, flights: readonly FlightData[], make: (flight: FlightData) => HTMLButtonElement, alone: boolean): HTMLElement {
  const many = flights.every((flight) => flight.cell);
  const which = h("span", { class: "which" });
  const inner = many ? field(flights, make) : h("div", { class: "row" }, ...flights.map(make));
  const part = h("div", { class: "stretch", role: "group", "aria-label": name }, h("h2", {}, many && alone ? null : name, many ? which : null), inner);
  if (many) {
    const tell = (event: Event | null): void => {
      const on = event?.target instanceof Element ? event.target.closest("button") : null;
      const meant = on ?? part.querySelector("[aria-current]");
      which.textContent = meant ? `${alone ? "" : " · "}${meant.querySelector(".name")?.textContent ?? ""}` : "";
    };
    for (const kind of ["pointerover", "focusin", "click"]) part.addEventListener(kind, tell);
    for (const kind of ["pointerleave", "focusout"]) part.addEventListener(kind, () => tell(null));
    new MutationObserver(() => tell(null)).observe(part, { attributes: true, attributeFilter: ["aria-current"], subtree: true });
  }
  return part;
}

/** Within its strip only: the page itself must not move. */
function reveal(button: HTMLElement): void {
  const strip = button.closest<HTMLElement>(".lane");
  if (!strip) return;
  const [outer, inner] = [strip.getBoundingClientRect(), button.getBoundingClientRect()];
  if (inner.left < outer.left + 16) strip.scrollBy({ left: inner.left - outer.left - 40 });
  else if (inner.right > outer.right - 16) strip.scrollBy({ left: inner.right - outer.right + 40 });
}
