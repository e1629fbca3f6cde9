// The outcome in a few words, and the theorem's conditions on the gains in use.

import type { Shown } from "../session";
import { fill, h, renew } from "../view/dom";
import { join, number, quantity } from "../view/format";
import type { Judged } from "../data/conditions";
import { loopChanged } from "../data/settings";
import { markOf } from "../summary/grade";
import { closed, prose, rich } from "../view/notation";

export function badge(host: HTMLElement, shown: Shown): void {
  const { flight, conditions, ghost, live, graded, whole } = shown;
  const mark = markOf(shown);
  const limited = shown.data.summary.limit !== null;
  const theory = conditions.filter(({ condition }) => !condition.order);
  const theorems = [...(limited && theory.every(({ holds }) => holds) ? [] : counts(theory)), ...disorder(conditions)];
  const covers = limited || !theory.length ? "" : mark.kind.startsWith("bad") ? promise(shown) : mark.kind === "fair" && conditions.every(({ holds }) => holds) ? CALM : "";

  const summary = h(
    "summary",
    {},
    h("span", { class: `mark ${mark.kind}`, "aria-hidden": "true" }, mark.glyph),
    h("span", { id: "outcome" }, outcome(shown)),
    margins(shown),
    theorems.length ? h("span", { id: "conditions" }, ...theorems) : null,
    covers ? h("span", { id: "promise" }, covers) : null,
  );
  const details = h("details", { class: "badge" }, summary, h("div", { class: "sheet" }));
  const sheet = details.lastElementChild!;
  const rows: (HTMLElement | null)[] = [
    flight.why ? h("p", {}, `Reason: ${flight.why}.`) : null,
    ...(whole === undefined ? [graded.left, ...graded.reasons] : []).filter(Boolean).map((reason) => h("p", {}, closed(`${reason[0]!.toUpperCase()}${reason.slice(1)}`))),
    asPython(shown),
    !live ? h("p", {}, "A recording; not flown in this page.") : null,
    ghost ? h("p", {}, ghost.held ? `The ghost flew for ${number(ghost.ended, 3)} s.` : `The ghost was lost at ${ghost.ended.toFixed(2)} s: ${ghost.why}.`) : null,
  ];
  const list = h("ul");
  for (const { condition, left, right, holds } of conditions) {
    const relation = holds ? (condition.orEqual ? "≥" : ">") : condition.orEqual ? "<" : "≤";
    list.append(
      h(
        "li",
        { class: holds ? "good" : "bad" },
        h("span", { class: "mark", "aria-label": holds ? "holds" : "broken" }, holds ? "✓" : "✕"),
        h("span", {}, ...rich(condition.text.replace(">=", "≥"))),
        h("span", { class: "figures" }, `${number(left, 3)} ${relation} ${join(number(right, 3), prose(condition.unit))}`),
        h("span", { class: "source" }, condition.source),
      ),
    );
  }
  fill(sheet, ...rows, theory.length ? (limited ? h("p", {}, LIMITED) : null) : h("p", {}, "No theorem is stated for this controller."), conditions.length ? list : null);
  const open = host.querySelector("details")?.open ?? false;
  details.open = open;
  renew(host, details);
}

/** Of the loop at rest: the grade of the file's, or that it is another one now, or not known. */
function margins({ data, flight: { held }, live, settings, whole }: Shown): HTMLElement | null {
  const changed = loopChanged(settings, data);
  if (data.margins && !changed) return h("span", { id: "margins", class: data.margins === "sound" ? "" : "fragile" }, "Loop at rest: ", ...rich(data.margins));
  const told = changed ? "The changed loop may be unstable even so: for its margins run " : "Margins of the loop at rest: run ";
  return held && live && whole === undefined ? h("span", { id: "margins", class: changed ? "fragile" : "" }, told, h("code", {}, "quadstep linear")) : null;
}

