// A control as the reader sees it: its name, its value to type, a slider.

import type { Control } from "../data/contract";
import { hold } from "../data/settings";
import { h } from "../view/dom";
import { join, plain, plainUnit } from "../view/format";
import { prose } from "../view/notation";

const FINE = 400; // positions of a slider

/** Between a slider's position, 0 to FINE, and a value. */
export function valueOfPosition(control: Control, position: number): number {
  const share = position / FINE;
  if (control.scale === "log") return Number((control.min * (control.max / control.min) ** share).toPrecision(3));
  const raw = control.min + share * (control.max - control.min);
  const step = stepSize(control);
  return Number((control.min + Math.round((raw - control.min) / step) * step).toPrecision(10));
}

export function positionOfValue(control: Control, value: number): number {
  const share =
    control.scale === "log"
      ? Math.log(value / control.min) / Math.log(control.max / control.min)
      : (value - control.min) / (control.max - control.min);
  return Math.round(Math.min(Math.max(Number.isFinite(share) ? share : 0, 0), 1) * FINE);
}

export interface Slider {
  readonly element: HTMLElement;
  /** Shows a value; null: several that differ. within: the control, with the ends that the slider has from now on. */
  show(value: number | null, within?: Control): void;
}

/** label: of the whole, for the reader's ear. original: the file's value, marked; null: several. about: the id of what explains it. moving: while it is dragged; chosen: when it is let go or typed. */
export function slider(
  control: Control,
  label: string,
  short: string,
  original: number | null,
  about: string,
  moving: (value: number) => void,
  chosen: (value: number) => void,
): Slider {
  const unit = plainUnit(control.unit);
  const named = { "aria-label": unit ? `${label} in ${prose(unit)}` : label, "aria-describedby": about };
  const range = h("input", { type: "range", min: 0, max: FINE, ...named });
  const typed = h("input", { type: "text", inputmode: "decimal", spellcheck: "false", autocomplete: "off", ...named, size: 7 });
  const [least, most] = [h("span"), h("span")];
  const ends = h("div", { class: "ends", "aria-hidden": "true" }, least, most);
  const track = h("div", { class: original === null ? "track" : "track marked" }, range, ends);
  const complaint = h("p", { class: "complaint", role: "status", hidden: true });
  const element = h("div", { class: "slider" }, short ? h("span", { class: "axis" }, short) : null, track, typed, h("span", { class: "unit" }, prose(unit)), complaint);
  let current: number | null = null;
  let reach: Control | undefined;

  const forgive = (): void => {
    complaint.hidden = true;
    typed.removeAttribute("aria-invalid");
  };
  const show = (value: number | null, within = reach ?? control): void => {
    if (within !== reach) {
      reach = within;
      [least.textContent, most.textContent] = [plain(reach.min), plain(reach.max)];
      range.step = String(stepOf(reach));
      if (original !== null) track.style.setProperty("--original", String(positionOfValue(reach, original) / FINE));
    }
    if (value !== current) forgive();
    current = value;
    typed.value = value === null ? "" : plain(value);
    typed.placeholder = value === null ? "differ" : "";
    typed.title = value === null || plain(value) === exact(value) ? "" : exact(value);
    if (value !== null) {
      range.value = String(positionOfValue(within, value));
      range.setAttribute("aria-valuetext", join(plain(value), unit));
      range.style.setProperty("--at", `${(Number(range.value) / FINE) * 100}%`);
    }
  };
  range.addEventListener("input", () => {
    const value = hold(control, valueOfPosition(reach ?? control, Number(range.value)));
    forgive();
    show(value);
    moving(value);
  });
  range.addEventListener("change", () => chosen(hold(control, valueOfPosition(reach ?? control, Number(range.value)))));
  typed.addEventListener("change", () => {
    const value = Number(typed.value.trim().replaceAll("−", "-").replace(",", "."));
    const usable = typed.value.trim() !== "" && Number.isFinite(value);
    const why = usable ? beyond(control, value) : `“${typed.value.trim().slice(0, 20)}” is not a number.`;
    if (usable) chosen(hold(control, value));
    show(usable ? hold(control, value) : current);
    if (!usable) typed.setAttribute("aria-invalid", "true");
    complaint.textContent = why;
    complaint.hidden = !why;
  });
  typed.addEventListener("input", forgive); // the number that was there before counts as no change
  typed.addEventListener("focus", () => {
    if (current !== null) typed.value = exact(current);
    typed.select();
  });
  typed.addEventListener("blur", () => show(current));
  return { element, show };
}

/** What is said of a typed number outside what a control allows; "" within. */
function beyond(control: Control, value: number): string {
  const taken = hold(control, value);
  if (taken === value) return "";
  if (value < control.low || value > control.high) {
    return `${plain(value)} is ${value < taken ? "below the least" : "above the greatest"} allowed, ${plain(taken)}, which is used.`;
  }
  return `${plain(value)} becomes ${plain(taken)}.`;
}

/** All digits of the number that flies. */
function exact(value: number): string {
  return String(value).replaceAll("-", "−");
}

function stepOf(control: Control): number {
  return control.scale === "log" ? 1 : Math.max((stepSize(control) / (control.max - control.min)) * FINE, 1);
}

/** Of a linear slider: the control's own step, or the least of 1, 2 and 5 times a power of ten that is not finer than a position. */
function stepSize({ min, max, step }: Control): number {
  const least = (max - min) / FINE;
  const ten = 10 ** Math.floor(Math.log10(least));
  return step > 0 ? step : ten * [1, 2, 5, 10].find((times) => times * ten >= least * (1 - 1e-9))!;
}
