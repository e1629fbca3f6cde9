// The outcome in a few words, and the theorem's conditions on the gains in use.

import type { Shown } from "../session";
import { fill, h } from "../view/dom";
import { number } from "../view/format";
import { rich } from "../view/notation";

export function badge(host: HTMLElement, shown: Shown): void {
  const { flight, conditions, ghost, live } = shown;
  const outcome = flight.held ? `Flew for ${number(flight.ended, 3)} s` : `Diverged at ${flight.ended.toFixed(2)} s`;
  const broken = conditions.filter((judged) => !judged.holds);
  const theorem = conditions.length
    ? broken.length
      ? `${broken.length} of ${conditions.length} conditions broken`
      : `all ${conditions.length} conditions hold`
    : "";

  const summary = h(
    "summary",
    {},
    h("span", { class: `mark ${flight.held ? "good" : "bad"}`, "aria-hidden": "true" }, flight.held ? "✓" : "✕"),
    h("span", { id: "outcome" }, outcome),
    theorem ? h("span", { id: "conditions", class: broken.length ? "bad" : "good" }, theorem) : null,
  );
  const details = h("details", { class: "badge" }, summary, h("div", { class: "sheet" }));
  const sheet = details.lastElementChild!;
  const rows: (HTMLElement | null)[] = [
    flight.why ? h("p", {}, `Reason: ${flight.why}.`) : null,
    asPython(shown),
    !live ? h("p", {}, "A recording; not flown in this page.") : null,
    ghost ? h("p", {}, ghost.held ? `The ghost flew for ${number(ghost.ended, 3)} s.` : `The ghost diverged at ${ghost.ended.toFixed(2)} s: ${ghost.why}.`) : null,
  ];
  const list = h("ul");
  for (const { condition, left, right, holds } of conditions) {
    const relation = holds ? (condition.orEqual ? "≥" : ">") : condition.orEqual ? "<" : "≤";
    list.append(
      h(
        "li",
        { class: holds ? "good" : "bad" },
        h("span", { class: "mark", "aria-label": holds ? "holds" : "broken" }, holds ? "✓" : "✕"),
        h("span", {}, ...rich(condition.text)),
        h("span", { class: "figures" }, `${number(left, 3)} ${relation} ${number(right, 3)}`),
        h("span", { class: "source" }, condition.source),
      ),
    );
  }
  fill(sheet, ...rows, conditions.length ? list : h("p", {}, "No theorem is stated for this controller."));
  const open = host.querySelector("details")?.open ?? false;
  details.open = open;
  fill(host, details);
}

/** A sentence where the flight of the file ends otherwise than Python found: chaotic flights do, by the last bit. */
function asPython({ data, flight, asFiled, live }: Shown): HTMLElement | null {
  if (!live || !asFiled || Math.abs(data.outcome.ended - flight.ended) < 0.05) return null;
  const text = `The package’s own engine gives: ${data.outcome.text}. This flight is chaotic before it ends, so its end depends on the last bit.`;
  return h("p", {}, ...rich(text));
}
