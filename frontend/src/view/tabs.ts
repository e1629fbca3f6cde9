// Where the screen is too narrow for all at once: one of plots, controls and story.

import { byId } from "./dom";

export type Pane = "plots" | "controls" | "story";

/** Gives the function that shows a pane. */
export function tabs(): (pane: Pane) => void {
  const buttons = [...byId("tabs").querySelectorAll<HTMLButtonElement>("button")];
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
