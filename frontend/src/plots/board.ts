// All plots of a flight, with one time cursor and one stretch of time.

import type { FlightData } from "../data/contract";
import type { Flight } from "../data/flight";
import type { Clock } from "../view/clock";
import { fill, h } from "../view/dom";
import { download, downloadText, fileName } from "../view/download";
import { palette } from "../view/theme";
import { plotPng, plotSvg } from "./export";
import { listen } from "./interaction";
import { panelOf } from "./panels";
import { Plot } from "./plot";
import { TimeWindow } from "./range";

export class Board {
  readonly window = new TimeWindow();
  private plots: Plot[] = [];
  private caption = "";

  constructor(
    private readonly host: HTMLElement,
    private readonly clock: Clock,
  ) {
    this.window.zoomed.follow(() => this.plots.forEach((plot) => plot.redraw()));
    palette.follow(() => this.plots.forEach((plot) => plot.recolour()));
    clock.time.follow((t) => this.plots.forEach((plot) => plot.setTime(t)));
    void document.fonts.ready.then(() => this.plots.forEach((plot) => plot.redraw()));
  }

  /** The plots of a flight; those already there stay and change their curves. */
  show(data: FlightData, flight: Flight, ghost: Flight | undefined, end: number): void {
    this.window.setWhole(end);
    this.caption = data.name;
    const panels = data.panels.flatMap((panel) => panelOf(panel, flight, ghost) ?? []);
    const same = panels.length === this.plots.length && panels.every((panel, i) => this.plots[i]!.panel.id === panel.id);
    if (same) {
      panels.forEach((panel, i) => this.plots[i]!.show(panel));
      return;
    }
    this.plots = panels.map((panel) => {
      const tools = h("span", { class: "tools" });
      const plot = new Plot(panel, this.window, tools);
      this.addTools(plot, tools);
      listen(plot, this.window, this.clock, (t) => this.plots.forEach((each) => each.setHover(t, each === plot)));
      plot.setTime(this.clock.time.value);
      return plot;
    });
    fill(this.host, ...this.plots.map((plot) => plot.element));
  }

  /** Bring plots forward: scroll to the first of them and mark them all for a moment. */
  point(ids: readonly string[]): void {
    const found = this.plots.filter((plot) => ids.includes(plot.panel.id));
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    found[0]?.element.scrollIntoView({ behavior: calm ? "auto" : "smooth", block: "nearest" });
    for (const { element } of found) {
      element.classList.remove("pointed");
      requestAnimationFrame(() => element.classList.add("pointed"));
    }
  }

  private addTools(plot: Plot, host: HTMLElement): void {
    const button = (format: string, save: () => void): HTMLButtonElement => {
      const title = `Download “${plot.panel.title}” as ${format}`;
      const made = h("button", { type: "button", title, "aria-label": title }, format);
      made.addEventListener("click", save);
      return made;
    };
    const name = (suffix: string): string => fileName(`${this.caption} ${plot.panel.title}`, suffix);
    host.append(
      button("SVG", () => downloadText(name("svg"), plotSvg(plot, this.caption), "image/svg+xml")),
      button("PNG", () => void plotPng(plot, this.caption).then((blob) => download(name("png"), blob))),
    );
  }
}
