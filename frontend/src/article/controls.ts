// Sliders, switches and buttons under a figure. Moving one draws the figure anew at the next picture.

import { h } from "../view/dom";
import { rich } from "../view/notation";
import { minus } from "./words";

export interface Slider {
  readonly value: number;
  set(value: number): void;
}

/** A slider with its name, value and unit; logarithmic if `log`. symbol: which formula lights up with it. */
export function slider(
  where: Element,
  name: string,
  unit: string,
  [least, most, value]: readonly [number, number, number],
  changed: () => void,
  log = false,
): Slider {
  const inward = (x: number): number => (log ? Math.log(x) : x);
  const outward = (x: number): number => (log ? Math.exp(x) : x);
  const input = h("input", { type: "range", min: inward(least), max: inward(most), step: (inward(most) - inward(least)) / 200 });
  const shown = h("output", {});
  let now = value;
  const show = (): void => {
    shown.textContent = `${minus(Number(now.toPrecision(3)))}${unit && ` ${unit}`}`;
    input.setAttribute("aria-valuetext", shown.textContent);
    input.style.setProperty("--at", `${(100 * (inward(now) - inward(least))) / (inward(most) - inward(least))}%`);
  };
  const set = (to: number): void => {
    now = Math.min(Math.max(to, least), most);
    input.value = String(inward(now));
    show();
  };
  input.addEventListener("input", () => {
    now = Number(outward(Number(input.value)).toPrecision(3));
    show();
    changed();
  });
  const label = h("label", { class: "slider" }, h("span", { class: "name" }, ...rich(name)), input, shown);
  where.append(label);
  set(value);
  return {
    get value() {
      return now;
    },
    set,
  };
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
