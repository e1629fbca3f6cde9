// All plots of a flight, with one time cursor and one stretch of time; and one that is watched elsewhere on the page.

import { asFlights } from "../logs/log";
import type { Session, Shown } from "../session";
import type { Clock } from "../view/clock";
import { fill, h } from "../view/dom";
import { download, downloadText, fileName } from "../view/download";
import { palette } from "../view/theme";
import { Arrangement } from "./arrangement";
import { Chooser } from "./chooser";
import { customPanel, drawable } from "./custom";
import { plotPng, plotSvg } from "./export";
import { listen } from "./interaction";
import { NetFoot, netPanel } from "./net";
import type { Panel } from "./panel";
import { type Overlay, panelOf } from "./panels";
import { Plot } from "./plot";
import { TimeWindow } from "./range";

export const NET = "net";

export class Board {
  readonly window = new TimeWindow();
  private plots: Plot[] = [];
  private readonly arrangement = new Arrangement();
  private readonly chooser = new Chooser(this.arrangement);
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
    for (const change of [this.arrangement.changed, session.kept, session.log]) change.follow(() => this.again());
    void document.fonts.ready.then(() => this.each((plot) => plot.redraw()));
  }

  /** The plots of a flight; those already there stay and change their curves. */
  show(shown: Shown): void {
    this.shown = shown;
    this.window.setWhole(shown.end);
    const panels = this.panels(shown);
    const known = [...this.arrangement.custom.map(({ id, columns }) => ({ id, title: columns.join(", ") })), ...shown.data.panels];
    this.chooser.show({ panels: known, columns: drawable(shown.flight, this.session.log.value) });
    const same = panels.length === this.plots.length && panels.every((panel, i) => this.plots[i]!.panel.id === panel.id);
    if (same) panels.forEach((panel, i) => this.plots[i]!.show(panel));
    else {
      const before = new Map(this.plots.map((plot) => [plot.panel.id, plot]));
      this.plots = panels.map((panel) => {
        const there = before.get(panel.id);
        there?.show(panel);
        return there ?? this.make(panel, `plot-${panel.id}`);
      });
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
      fill(watched.host, h("p", { class: "quiet" }, "The current flight has nothing to show here."));
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
    return data && panelOf(data, shown.flight, this.overlays(shown));
  }

  /** What is shown now, in the reader's order. */
  private panels(shown: Shown): Panel[] {
    const { arrangement } = this;
    const overlays = this.overlays(shown);
    const log = this.session.log.value;
    const own = arrangement.custom.flatMap((custom) => customPanel({ ...custom, logarithmic: arrangement.log(custom.id) ?? custom.logarithmic }, shown.flight, overlays, log) ?? []);
    const given = shown.data.panels
      .filter(({ id }) => arrangement.shows(id))
      .flatMap((panel) => panelOf({ ...panel, log: arrangement.log(panel.id) ?? panel.log }, shown.flight, overlays) ?? []);
    return arrangement.sorted([...own, ...given]);
  }

  private overlays(shown: Shown): Overlay[] {
    const { kept, log } = this.session;
    const named = shown.flight.names;
    return [
      ...(shown.ghost ? [{ name: "ghost", role: "ghost", flight: shown.ghost } as const] : []),
      ...(kept.value ? [{ name: "kept", role: "kept", flight: kept.value } as const] : []),
      ...(log.value ? asFlights(log.value, named).map((flight) => ({ name: log.value!.name, role: "file", flight }) as const) : []),
    ];
  }

  private again(): void {
    if (this.shown) this.show(this.shown);
  }

  private make(panel: Panel, id: string, foot?: NetFoot): Plot {
    const tools = h("span", { class: "tools" });
    const plot = new Plot(panel, id, this.window, tools, foot);
    this.addTools(plot, tools, id.startsWith("plot-"));
    listen(plot, this.window, this.clock, (t) => this.each((one) => one.setHover(t, one === plot)));
    plot.setTime(this.clock.time.value);
    return plot;
  }

  /** arrange: whether it stands among the others. */
  private addTools(plot: Plot, host: HTMLElement, arrange: boolean): void {
    const button = (format: string, save: () => void): HTMLButtonElement => {
      const title = `Download “${plot.panel.title}” as ${format}`;
      const made = h("button", { type: "button", title, "aria-label": title }, format);
      made.addEventListener("click", save);
      return made;
    };
    const caption = (): string => this.shown?.data.name ?? "";
    const name = (suffix: string): string => fileName(`${caption()} ${plot.panel.title}`, suffix);
    const tool = (text: string, title: string, act: () => void): HTMLButtonElement => {
      const made = h("button", { type: "button", title, "aria-label": `${title}: ${plot.panel.title}` }, text);
      made.addEventListener("click", act);
      return made;
    };
    const { arrangement } = this;
    const { id } = plot.panel;
    const shown = (): string[] => this.plots.map((one) => one.panel.id);
    if (arrange) {
      host.append(
        tool("↑", "Up", () => arrangement.move(id, -1, shown())),
        tool("↓", "Down", () => arrangement.move(id, 1, shown())),
        tool("log", "log axis on or off", () => arrangement.toggleLog(id, plot.panel.logarithmic)),
        tool("✕", "Hide", () => arrangement.toggle(id)),
      );
    }
    host.append(
      button("SVG", () => downloadText(name("svg"), plotSvg(plot, caption()), "image/svg+xml")),
      button("PNG", () => void plotPng(plot, caption()).then((blob) => download(name("png"), blob))),
    );
  }
}
