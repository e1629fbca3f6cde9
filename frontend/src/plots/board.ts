// All plots of a flight, with one time cursor and one stretch of time; and one that is watched elsewhere on the page.

import { asFlights } from "../logs/log";
import type { Session, Shown } from "../session";
import type { Clock } from "../view/clock";
import { fill, h } from "../view/dom";
import { plain } from "../view/format";
import { download, downloadText, fileName } from "../view/download";
import { palette } from "../view/theme";
import { Arrangement } from "./arrangement";
import { lettered } from "./canvas";
import { Chooser } from "./chooser";
import { customPanel, drawable } from "./custom";
import { plotPng, plotSvg } from "./export";
import { listen } from "./interaction";
import { NET, NET_TITLE, NetFoot, netPanel } from "./net";
import type { Panel } from "./panel";
import { type Overlay, isZero, panelOf } from "./panels";
import { Plot } from "./plot";
import { offCommand } from "./offcommand";
import { TimeWindow, calm } from "./range";

const CUT = "The end is off scale; drag across the plot to zoom.";
const WHOLE = "Pale bands: the thrust that each rotor would make at its speed without the fault.";

interface Offer {
  readonly id: string;
  readonly title: string;
  readonly shown: boolean;
  readonly panel: Panel | undefined;
}

export class Board {
  readonly window = new TimeWindow();
  private plots: Plot[] = [];
  readonly arrangement = new Arrangement();
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
    lettered.follow(() => this.each((plot) => plot.redraw()));
  }

  /** The plots of a flight; those already there stay and change their curves. */
  show(shown: Shown): void {
    this.shown = shown;
    this.window.setWhole(shown.end);
    const offers = this.offers(shown);
    const panels = this.arrangement.sorted(offers.flatMap((offer) => (offer.shown && offer.panel) || []));
    this.chooser.show({ panels: offers, columns: drawable(shown.flight, this.session.log.value) });
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
    for (const plot of this.plots) this.feed(plot, shown);
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
    for (const { element, panel } of this.plots) element.classList.toggle("elsewhere", panel.id === watched?.id);
    if (!watched || !shown) return;
    const panel = this.panel(watched.id, shown, undefined);
    if (!panel) {
      watched.plot = undefined;
      fill(watched.host, h("p", { class: "quiet" }, "The current flight has nothing to show here."));
    } else if (watched.plot) watched.plot.show(panel);
    else {
      watched.plot = this.make(panel, `watched-${panel.id}`);
      fill(watched.host, watched.plot.element);
    }
    if (watched.plot) this.feed(watched.plot, shown);
  }

  /** What stands below a plot is told of the flight as well. */
  private feed(plot: Plot, shown: Shown): void {
    const net = plot.foot && this.session.net(shown);
    if (net) plot.foot!.show(net);
  }

  /** log: whether the reader chose so; undefined: as it comes. */
  private panel(id: string, shown: Shown, log: boolean | undefined): Panel | undefined {
    if (id === NET) {
      const net = this.session.net(shown);
      return net && this.ending(netPanel(net, log ?? false), shown);
    }
    const data = shown.data.panels.find((panel) => panel.id === id);
    const found = data && panelOf({ ...data, log: log ?? data.log }, shown.flight, this.overlays(shown));
    const panel = found && this.ending(found, shown);
    const { since } = shown.data.summary;
    const counts = `Shaded: errors count only from ${plain(since)} s on.`;
    if (panel && since > 0 && id.startsWith("position")) return { ...panel, uncounted: since, note: id === "position" ? `${panel.note} ${counts}`.trim() : panel.note };
    const more = id === "attitude" ? offCommand(shown) : id === "rotors" && shown.flight.has("f1_whole") ? WHOLE : "";
    return panel && more ? { ...panel, note: `${panel.note} ${more}`.trim() } : panel;
  }

  /** A panel of a flight that may be lost; says so where its end is cut off, which would dwarf the rest. */
  private ending(panel: Panel, { flight }: Shown): Panel {
    const lost = flight.held ? panel : { ...panel, lost: flight.ended };
    return calm(lost, this.window.whole) ? { ...lost, note: `${CUT} ${panel.note}`.trim() } : lost;
  }

  /** All that may be shown of a flight, and what is: new plots, those of its columns, and its net, which is not unless chosen. */
  private offers(shown: Shown): Offer[] {
    const { arrangement, session } = this;
    const own = arrangement.custom.map((custom): Offer => {
      const logarithmic = arrangement.log(custom.id) ?? custom.logarithmic;
      const panel = customPanel({ ...custom, logarithmic }, shown.flight, this.overlays(shown), session.log.value);
      return { id: custom.id, title: custom.columns.join(", "), shown: true, panel };
    });
    const given = shown.data.panels.map(({ id, title, optional }): Offer => {
      const panel = this.panel(id, shown, arrangement.log(id));
      const none = !panel || (optional && isZero(panel));
      return { id, title: none ? `${title} (none in this flight)` : title, shown: arrangement.shows(id, !none), panel };
    });
    if (!session.hasNet(shown)) return [...own, ...given];
    const seen = arrangement.shows(NET, false); // else it need not fly once more for its net
    return [...own, ...given, { id: NET, title: NET_TITLE, shown: seen, panel: seen ? this.panel(NET, shown, arrangement.log(NET)) : undefined }];
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

  private make(panel: Panel, id: string): Plot {
    const tools = h("span", { class: "tools" });
    const plot = new Plot(panel, id, this.window, tools, panel.id === NET ? new NetFoot() : undefined);
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
        tool("✕", "Hide", () => arrangement.choose(id, false)),
      );
    }
    host.append(
      button("SVG", () => downloadText(name("svg"), plotSvg(plot, caption()), "image/svg+xml")),
      button("PNG", () => void plotPng(plot, caption()).then((blob) => download(name("png"), blob))),
    );
  }
}
