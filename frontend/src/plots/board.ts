// All plots of a flight, with one time cursor and one stretch of time; and one that is watched elsewhere on the page.

import type { Session, Shown } from "../session";
import type { Clock } from "../view/clock";
import { fill, h } from "../view/dom";
import { download, downloadText, fileName } from "../view/download";
import { palette } from "../view/theme";
import { plotPng, plotSvg } from "./export";
import { listen } from "./interaction";
import { NetFoot, netPanel } from "./net";
import type { Panel } from "./panel";
import { panelOf } from "./panels";
import { Plot } from "./plot";
import { TimeWindow } from "./range";

export const NET = "net";

export class Board {
  readonly window = new TimeWindow();
  private plots: Plot[] = [];
  private watched: { id: string; host: HTMLElement; plot: Plot | undefined } | undefined;
  private shown: Shown | undefined;

  constructor(
    private readonly host: HTMLElement,
    private readonly clock: Clock,
    private readonly session: Session,
  ) {
    this.window.zoomed.follow(() => this.each((plot) => plot.redraw()));
    palette.follow(() => this.each((plot) => plot.recolour()));
    clock.time.follow((t) => this.each((plot) => plot.setTime(t)));
    void document.fonts.ready.then(() => this.each((plot) => plot.redraw()));
  }

  /** The plots of a flight; those already there stay and change their curves. */
  show(shown: Shown): void {
    this.shown = shown;
    this.window.setWhole(shown.end);
    const panels = shown.data.panels.flatMap((panel) => panelOf(panel, shown.flight, shown.ghost) ?? []);
    const same = panels.length === this.plots.length && panels.every((panel, i) => this.plots[i]!.panel.id === panel.id);
    if (same) panels.forEach((panel, i) => this.plots[i]!.show(panel));
    else {
      this.plots = panels.map((panel) => this.make(panel, `plot-${panel.id}`));
      fill(this.host, ...this.plots.map((plot) => plot.element));
    }
    this.showWatched();
  }

  /** One plot, or "net", elsewhere on the page as well; undefined: none. */
  watch(id: string | undefined, host?: HTMLElement): void {
    this.watched = id !== undefined && host ? { id, host, plot: undefined } : undefined;
    if (host) fill(host);
    this.showWatched();
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

  private each(what: (plot: Plot) => void): void {
    for (const plot of this.plots) what(plot);
    if (this.watched?.plot) what(this.watched.plot);
  }

  private showWatched(): void {
    const { watched, shown } = this;
    if (!watched || !shown) return;
    const panel = this.panel(watched.id, shown);
    if (!panel) {
      watched.plot = undefined;
      fill(watched.host, h("p", { class: "quiet" }, "What flies now has nothing to show here."));
    } else if (watched.plot) watched.plot.show(panel);
    else {
      watched.plot = this.make(panel, `watched-${panel.id}`, watched.id === NET ? new NetFoot() : undefined);
      fill(watched.host, watched.plot.element);
    }
    if (watched.plot?.foot instanceof NetFoot) {
      const net = this.session.net(shown);
      if (net) watched.plot.foot.show(net);
    }
  }

  private panel(id: string, shown: Shown): Panel | undefined {
    if (id === NET) {
      const net = this.session.net(shown);
      return net && netPanel(net);
    }
    const data = shown.data.panels.find((panel) => panel.id === id);
    return data && panelOf(data, shown.flight, shown.ghost);
  }

  private make(panel: Panel, id: string, foot?: NetFoot): Plot {
    const tools = h("span", { class: "tools" });
    const plot = new Plot(panel, id, this.window, tools, foot);
    this.addTools(plot, tools);
    listen(plot, this.window, this.clock, (t) => this.each((one) => one.setHover(t, one === plot)));
    plot.setTime(this.clock.time.value);
    return plot;
  }

  private addTools(plot: Plot, host: HTMLElement): void {
    const button = (format: string, save: () => void): HTMLButtonElement => {
      const title = `Download “${plot.panel.title}” as ${format}`;
      const made = h("button", { type: "button", title, "aria-label": title }, format);
      made.addEventListener("click", save);
      return made;
    };
    const caption = (): string => this.shown?.data.name ?? "";
    const name = (suffix: string): string => fileName(`${caption()} ${plot.panel.title}`, suffix);
    host.append(
      button("SVG", () => downloadText(name("svg"), plotSvg(plot, caption()), "image/svg+xml")),
      button("PNG", () => void plotPng(plot, caption()).then((blob) => download(name("png"), blob))),
    );
  }
}
