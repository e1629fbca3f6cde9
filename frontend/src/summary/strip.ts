// What this flight did, in four numbers and a sentence, with the original's numbers beside them.

import { outcome } from "../controls/badge";
import type { Control, FlightData } from "../data/contract";
import { write } from "../data/fragment";
import { type Settings, controllerOf, controlsOf, fresh, keyOf } from "../data/settings";
import type { Original, Session, Shown } from "../session";
import { fill, h } from "../view/dom";
import { join, number, plain, plainUnit, quantity, short } from "../view/format";
import { closed, prose } from "../view/notation";
import { markOf } from "./grade";
import type { Measures } from "./measure";

const AS_LONG = new Set(["radius", "size", "target", "yaw_end"]); // of a path, what does not change how long it takes
const QUIET = 700; // ms without a change before a screen reader is told

export class SummaryStrip {
  private readonly words = h("div", { id: "summary-words" });
  private readonly changed = h("p", { class: "on-paper" });
  private readonly figures = h("dl", { id: "summary-figures" });
  private readonly told = h("p", { class: "unseen", role: "status" });
  private waiting = 0;

  constructor(private readonly host: HTMLElement, session: Session) {
    fill(host, this.figures, this.words, this.changed, this.told);
    session.shown.watch((shown) => shown && this.show(shown, session.original(shown)));
  }

  private show(shown: Shown, original: Original): void {
    const { measures } = shown;
    const compared = !original.same && comparable(shown, original);
    const counted = when(shown);
    const cells = entries(measures).map(({ label, text, hint }, i) => {
      const theirs = entries(original.measures)[i]!.text;
      const beside = compared ? h("span", { class: "filed" }, `was ${theirs}`) : null;
      return h("div", { title: hint }, h("dt", {}, `${label} `, i < 2 && text !== "–" && counted ? h("span", { class: "counted" }, counted.trim()) : ""), h("dd", {}, text, beside));
    });
    fill(this.figures, ...cells);
    const said = besides(shown, original);
    const marked = said.map((one) => h("span", { class: one === sentence(shown.data.summary.cut) ? "quiet" : "" }, one)); // which is no fault
    fill(this.words, ...(said.length > 2 ? [h("ul", {}, ...marked.map((one) => h("li", {}, one)))] : marked.flatMap((one, i) => (i ? [" ", one] : [one]))));
    this.changed.textContent = changes(shown);
    this.words.tabIndex = said.length > 2 ? 0 : -1; // it scrolls
    this.host.classList.toggle("since", shown.data.summary.since > 0);
    this.words.className = markOf(shown).kind;
    clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => (this.told.textContent = spoken(shown, original)), QUIET);
  }
}

interface Entry {
  readonly label: string;
  readonly text: string;
  readonly hint: string;
}

function entries({ rmse, largest, tilt, share, thrust }: Measures): Entry[] {
  const of = (value: number | undefined, unit: string): string => (value === undefined ? "–" : quantity(value, unit));
  const limited = share !== undefined;
  return [
    { label: "RMSE", text: of(rmse, "m"), hint: "Root mean square of the distance to the desired position" },
    { label: "Largest error", text: of(largest, "m"), hint: "Largest distance to the desired position" },
    { label: "Largest tilt", text: tilt === undefined ? "–" : join(number((tilt * 180) / Math.PI, 3), "°"), hint: "Largest angle between thrust and vertical" },
    limited
      ? { label: "Total thrust left", text: join(number(100 - 100 * share, 3), "%"), hint: "Of all rotors together, at the worst moment; a single rotor may have none left" }
      : thrust === undefined ? { label: "Largest thrust", text: "–", hint: "The log of this flight has no thrusts of rotors" }
      : { label: "Largest thrust", text: of(thrust, "N"), hint: "Of all rotors together; this vehicle’s rotors have no limit, so there is no margin" },
  ];
}

/** The stretch of time over which errors count, where that is not the whole flight as asked. */
function when({ flight, data: { summary } }: Shown): string {
  const from = summary.since > 0 ? ` from ${plain(summary.since)} s` : "";
  return flight.held ? from && `${from} on` : `${from} until ${flight.last.toFixed(2)} s`;
}

