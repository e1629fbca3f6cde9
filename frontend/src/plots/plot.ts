// One plot on the page: its heading with live values, its picture, and the cursor over it.

import { h, renew } from "../view/dom";
import { type Scale, join, number, plainUnit, scaleFor } from "../view/format";
import { rich } from "../view/notation";
import { type Palette, palette } from "../view/theme";
import { CanvasSurface, lettered } from "./canvas";
import { type Frame, drawFigure, plotBox, xOf, yOf } from "./figure";
import { Legend } from "./legend";
import { indexAt } from "./curve";
import type { NetFoot } from "./net";
import { type Panel, valueAt } from "./panel";
import { type Range, type TimeWindow, largest, valueRange } from "./range";
import { SvgSurface } from "./svg";

const PAPER = [440, 140] as const; // half the width of A4, with its letters

export class Plot {
  readonly element: HTMLElement;
  readonly stage: HTMLElement;
  private readonly base = h("canvas", { "aria-hidden": "true" });
  private readonly overlay = h("canvas", { "aria-hidden": "true" });
  private readonly paper = h("div", { class: "on-paper" });
  private readonly legend = new Legend();
  private readonly tip = h("div", { class: "tip", hidden: true });
  private readonly heading = h("h3");
  private readonly note = h("p", { class: "note" });
  private values: Range | undefined; // zoomed by hand
  private size = { width: 0, height: 0 };
  private greatest = 0;
  private stale = true;
  private seen = false;
  private hover: number | undefined;
  private brush: { from: number; to: number } | undefined;
  private time = 0;
  frame: Frame | undefined;

  constructor(
    public panel: Panel,
    id: string,
    private readonly window: TimeWindow,
    tools: HTMLElement,
    readonly foot?: NetFoot, // stands below and follows the cursor
  ) {
    const label = panel.across ? panel.title : `${panel.title} over time; left and right arrows move the time cursor, plus and minus zoom, 0 shows all`;
    this.stage = h("div", { class: "stage", tabindex: 0, role: "img", "aria-label": label }, this.base, this.overlay, this.paper, this.tip);
    const head = h("header", {}, this.heading, tools, this.legend.roles);
    this.element = h("section", { class: "plot", id }, head, this.legend.element, this.stage, foot?.element, this.note);
    new ResizeObserver(() => this.resize()).observe(this.stage);
    new IntersectionObserver((entries) => {
      const before = this.seen;
      this.seen = entries.some((entry) => entry.isIntersecting);
      if (this.seen && !before) this.refresh();
    }).observe(this.element);
    globalThis.addEventListener("beforeprint", () => this.onPaper());
    this.show(panel);
  }

  /** Other curves. */
  show(panel: Panel): void {
    this.panel = panel;
    this.values = undefined;
    this.greatest = largest(panel);
    const scale = this.scale();
    renew(this.heading, ...rich(panel.title));
    this.note.textContent = panel.note;
    this.note.hidden = !panel.note;
    this.heading.dataset["unit"] = scale.unit ? `[${scale.unit}]` : "";
    this.legend.show(panel, palette.value);
    this.redraw();
  }

  /** Draw anew at the next chance. */
  redraw(): void {
    this.stale = true;
    if (this.seen) this.refresh();
  }

  recolour(): void {
    this.legend.show(this.panel, palette.value);
    this.redraw();
  }

  /** The range of values chosen by hand; undefined: whatever fits. */
  zoomValues(range: Range | undefined): void {
    this.values = range;
    this.redraw();
  }

  setTime(t: number): void {
    this.time = t;
    this.foot?.setTime(t);
    if (this.seen) this.drawOverlay();
  }

  /** Time under the pointer, here or on another plot; values are told where it is. */
  setHover(t: number | undefined, here: boolean): void {
    this.hover = t;
    this.drawOverlay();
    this.showTip(here);
  }

  /** The stretch being marked for zooming, as times. */
  setBrush(brush: { from: number; to: number } | undefined): void {
    this.brush = brush;
    this.drawOverlay();
  }

  scale(): Scale {
    return this.panel.logarithmic ? { factor: 1, unit: plainUnit(this.panel.unit) } : scaleFor(this.panel.unit, this.greatest);
  }

  /** Where things are in a picture of this size. */
  frameFor(width: number, height: number, top?: number): Frame {
    const time = this.panel.across?.range ?? this.window.range;
    const value = this.values ?? valueRange(this.panel, time);
    return { box: plotBox(width, height, top), time, value, scale: this.scale() };
  }

