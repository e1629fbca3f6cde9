// Dark and light: the system's wish until someone chooses. Curves are Okabe and Ito's colours, each with its own dash.

import { Watched } from "./events";

export interface Palette {
  readonly dark: boolean;
  readonly paper: string;
  readonly panel: string;
  readonly ink: string;
  readonly muted: string;
  readonly line: string;
  readonly grid: string;
  readonly blue: string;
  readonly orange: string;
  readonly green: string;
  readonly vermillion: string;
  readonly pink: string;
  readonly sky: string;
}

// Okabe and Ito (2008). Blue is lifted on dark and orange lowered on light, for contrast; hues stay.
const LIGHT: Palette = {
  dark: false,
  paper: "#f6f5f1",
  panel: "#fdfcfa",
  ink: "#1c2126",
  muted: "#62696f",
  line: "#d9d6ce",
  grid: "#e9e6df",
  blue: "#0072b2",
  orange: "#d98a00",
  green: "#009e73",
  vermillion: "#d55e00",
  pink: "#b95f92",
  sky: "#3fa0d8",
};

const DARK: Palette = {
  dark: true,
  paper: "#0f1215",
  panel: "#15191d",
  ink: "#e8e6e1",
  muted: "#9aa1a8",
  line: "#2b3137",
  grid: "#20262b",
  blue: "#4aa8e0",
  orange: "#e69f00",
  green: "#1fbf92",
  vermillion: "#ee7a2c",
  pink: "#d98bb6",
  sky: "#7cc8f2",
};

export type Choice = "auto" | "light" | "dark";

const system = window.matchMedia("(prefers-color-scheme: dark)");

export const choice = new Watched<Choice>("auto");
export const palette = new Watched<Palette>(system.matches ? DARK : LIGHT);

function apply(printing = false): void {
  const dark = !printing && (choice.value === "dark" || (choice.value === "auto" && system.matches));
  document.documentElement.dataset["theme"] = dark ? "dark" : "light";
  palette.set(dark ? DARK : LIGHT);
}

/** Follows the system and the switch; paper is light. */
export function startTheme(): void {
  choice.watch(() => apply());
  system.addEventListener("change", () => apply());
  window.addEventListener("beforeprint", () => apply(true));
  window.addEventListener("afterprint", () => apply());
}

/** To the other of dark and light. */
export function toggleTheme(): void {
  choice.set(palette.value.dark ? "light" : "dark");
}