const LIMITED = "These conditions assume unlimited rotors, so they guarantee nothing for this vehicle.";

const CALM = "No contradiction: the conditions guarantee neither accuracy nor smoothness.";

/** Why a lost flight does not contradict the conditions that hold: what they promise (docs/theory.md, Theorem A, for the greatest thrust). */
function promise({ conditions, measures: { thrust } }: Shown): string {
  const broken = conditions.filter(({ holds }) => !holds);
  const repaired = conditions.find(({ condition }) => condition.source === "repaired theorem (at hover)");
  if (repaired && broken.length === 1 && broken[0] === repaired) return "The printed gain conditions are not sufficient: the repaired theorem’s condition is violated.";
  if (broken.length) return "";
  if (!repaired || thrust === undefined) return "No contradiction: the conditions do not promise that the flight stays bounded.";
  const flown = quantity(thrust, "N");
  return repaired.left > thrust * thrust
    ? `No contradiction: at thrusts up to the ${flown} of this flight, the repaired theorem only says when the Lyapunov function falls; it does not bound the flight.`
    : `No contradiction: the repaired theorem’s condition holds at hover, but not at the ${flown} that this flight reached.`;
}

/** How the flight ended; where many are counted, that this is the one without their draws. */
export function outcome(shown: Shown): string {
  const said = inWords(shown);
  return shown.data.rate ? `Nominal flight: ${said[0]!.toLowerCase()}${said.slice(1)}` : said;
}

function inWords({ flight, graded: { grade, labels, left, above }, whole }: Shown): string {
  const ended = `${number(flight.ended, 3)} s`;
  if (whole !== undefined) return `First ${ended} of ${number(whole, 3)} s`;
  if (grade === "lost") return `Lost at ${flight.ended.toFixed(2)} s`;
  if (above.length) return `Above the limit (${above.join("; ")})${left && `; it ${/did not [^:]+/.exec(left)![0]}`}`;
  if (left) return `Flew ${ended}, but ${/did not [^:]+/.exec(left)![0]}`; // the rest is in the sheet
  if (grade === "as commanded") return `Flew as commanded for ${ended}`;
  return !labels.length ? `Flew for ${ended}` : `Flew ${ended}, with problems: ${labels.join(", ")}`;
}

/** An autopilot's parameters that contradict each other. */
function disorder(conditions: readonly Judged[]): HTMLElement[] {
  return conditions.filter(({ condition, holds }) => !holds && condition.order).map(({ condition }) => h("span", { class: "bad" }, ...rich(condition.text.replace(">=", "≥")), ` is violated (${condition.source})`));
}

/** How many conditions of each theorem hold. */
function counts(conditions: readonly Judged[]): HTMLElement[] {
  const sources = [...new Set(conditions.map(({ condition }) => condition.source))];
  return sources.map((source, i) => {
    const own = conditions.filter(({ condition }) => condition.source === source);
    const holding = own.filter(({ holds }) => holds).length;
    const kind = holding < own.length ? "bad" : "good";
    const name = `${source[0]!.toUpperCase()}${source.slice(1)}`;
    if (own.length === 1) return h("span", { class: kind }, `${name}: ${holding ? "holds" : "violated"}`);
    const tail = h("span", { class: "tail" }, i ? "" : " gain conditions", holding === 1 ? " holds" : " hold"); // not on a telephone
    return h("span", { class: kind }, `${name}: ${holding} of ${own.length}`, tail);
  });
}

/** A sentence where the flight of the file ends otherwise than Python found: chaotic flights do, by the last bit. */
function asPython({ data, flight, asFiled, live, whole }: Shown): HTMLElement | null {
  if (!live || !asFiled || whole !== undefined || Math.abs(data.outcome.ended - flight.ended) < 0.05) return null;
  const text = `The package’s own engine gives: ${data.outcome.text}. This flight is chaotic before it ends, so its end depends on the last bit.`;
  return h("p", {}, ...rich(text));
}
