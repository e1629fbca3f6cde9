// One control with all its components: one slider while they are equal, one each when split.

import type { Control } from "../data/contract";
import { h } from "../view/dom";
import { flat, prose, rich } from "../view/notation";
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
  const unit = control.unit && control.unit !== "-" ? h("span", { class: "unit" }, ` ${prose(control.unit)}`) : null;
  return h("span", { class: "name", title: control.hint || null }, ...rich(control.label), unit);
}

/** Whether components have words for names, not letters. */
function worded(control: Control): boolean {
  return control.components.some((component) => flat(component.label).length > 2);
}

function toggleCard(control: Control, tell: Tell): Card {
  const box = h("input", { type: "checkbox", role: "switch" });
  const element = h("label", { class: "control toggle" }, title(control), box);
  box.addEventListener("change", () => tell(control, control.components.map(() => (box.checked ? 1 : 0)), true));
  return { control, element, show: (values) => (box.checked = values.some((value) => value !== 0)) };
}

function sliderCard(control: Control, tell: Tell): Card {
  const several = control.components.length > 1;
  let values: number[] = control.components.map((component) => component.value);
  let split = false;

  const send = (wanted: number[], final: boolean): void => {
    values = wanted;
    tell(control, values, final);
    if (final) mark();
  };
  const every = (value: number): number[] => values.map(() => value);
  const one = (i: number, value: number): number[] => values.map((old, k) => (k === i ? value : old));

  const all: Slider = slider(control, control.label, "", (v) => send(every(v), false), (v) => send(every(v), true));
  const each: Slider[] = control.components.map((component, i) =>
    slider(control, `${control.label} ${component.label}`, flat(component.label), (v) => send(one(i, v), false), (v) => send(one(i, v), true)),
  );
  const parts = h("div", { class: worded(control) ? "parts worded" : "parts" }, ...each.map((part) => part.element));
  const splitter = h("button", { type: "button", class: "split" });
  const reset = h("button", { type: "button", class: "reset", title: "Restore original value", "aria-label": `${control.label}: restore original value` }, "↺");
  const head = h("div", { class: "head" }, title(control), several ? splitter : null, reset);
  const element = h("div", { class: "control" }, head, all.element, parts);

  const mark = (): void => {
    const changed = values.some((value, i) => value !== control.components[i]!.value);
    element.classList.toggle("changed", changed);
    reset.hidden = !changed;
  };
  const layout = (): void => {
    all.element.hidden = split;
    parts.hidden = !split;
    splitter.textContent = split ? "together" : "split";
    splitter.setAttribute("aria-expanded", String(split));
    splitter.setAttribute("aria-label", split ? `together: one value for all axes of ${control.label}` : `split: a value for each axis of ${control.label}`);
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
    if (several && !equal) split = true;
    all.show(equal ? values[0]! : null);
    each.forEach((part, i) => part.show(values[i]!));
    layout();
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
