// Above the plots: which of them to show, and a plot of one's own.

import { byId, fill, h } from "../view/dom";
import { flat } from "../view/notation";
import type { Arrangement } from "./arrangement";
import type { Kind } from "./custom";

const KINDS: readonly (readonly [Kind, string])[] = [
  ["time", "over time"],
  ["spectrum", "spectrum"],
  ["phase", "one against another"],
];

export interface Choosable {
  readonly panels: readonly { readonly id: string; readonly title: string; readonly shown: boolean }[];
  readonly columns: readonly { readonly name: string; readonly unit: string; readonly of: "flight" | "log" }[];
}

export class Chooser {
  private key = "";
  private boxes = new Map<string, HTMLInputElement>();

  constructor(private readonly arrangement: Arrangement) {}

  show(choosable: Choosable): void {
    const { panels, columns } = choosable;
    const key = JSON.stringify([panels.map(({ id, title }) => [id, title]), columns.map(({ name }) => name)]);
    if (key !== this.key) this.build(choosable);
    this.key = key;
    for (const { id, shown } of panels) this.boxes.get(id)!.checked = shown;
  }

  /** Anew only where there is something else to choose, so that the keyboard stays where it is. */
  private build({ panels, columns }: Choosable): void {
    this.boxes = new Map(panels.map(({ id }) => [id, h("input", { type: "checkbox" })]));
    const open = byId("chooser").querySelector("details")?.open ?? false;
    const boxes = panels.map(({ id, title }) => {
      const box = this.boxes.get(id)!;
      box.addEventListener("change", () => this.arrangement.choose(id, box.checked));
      return h("label", { class: "pickable" }, box, flat(title));
    });
    const list = h("fieldset", { class: "pickables" }, h("legend", {}, "Plots"), ...boxes);
    fill(byId("chooser"), h("details", { open }, h("summary", {}, "Choose and add plots"), list, this.form(columns)));
  }

  private form(columns: Choosable["columns"]): HTMLElement {
    const options = (of: "flight" | "log"): HTMLElement[] =>
      columns.filter((column) => column.of === of).map(({ name, unit }) => h("option", { value: name }, `${flat(name)}${unit && unit !== "-" ? ` [${unit}]` : ""}`));
    const [own, log] = [options("flight"), options("log")];
    const pick = h("select", { multiple: true, size: 7, id: "own-columns", "aria-label": "Columns of the new plot" }, h("optgroup", { label: "This flight" }, ...own), log.length ? h("optgroup", { label: "The log" }, ...log) : null);
    const kind = h("select", { id: "own-kind", "aria-label": "Kind of the new plot" }, ...KINDS.map(([value, text]) => h("option", { value }, text)));
    const logarithmic = h("input", { type: "checkbox", id: "own-log" });
    const add = h("button", { type: "button", class: "plain", id: "own-add" }, "Add the plot");
    const say = h("p", { class: "quiet", role: "status" });
    add.addEventListener("click", () => {
      const chosen = [...pick.selectedOptions].map((option) => option.value);
      const wanted = kind.value as Kind;
      const right = wanted === "phase" ? chosen.length === 2 : chosen.length > 0 && chosen.length <= 8;
      say.textContent = right ? "" : wanted === "phase" ? "Choose two columns: the first is the horizontal axis." : "Choose one to eight columns.";
      if (right) this.arrangement.add(wanted, chosen, logarithmic.checked || wanted === "spectrum");
    });
    return h("fieldset", { class: "own-plot" }, h("legend", {}, "A plot of your own; Ctrl or Shift for several columns"), pick, h("div", { class: "own-how" }, kind, h("label", { class: "pickable" }, logarithmic, "log axis"), add), say);
  }
}
