// Keys that work wherever the focus is, unless it is on something that needs them itself.

import type { Clock } from "./clock";

const STEP = 1 / 100; // of the flight, a press of an arrow
const LEAP = 1 / 10; // with shift

export interface Keys {
  readonly camera: () => void;
  readonly theme: () => void;
  readonly help: () => void;
  readonly walk: (step: 1 | -1) => void;
  /** A key of the scene; whether it was one. */
  readonly scene: (key: string) => boolean;
}

export function listenToKeys(clock: Clock, keys: Keys): void {
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector("dialog[open]")) return;
    const target = event.target instanceof HTMLElement ? event.target : document.body;
    if (typing(target) || !handle(event, target, clock, keys)) return;
    event.preventDefault();
  });
}

function handle(event: KeyboardEvent, target: HTMLElement, clock: Clock, keys: Keys): boolean {
  const step = clock.end.value * (event.shiftKey ? LEAP : STEP);
  const sliding = target instanceof HTMLInputElement && target.type === "range" && target.id !== "scrub";
  switch (event.key) {
    case " ":
      // Someone who walks the page by keys presses the button that is lit up; after a click the space bar plays.
      if (target.matches("select, input[type=checkbox]") || (target.matches("button, summary, a") && target.matches(":focus-visible"))) return false;
      if (target.matches("button, summary, a")) target.blur();
      clock.toggle();
      return true;
    case "ArrowLeft":
    case "ArrowRight":
      if (sliding || target.matches("select")) return false;
      clock.playing.set(false);
      clock.seek(clock.time.value + (event.key === "ArrowLeft" ? -step : step));
      return true;
    case "Home":
    case "End":
      if (sliding || target.matches("select")) return false;
      clock.seek(event.key === "Home" ? 0 : clock.end.value);
      return true;
    case "c":
      keys.camera();
      return true;
    case "d":
      keys.theme();
      return true;
    case "?":
      keys.help();
      return true;
    case "n":
    case "p":
      keys.walk(event.key === "n" ? 1 : -1);
      return true;
    default:
      return keys.scene(event.key);
  }
}

/** Whether letters belong to the element. */
function typing(target: HTMLElement): boolean {
  return target instanceof HTMLTextAreaElement || (target instanceof HTMLInputElement && target.type === "text") || target instanceof HTMLSelectElement;
}
