// What a flight shows: its note, the paper's claims with their verdicts, and where to look.

import type { Claim, PageData } from "../data/contract";
import type { Shown } from "../session";
import { fill, h } from "../view/dom";
import { closed, prose, rich, sentence } from "../view/notation";
import { tally } from "./strip";

const VERDICTS = { holds: "Holds", fails: "Fails", undecided: "Undecided" } as const;

/** host: of what it is, and what the paper claims of it; claimed: of what was measured. look: bring plots forward. */
export function story(host: HTMLElement, claimed: HTMLElement, page: PageData, shown: Shown, look: (panels: readonly string[]) => void): void {
  const { data, live } = shown;
  const claims = data.claims.flatMap((index) => page.claims[index] ?? []);
  fill(
    host,
    h("h2", { id: "flight-name", class: data.name === page.title ? "named unseen" : "named" }, data.name),
    data.note ? h("p", { class: "lead" }, ...rich(data.note)) : null,
    claims.length ? ofPaper(claims, look) : null,
    !live ? h("p", { class: "why", id: "why-not" }, closed(data.whyNot || "Shown as recorded")) : null,
    ...data.warnings.map((warning) => h("p", { class: "why warned" }, "Warning: ", ...rich(closed(warning)))),
  );
  fill(
    claimed,
    data.note || claims.length || data.facts.length ? h("p", { class: "stale-note" }, STALE) : null,
    data.facts.length ? facts(data.facts) : null,
  );
}

/** Shown where the text no longer fits what flies. */
export const STALE = "You changed the settings; the text still describes the original flight.";

/** Closed, so that sliders are in sight; one line however many there are. */
function ofPaper(claims: readonly Claim[], look: (panels: readonly string[]) => void): HTMLElement {
  const verdicts = claims.map(({ verdict }) => verdict);
  return h(
    "details",
    { class: "claim", id: "of-paper" },
    h("summary", {}, h("h3", {}, "The paper’s claims"), h("span", { class: "tally" }, tally(verdicts)), h("span", { class: "more", "aria-hidden": "true" })),
    ...claims.map((claim) => card(claim, claims.length === 1, look)),
  );
}

function card(claim: Claim, open: boolean, look: (panels: readonly string[]) => void): HTMLElement {
  const verdict = h("span", { class: `verdict ${claim.verdict}` }, VERDICTS[claim.verdict]);
  const button = h("button", { type: "button", class: "look" }, ...rich(claim.look || "Show me where to look"));
  button.addEventListener("click", () => look(claim.panels));
  return h(
    "details",
    { class: "claim", name: "claim", open },
    h("summary", {}, h("h3", {}, ...sentence(claim.name)), verdict),
    h("blockquote", {}, "“", ...rich(claim.sentence), "”"),
    h("p", { class: "measured" }, ...sentence(claim.measured)),
    claim.panels.length ? button : claim.look ? h("p", { class: "measured" }, ...rich(claim.look)) : null,
  );
}

function facts(pairs: readonly (readonly [string, string])[]): HTMLElement {
  const list = h("dl", { class: "facts" });
  for (const [label, value] of pairs) list.append(h("div", {}, h("dt", {}, ...sentence(label)), h("dd", {}, prose(value))));
  return h("details", { class: "claim" }, h("summary", {}, h("h3", {}, "Measured by quadstep"), h("span", { class: "more", "aria-hidden": "true" })), list);
}
