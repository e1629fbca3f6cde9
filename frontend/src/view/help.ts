// Keys, mouse and fingers, in a dialog.

import { byId, h } from "./dom";

const KEYS: readonly (readonly [string, string])[] = [
  ["Space", "play, pause"],
  ["← →", "move the time cursor; with Shift in large steps"],
  ["Home End", "to the start, to the end"],
  ["n p", "next, previous flight"],
  ["c", "camera: orbit, follow"],
  ["[ ] + −", "turn and zoom the scene"],
  ["+ − 0", "on a plot: zoom at the cursor, show all"],
  ["d", "dark, light"],
];

const HANDS: readonly (readonly [string, string])[] = [
  ["Logs", "drop a CSV, a ULog or an MCAP file (JSON messages, uncompressed) anywhere to see it together with the flight"],
  ["Plots", "hover reads values, click moves the cursor, drag zooms, double click shows all; wheel zooms with Ctrl or after a click; ↑ ↓ move a plot, ✕ hides it, log changes its axis"],
  ["Scene", "drag turns, wheel zooms, right drag pans"],
  ["Touch", "in the scene one finger turns, two zoom and pan; on a plot one moves the cursor, two zoom, a double tap shows all"],
  ["Sliders", "the flight follows while you drag, showing only its beginning if necessary, and is flown whole when you let go; any number can be typed next to a slider"],
];

export function help(): () => void {
  const dialog = byId("help") as HTMLDialogElement;
  const list = (pairs: readonly (readonly [string, string])[]): HTMLElement => {
    const made = h("dl");
    for (const [key, what] of pairs) made.append(h("div", {}, h("dt", {}, key), h("dd", {}, what)));
    return made;
  };
  const close = h("button", { type: "button", class: "plain" }, "Close");
  close.addEventListener("click", () => dialog.close());
  const title = h("h2", { tabindex: -1 }, "Keyboard, mouse and touch");
  dialog.append(title, list(KEYS), list(HANDS), close);
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  return () => {
    if (dialog.open) return dialog.close();
    dialog.showModal();
    title.focus(); // by itself: a frame refuses autofocus, and says so on the console
  };
}
