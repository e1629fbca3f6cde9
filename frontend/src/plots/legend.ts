// The names of a plot's curves with their strokes, and what they are at the cursor. Wanted ones share one entry: the pale band.

import { h, swatch } from "../view/dom";
import { type Scale, number, steady } from "../view/format";
import { rich } from "../view/notation";
import type { Palette } from "../view/theme";
import { type Curve, type Panel, strokeOf, valueAt } from "./panel";

export class Legend {
  readonly element = h("dl", { class: "legend" });
  /** What the pale band and the dots are. */
  readonly roles = h("span", { class: "roles" });
  private cells: { curve: Curve; cell: HTMLElement }[] = [];
  private built = "";

  show(panel: Panel, palette: Palette): void {
    const key = [palette.dark, panel.title, ...panel.curves.map(({ label, role, hue }) => `${label} ${role} ${hue}`)].join("\n");
    const flown = panel.curves.filter((curve) => curve.role === "flown");
    if (key === this.built) {
      this.cells = this.cells.map(({ cell }, i) => ({ curve: flown[i]!, cell }));
      return;
    }
    this.built = key;
    this.element.replaceChildren();
    this.roles.replaceChildren();
    this.cells = [];
    for (const curve of flown) {
      const cell = h("dd");
      this.cells.push({ curve, cell });
      this.element.append(h("div", {}, h("dt", {}, mark(curve, palette), h("span", {}, ...rich(curve.label))), cell));
    }
    for (const role of ["desired", "ghost", "kept", "file"] as const) {
      const first = panel.curves.find((curve) => curve.role === role);
      const band = panel.title.includes("commanded") ? "commanded" : panel.id === "rotors" ? "without the fault" : panel.id === "net" ? "to cancel" : role;
      const name = role === "desired" ? band : role;
      if (first) this.roles.append(h("span", {}, mark(first, palette, palette.muted), name));
    }
  }

  /** What the curves are at time t. size: of the largest of the panel's values. */
  values(panel: Panel, t: number, scale: Scale, size: number): void {
    for (const { curve, cell } of this.cells) {
      const value = (panel.across ? Number.NaN : valueAt(curve, t)) * scale.factor;
      const text = panel.across ? "" : panel.logarithmic ? number(value, 3) : steady(value, size * scale.factor);
      if (cell.textContent !== text) cell.textContent = text;
    }
  }
}

function mark(curve: Curve, palette: Palette, colour?: string): SVGSVGElement {
  const stroke = strokeOf(curve, palette);
  const made = swatch(colour ?? stroke.colour, stroke.dash, stroke.width);
  made.style.opacity = String(stroke.opacity);
  return made;
}
