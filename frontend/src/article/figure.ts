// A figure: what stands in the text as a still becomes live, as wide as it is shown, drawn at most once a picture.

import { h } from "../view/dom";
import type { Plot } from "./chart";
import { type Slider, button } from "./controls";
import { type Flown, TIME_STEP } from "./data";

export interface Stage {
  /** The element that holds the drawing. */
  readonly drawing: HTMLElement;
  readonly controls: HTMLElement;
  /** Among them, at the end: one row for the time and for what runs it. */
  readonly run: HTMLElement;
  /** By the names that links in the text use: `<a href="#nested" data-set="Lambda2=3 time=1">`. */
  readonly sliders: Map<string, Slider>;
  /** Its width now [px]. */
  readonly width: number;
  /** Asks for a drawing at the next picture. */
  redraw(): void;
}

export type Draw = () => string;

/** Makes a figure live. make: adds its controls and says how it is drawn. */
export function live(id: string, make: (stage: Stage) => Draw): void {
  const drawing = document.querySelector<HTMLElement>(`#${id} .drawing`);
  if (!drawing) return;
  const controls = h("div", { class: "controls" });
  drawing.after(controls);
  let [asked, width] = [false, 0];
  const stage: Stage = {
    drawing,
    controls,
    run: h("div", { class: "run" }),
    sliders: new Map(),
    get width() {
      return width;
    },
    redraw() {
      if (asked) return;
      asked = true;
      requestAnimationFrame(() => {
        asked = false;
        drawing.innerHTML = draw();
        drawing.dataset["live"] = "";
      });
    },
  };
  const draw = make(stage);
  const begun = new Map([...stage.sliders].map(([name, one]) => [name, one.value]));
  const glide = glider(stage);
  button(stage.run, "Reset", () => glide(begun));
  controls.append(stage.run);
  for (const link of document.querySelectorAll<HTMLElement>(`a[data-set][href="#${id}"]`)) {
    link.addEventListener("click", (event) => {
      event.preventDefault();
      const { top, bottom } = drawing.getBoundingClientRect();
      if (top < 0 || bottom > innerHeight) history.pushState(null, "", `#${id}`); // Back leads to the link again
      drawing.scrollIntoView({ block: "nearest", behavior: calm() ? "instant" : "smooth" });
      glide(new Map([...begun, ...link.dataset["set"]!.split(" ").map((one): [string, number] => [one.split("=")[0]!, Number(one.split("=")[1])])]));
    });
  }
  new ResizeObserver(() => {
    const now = Math.max(280, Math.floor(drawing.clientWidth));
    if (now !== width) [width] = [now], stage.redraw();
  }).observe(drawing);
}

export const calm = (): boolean => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Moves sliders to new values within half a second, so that one sees what changes; whoever takes a slider stops it. */
function glider(stage: Stage): (to: ReadonlyMap<string, number>) => void {
  let flight = 0;
  for (const kind of ["input", "pointerdown"] as const) stage.controls.addEventListener(kind, () => flight++);
  return (to) => {
    const mine = ++flight;
    const moves = [...to].map(([name, value]) => [stage.sliders.get(name)!, value] as const);
    const from = moves.map(([one]) => one.value);
    const begun = performance.now();
    const step = (now: number): void => {
      if (mine !== flight) return;
      const share = calm() ? 1 : Math.min(Math.max((now - begun) / 500, 0), 1);
      moves.forEach(([one, value], i) => one.set(share < 1 ? one.between(from[i]!, value, share * share * (3 - 2 * share)) : value));
      stage.redraw();
      if (share < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  };
}

/** Calls back with places of the drawing [px] while a finger or mouse drags over it. firm: the page does not scroll meanwhile. */
export function dragged(stage: Stage, moved: (left: number, top: number, first: boolean) => boolean, firm = true): void {
  const place = (event: PointerEvent): readonly [number, number] => {
    const box = stage.drawing.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  let held = false;
  stage.drawing.addEventListener("pointerdown", (event) => {
    held = moved(...place(event), true);
    if (held) stage.drawing.setPointerCapture(event.pointerId), event.preventDefault();
  });
  stage.drawing.addEventListener("pointermove", (event) => void (held && moved(...place(event), false)));
  if (firm) stage.drawing.addEventListener("touchstart", (event) => void (held && event.preventDefault()), { passive: false }); // or it scrolls
  for (const over of ["pointerup", "pointercancel"] as const) stage.drawing.addEventListener(over, () => (held = false));
}

/** The row of a flight at the slider's time, which ends where the flight does. */
export function rowAt(flown: Flown, time: Slider): number {
  const row = Math.min(flown.rows - 1, Math.round(time.value / flown.period));
  if (row * flown.period < time.value - TIME_STEP / 2) time.set(row * flown.period);
  return row;
}

/** A drag over a plot whose axis is time moves the time. */
export function scrub(stage: Stage, time: Slider, plots: () => readonly Plot[]): void {
  dragged(
    stage,
    (left, top, first) => {
      const over = plots().find(({ box }) => !first || (left >= box.left - 8 && left <= box.left + box.width + 8 && top >= box.top && top <= box.top + box.height));
      if (!over) return false;
      time.set(Number(over.at(left, top)[0].toFixed(2)));
      stage.redraw();
      return true;
    },
    false,
  );
}
