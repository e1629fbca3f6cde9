// One control with all its components: one slider while they are equal, one each when split.

import type { Control } from "../data/contract";
import { append, h } from "../view/dom";
import { join, plain, plainUnit } from "../view/format";
import { closed, flat, prose, rich, spoken } from "../view/notation";
import { type Slider, slider } from "./slider";

export interface Card {
  readonly control: Control;
  readonly element: HTMLElement;
  show(values: readonly number[]): void;
}

type Tell = (control: Control, values: readonly number[], final: boolean) => void;

export function card(control: Control, tell: Tell): Card {
  return control.kind === "toggle" ? toggleCard(control, tell) : sliderCard(control, tell);
}

function title(control: Control): HTMLElement {
  return h("span", { class: "name" }, ...rich(control.label));
}

const UNBOUNDED = 1e9; // what Python sends where a number has no limit of its own, and 1e-9 where it has to be above 0

/** What can be typed beside a slider, in words where there is no limit. */
function typable({ low, high }: Control): string {
  if (high < UNBOUNDED) return `you can type ${plain(low)} to ${plain(high)}`;
  if (low > 0 && low <= 1 / UNBOUNDED) return "you can type any positive number";
  return low > -UNBOUNDED ? `you can type any value ≥ ${plain(low)}` : "you can type any number";
}

let made = 0;

/** A button and the line that it shows: what the control is, how far it goes (told by `reaches`), and what it was. */
function about(control: Control): { button: HTMLElement; line: HTMLElement; original: number | null; reaches: (reach: Control) => void } {
  const [first, ...others] = control.components.map(({ value }) => value);
  const original = others.every((value) => value === first) ? first! : null;
  const shown = (value: number): string => (control.kind === "toggle" ? (value ? "on" : "off") : join(plain(value), prose(plainUnit(control.unit))));
  const far = h("span");
  const { low, high } = control;
  const file = original === null ? control.components.map(({ label, value }) => `${flat(label)} ${shown(value)}`).join(", ") : shown(original);
  const line = h("p", { class: "hint", id: `about-${++made}`, hidden: true }, ...rich(closed(control.hint)), " ", far, `Original: ${file}.`);
  const button = h("button", { type: "button", class: "about", "aria-expanded": "false", "aria-controls": line.id, "aria-label": `About ${spoken(control.label)}` }, "?");
  button.addEventListener("click", (event) => {
    event.preventDefault(); // within a label it would switch as well
    line.hidden = !line.hidden;
    button.setAttribute("aria-expanded", String(!line.hidden));
  });
  return { button, line, original, reaches: ({ min, max }) => (far.textContent = min <= low && max >= high ? `${plain(min)} to ${shown(max)}. ` : `Slider ${plain(min)} to ${shown(max)}; ${typable(control)}. `) };
}

/** Whether components have words for names, not letters. */
function worded(control: Control): boolean {
  return control.components.some((component) => flat(component.label).length > 2);
}

function toggleCard(control: Control, tell: Tell): Card {
  const { button, line } = about(control);
  const box = h("input", { type: "checkbox", role: "switch", "aria-describedby": line.id });
  const element = h("div", { class: "control" }, h("div", { class: "head" }, h("label", { class: "toggle" }, title(control), box), button), line);
  box.addEventListener("change", () => tell(control, control.components.map(() => (box.checked ? 1 : 0)), true));
  return { control, element, show: (values) => (box.checked = values.some((value) => value !== 0)) };
}

function sliderCard(control: Control, tell: Tell): Card {
  const several = control.components.length > 1;
  let values: number[] = control.components.map((component) => component.value);
  let split = false;
  let dragged = false; // while it is, the range must not shrink below the finger

  const send = (wanted: number[], final: boolean): void => {
    values = wanted;
    dragged = !final;
    tell(control, values, final);
    if (final) mark();
  };
  const every = (value: number): number[] => values.map(() => value);
  const one = (i: number, value: number): number[] => values.map((old, k) => (k === i ? value : old));

  const { button, line, original, reaches } = about(control);
  reaches(control);
  let reach = control; // a value from a link, a step of the walk, or typed, may be beyond what the slider was made for
  const label = spoken(control.label);
  const all: Slider = slider(control, label, "", original, line.id, (v) => send(every(v), false), (v) => send(every(v), true));
  let each: Slider[] = []; // made once they are seen
  const parts = h("div", { class: worded(control) ? "parts worded" : "parts" });
  const splitter = h("button", { type: "button", class: "split" });
  const reset = h("button", { type: "button", class: "reset", title: "Restore original value", "aria-label": `${label}: restore original value` }, "↺");
  const head = h("div", { class: "head" }, title(control), reset, several ? splitter : null, button);
  const element = h("div", { class: "control" }, head, line, all.element, parts);

  const mark = (): void => {
    const changed = values.some((value, i) => value !== control.components[i]!.value);
    element.classList.toggle("changed", changed);
    reset.hidden = !changed;
  };
  const layout = (): void => {
    if (split && !each.length) {
      each = control.components.map((component, i) =>
        slider(control, `${label} ${spoken(component.label)}`.trim(), flat(component.label), component.value, line.id, (v) => send(one(i, v), false), (v) => send(one(i, v), true)),
      );
      append(parts, ...each.map((part) => part.element));
    }
    all.element.hidden = split;
    parts.hidden = !split;
    splitter.textContent = split ? "together" : "split";
    splitter.setAttribute("aria-expanded", String(split));
    splitter.setAttribute("aria-label", split ? `together: one value for all axes of ${label}` : `split: a value for each axis of ${label}`);
  };
  splitter.addEventListener("click", () => {
    split = !split;
    if (!split && values.some((value) => value !== values[0])) send(every(values[0]!), true);
    refresh();
  });
  reset.addEventListener("click", () => {
    send(control.components.map((component) => component.value), true);
    refresh();
  });
  const refresh = (): void => {
    const equal = values.every((value) => value === values[0]);
    const from = dragged ? reach : control;
    const [min, max] = [Math.min(from.min, ...values), Math.max(from.max, ...values)];
    if (min !== reach.min || max !== reach.max) reaches((reach = { ...control, min, max }));
    if (several && !equal) split = true;
    layout();
    all.show(equal ? values[0]! : null, reach);
    each.forEach((part, i) => part.show(values[i]!, reach));
    mark();
  };
  return {
    control,
    element,
    show(shown) {
      values = [...shown];
      refresh();
    },
  };
}
