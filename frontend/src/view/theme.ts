// Dark and light: the system's wish until someone chooses. The colours are those of report/colours.css; each curve has its own dash too.

import { Watched } from "./events";

const NAMES = ["paper", "panel", "ink", "muted", "line", "grid", "blue", "orange", "green", "vermillion", "pink", "sky"] as const;

export type Palette = { readonly dark: boolean } & Readonly<Record<(typeof NAMES)[number], string>>;

function shown(dark: boolean): Palette {
  document.documentElement.dataset["theme"] = dark ? "dark" : "light";
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries([["dark", dark], ...NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()])]) as Palette;
}

export type Choice = "auto" | "light" | "dark";

const system = window.matchMedia("(prefers-color-scheme: dark)");

export const choice = new Watched<Choice>("auto");
export const palette = new Watched<Palette>(shown(system.matches));

function apply(printing = false): void {
  const dark = !printing && (choice.value === "dark" || (choice.value === "auto" && system.matches));
  palette.set(shown(dark));
}

/** Follows the system and the switch; paper is light. */
export function startTheme(): void {
  choice.watch(() => apply());
  system.addEventListener("change", () => apply());
  window.addEventListener("beforeprint", () => apply(true));
  window.addEventListener("afterprint", () => apply());
  const paper = window.matchMedia("print"); // where it is only looked at, nothing says that it is printed
  paper.addEventListener("change", () => window.dispatchEvent(new Event(paper.matches ? "beforeprint" : "afterprint")));
}

/** To the other of dark and light. */
export function toggleTheme(): void {
  choice.set(palette.value.dark ? "light" : "dark");
}