/** Numbers of flights are compared where both flew for the same time. */
function comparable({ flight, whole }: Shown, { held, ended }: Original): boolean {
  return whole === undefined && flight.held && held && Math.abs(ended - flight.ended) < 1e-6;
}

/** What the badge leaves out: why it was lost or is not as commanded, and what of the original flight is not beside it. */
function besides(shown: Shown, { held, ended, same }: Original): string[] {
  const { flight, data, settings, graded, asFiled, whole, measures: { saturated = 0 } } = shown;
  if (whole !== undefined) return ["While you drag, numbers and plots cover only this beginning."];
  const sameTime = data.controls.every(({ id, group }) => group !== "Path" || AS_LONG.has(id) || !settings.values[id]);
  const heavy = asFiled ? "" : tooHeavy(shown);
  const limited = asFiled || !saturated || graded.labels.includes("rotors saturated") ? "" : `the rotors were saturated ${short(100 * saturated, 3)} % of the time`;
  const why = flight.held
    ? [heavy, graded.left, ...graded.reasons.slice(graded.above.length), limited, sameTime ? data.summary.cut : ""]
    : [heavy, `${flight.why || "it was lost"}${data.whyNot ? "" : "; the numbers stop at the last sample before"}`];
  const original = held ? `flew for ${number(ended, 3)} s` : `was lost at ${ended.toFixed(2)} s`;
  const compared = same || (flight.held && held) ? "" : `the original ${original}${!held && flight.held ? "; this flight reached its end" : ""}`;
  return [...why, compared].filter(Boolean).map(sentence);
}

function sentence(clause: string): string {
  return clause && closed(`${clause[0]!.toUpperCase()}${clause.slice(1)}`);
}

/** As `quadstep fly` warns (src/quadstep/mission/airframe.py, warnings); "" where its rotors can carry it. */
function tooHeavy({ given, data: { summary } }: Shown): string {
  const of = (name: string): number => given?.parameters[given.names.get(name) ?? -1] ?? Number.NaN;
  const body = given?.names.has("airframe.mass") ? "airframe" : "vehicle";
  const [mass, most] = [of(`${body}.mass`), summary.upward * of(summary.limit ?? "")];
  const weight = mass * of(`${body}.gravity`);
  return most <= weight ? `it cannot hover: ${short(mass, 6)} kg weigh ${short(weight, 4)} N, its rotors lift at most ${short(most, 4)} N` : "";
}

/** For paper, which has no controls: what was changed, and the end of the link that flies it. */
function changes({ data, settings, asFiled }: Shown): string {
  if (asFiled) return "";
  const controller = controllerOf(data, settings.controller);
  const changed = altered(data, settings).map(([now, before]) => `${now} (original: ${before})`);
  const other = settings.controller === fresh(data).controller ? [] : [`controller: ${controller?.label ?? ""} (original: ${data.controllers[0]?.label ?? ""})`];
  return `Changed settings: ${[...other, ...changed].join("; ")}. Link: ${location.pathname.split("/").pop()}${write(settings, data)}`;
}

/** What differs from the file: each as it is set, and the file's value. */
function altered(data: FlightData, settings: Settings): [string, string][] {
  const shown = (control: Control, values: readonly number[]): string => {
    const texts = (values.every((value) => value === values[0]) ? values.slice(0, 1) : values).map(plain);
    return join(control.kind === "toggle" ? (values[0] ? "on" : "off") : texts.join(", "), prose(plainUnit(control.unit)));
  };
  return controlsOf(data, controllerOf(data, settings.controller)).flatMap(([control, owner]) => {
    const values = settings.values[keyOf(control, owner)];
    return values ? [[`${control.id} = ${shown(control, values)}`, shown(control, control.components.map(({ value }) => value))]] : [];
  });
}

function spoken(shown: Shown, original: Original): string {
  const figures = entries(shown.measures).map(({ label, text }, i) => `${label}${i < 2 && text !== "–" ? when(shown) : ""} ${text}`);
  return `${closed(outcome(shown))} ${besides(shown, original).join(" ")} ${figures.join(", ")}.`;
}
