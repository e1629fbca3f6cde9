// Sliders, switches and buttons under a figure. Moving one draws the figure anew at the next picture.

import { h } from "../view/dom";
import { rich } from "../view/notation";
import { TIME_STEP } from "./data";
import type { Stage } from "./figure";
import { minus } from "./words";

export interface Slider {
  readonly value: number;
  set(value: number): void;
  /** The value at this share of the way from one to another, as the slider moves. */
  between(from: number, to: number, share: number): number;
}

const STEPS = 200;

/** A slider with its name, value and unit; logarithmic if `log`. key: what links in the text call it. */
export function slider(
  stage: Stage,
  key: string,
  name: string,
  unit: string,
  [least, most, value]: readonly [number, number, number],
  log = false,
  where: Element = stage.controls,
): Slider {
  const input = h("input", { type: "range", min: 0, max: STEPS, step: 1 });
  const shown = h("output", { "aria-hidden": "true" }); // the slider says it
  const inward = (x: number): number => (log ? Math.log(x / least) / Math.log(most / least) : (x - least) / (most - least));
  const outward = (share: number): number => (log ? least * (most / least) ** share : least + share * (most - least));
  const tidy = (x: number): number => (key === "time" ? Number((Math.round(x / TIME_STEP) * TIME_STEP).toFixed(2)) : x);
  let now = value;
  const show = (): void => {
    shown.textContent = `${minus(Number(now.toPrecision(3)))}${unit && ` ${unit}`}`;
    input.setAttribute("aria-valuetext", shown.textContent);
    input.style.setProperty("--at", `${100 * inward(now)}%`);
  };
  const made: Slider = {
    get value() {
      return now;
    },
    set(to) {
      now = tidy(Math.min(Math.max(to, least), most));
      input.value = String(STEPS * inward(now));
      show();
    },
    between: (from, to, share) => outward(inward(from) + share * (inward(to) - inward(from))),
  };
  input.addEventListener("input", () => {
    now = tidy(Number(outward(Number(input.value) / STEPS).toPrecision(3)));
    show();
    stage.redraw();
  });
  where.append(h("label", { class: "slider" }, h("span", { class: "name" }, ...rich(name)), input, shown));
  made.set(value);
  stage.sliders.set(key, made);
  return made;
}

/** A choice between a few things, the first one at the beginning. */
export function choice(where: Element, name: string, options: readonly string[], changed: () => void): { readonly value: number } {
  let now = 0;
  const buttons = options.map((option, i) => {
    const button = h("button", { type: "button", class: "plain", "aria-pressed": String(i === 0) }, option);
    button.addEventListener("click", () => {
      now = i;
      buttons.forEach((one, k) => one.setAttribute("aria-pressed", String(k === i)));
      changed();
    });
    return button;
  });
  where.append(h("div", { class: "choice", role: "group", "aria-label": name }, h("span", { class: "name" }, name), ...buttons));
  return {
    get value() {
      return now;
    },
  };
}

export function button(where: Element, name: string, pressed: () => void): HTMLButtonElement {
  const made = h("button", { type: "button", class: "plain" }, name);
  made.addEventListener("click", pressed);
  where.append(made);
  return made;
}