  /** Lines instead of pixels, also of what is out of sight. */
  private onPaper(): void {
    const [width, height] = PAPER;
    const surface = new SvgSurface(width, height, palette.value.panel);
    drawFigure(surface, this.panel, this.frameFor(width, height), palette.value);
    this.paper.replaceChildren(surface.root);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width || !height) return;
    this.size = { width, height };
    for (const canvas of [this.base, this.overlay]) {
      canvas.width = Math.round(width * devicePixelRatio);
      canvas.height = Math.round(height * devicePixelRatio);
    }
    const { top, bottom } = this.stage.getBoundingClientRect();
    this.seen ||= bottom > 0 && top < innerHeight; // its observer tells only after the first picture
    this.redraw();
  }

  private refresh(): void {
    const pen = lettered.value ? this.pen(this.base) : null;
    if (!pen) return;
    if (this.stale) {
      this.stale = false;
      this.frame = this.frameFor(this.size.width, this.size.height);
      drawFigure(new CanvasSurface(pen), this.panel, this.frame, palette.value);
    }
    this.drawOverlay();
  }

  /** A clean canvas to draw on in CSS pixels; the base is only cleaned when it will be drawn. */
  private pen(canvas: HTMLCanvasElement): CanvasRenderingContext2D | null {
    const pen = this.size.width ? canvas.getContext("2d") : null;
    if (!pen || (canvas === this.base && !this.stale)) return pen;
    pen.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    pen.clearRect(0, 0, this.size.width, this.size.height);
    return pen;
  }

  private drawOverlay(): void {
    const pen = this.pen(this.overlay);
    const frame = this.frame;
    if (!pen || !frame) return;
    const colours = palette.value;
    const surface = new CanvasSurface(pen);
    const { box } = frame;
    if (this.brush) {
      const [a, b] = [xOf(frame, this.brush.from), xOf(frame, this.brush.to)];
      surface.rectangle({ ...box, left: Math.min(a, b), width: Math.abs(b - a) }, colours.blue, 0.16);
    }
    if (this.panel.across) {
      this.points(surface, frame, colours);
      return;
    }
    surface.clipped({ ...box, left: box.left - 4, width: box.width + 8, height: box.height + 1 }, () => {
      const x = xOf(frame, this.time);
      surface.polyline([x, box.top, x, box.top + box.height], { colour: colours.ink, width: 1, dash: [], opacity: 0.55 });
      this.dots(surface, frame, this.time, colours);
      if (this.hover === undefined) return;
      const at = xOf(frame, this.hover);
      surface.polyline([at, box.top, at, box.top + box.height], { colour: colours.muted, width: 1, dash: [2, 3] });
      this.dots(surface, frame, this.hover, colours);
    });
    this.legend.values(this.panel, this.hover ?? this.time, this.scale(), this.greatest);
  }

  /** Where the curves of a phase portrait are at the cursor. */
  private points(surface: CanvasSurface, frame: Frame, colours: Palette): void {
    for (const { clock, times, values, hue } of this.panel.curves) {
      const row = clock ? indexAt(clock, this.time) : -1;
      if (row < 0 || row >= times.length) continue;
      surface.circle(xOf(frame, times[row]!, this.panel), yOf(this.panel, frame, values[row]!), 3.5, colours[hue], colours.panel);
    }
  }

  private dots(surface: CanvasSurface, frame: Frame, t: number, colours: Palette): void {
    for (const curve of this.panel.curves) {
      const value = valueAt(curve, t);
      if (curve.role === "desired" || !Number.isFinite(value)) continue;
      surface.circle(xOf(frame, t), yOf(this.panel, frame, value), 3, colours[curve.hue], colours.panel);
    }
  }

  private showTip(here: boolean): void {
    const t = this.hover;
    this.tip.hidden = t === undefined || !this.frame || !here || this.panel.across !== undefined;
    if (this.tip.hidden || t === undefined || !this.frame || !here) return;
    this.tip.replaceChildren(h("b", {}, `t = ${t.toFixed(2)}\u00a0s`));
    for (const curve of this.panel.curves) {
      const value = valueAt(curve, t);
      if (!Number.isFinite(value)) continue;
      const scale = this.panel.logarithmic ? this.scale() : scaleFor(this.panel.unit, Math.abs(value));
      this.tip.append(h("span", {}, curve.name), h("span", {}, join(number(value * scale.factor, 4), scale.unit)));
    }
    const x = xOf(this.frame, t);
    const flip = x > this.size.width / 2;
    this.tip.style.left = flip ? "auto" : `${x + 12}px`;
    this.tip.style.right = flip ? `${this.size.width - x + 12}px` : "auto";
  }
}
