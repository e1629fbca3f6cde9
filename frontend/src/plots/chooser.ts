// Above the plots: which of them to show, and a plot of one's own.

import { byId, fill, h } from "../view/dom";
import { flat, rich } from "../view/notation";
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
  private readonly list = h("fieldset", { class: "pickables" });
  private readonly own = h("div");
  private readonly details = h("details", {}, h("summary", {}, "Choose and add plots"), this.list, this.own);
  private latest: Choosable | undefined;
  private boxes = new Map<string, HTMLInputElement>();
  private readonly keys = { panels: "", columns: "" };

  constructor(private readonly arrangement: Arrangement) {
    this.details.addEventListener("toggle", () => this.latest && this.show(this.latest));
    fill(byId("chooser"), this.details);
  }

  /** Once it is open; anew only where there is something else to choose, so that choices and the keyboard's place stay. */
  show(latest: Choosable): void {
    this.latest = latest;
    if (!this.details.open) return;
    const { panels, columns } = latest;
    const keys = { panels: JSON.stringify(panels.map(({ id, title }) => [id, title])), columns: JSON.stringify(columns) };
    if (keys.panels !== this.keys.panels) this.fillList(panels);
    if (keys.columns !== this.keys.columns) fill(this.own, this.form(columns));
    Object.assign(this.keys, keys);
    for (const { id, shown } of panels) this.boxes.get(id)!.checked = shown;
  }

  private fillList(panels: Choosable["panels"]): void {
    const held = [...this.boxes].find(([, box]) => box === document.activeElement)?.[0];
    this.boxes = new Map(panels.map(({ id }) => [id, h("input", { type: "checkbox" })]));
    const labels = panels.map(({ id, title }) => {
      const box = this.boxes.get(id)!;
      box.addEventListener("change", () => this.arrangement.choose(id, box.checked));
      return h("label", { class: "pickable" }, box, h("span", {}, ...rich(title)));
    });
    fill(this.list, h("legend", {}, "Plots"), ...labels);
    if (held !== undefined) this.boxes.get(held)?.focus();
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
    return h("fieldset", { class: "own-plot" }, h("legend", {}, "Make your own plot (Ctrl or Shift selects several columns)"), pick, h("div", { class: "own-how" }, kind, h("label", { class: "pickable" }, logarithmic, "log axis"), add), say);
  }
}
