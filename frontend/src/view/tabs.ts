// Where the screen is too narrow for all at once: one of plots, controls and story.

import { byId } from "./dom";

export type Pane = "guide" | "plots" | "controls" | "story";

/** Gives the function that shows a pane. walk: whether there is one. */
export function tabs(walk: boolean): (pane: Pane) => void {
  const all = [...byId("tabs").querySelectorAll<HTMLButtonElement>("button")];
  for (const button of all) button.hidden = button.value === "guide" && !walk;
  const buttons = all.filter((button) => !button.hidden);
  const show = (pane: string): void => {
    document.body.dataset["pane"] = pane;
    for (const button of buttons) button.setAttribute("aria-selected", String(button.value === pane));
    for (const button of buttons) button.tabIndex = button.value === pane ? 0 : -1;
  };
  buttons.forEach((button, i) => {
    button.addEventListener("click", () => show(button.value));
    button.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      const next = step && buttons[(i + step + buttons.length) % buttons.length];
      if (!next) return;
      event.preventDefault();
      event.stopPropagation();
      show(next.value);
      next.focus();
    });
  });
  show("plots");
  return show;
}
