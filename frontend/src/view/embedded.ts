// Inside another page, such as one of the documentation: that page scrolls, and has the switch of dark and light.

import { choice, type Choice } from "./theme";

const CHOICES: readonly unknown[] = ["auto", "light", "dark"] satisfies Choice[];

/** Tells the page around this one, if there is one, how high `shown` is, and takes that page's theme. */
export function embed(shown: HTMLElement): void {
  if (window.top === window) return;
  document.documentElement.dataset["embedded"] = "";
  window.addEventListener("message", ({ data, source }) => {
    if (source === parent && CHOICES.includes(data?.theme)) choice.set(data.theme as Choice);
  });
  new ResizeObserver(() => parent.postMessage({ height: Math.ceil(shown.getBoundingClientRect().height) }, "*")).observe(shown);
}
