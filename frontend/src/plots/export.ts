// A plot as a file: SVG for papers, PNG for slides.

import { join } from "../view/format";
import { pieces } from "../view/notation";
import { type Palette, palette } from "../view/theme";
import { CanvasSurface } from "./canvas";
import { drawFigure } from "./figure";
import { strokeOf } from "./panel";
import type { Plot } from "./plot";
import { LOW, type Surface } from "./surface";
import { SvgSurface } from "./svg";

const WIDTH = 720;
const HEIGHT = 340;
const TOP = 58;
const SHARPER = 2;

export function plotSvg(plot: Plot, caption: string): string {
  const surface = new SvgSurface(WIDTH, HEIGHT, palette.value.panel);
  draw(surface, plot, caption, palette.value);
  return surface.serialise();
}

export function plotPng(plot: Plot, caption: string): Promise<Blob> {
  const canvas = document.createElement("canvas");
  canvas.width = WIDTH * SHARPER;
  canvas.height = HEIGHT * SHARPER;
  const pen = canvas.getContext("2d");
  if (!pen) return Promise.reject(new Error("no canvas"));
  pen.scale(SHARPER, SHARPER);
  const surface = new CanvasSurface(pen);
  surface.rectangle({ left: 0, top: 0, width: WIDTH, height: HEIGHT }, palette.value.panel);
  draw(surface, plot, caption, palette.value);
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))), "image/png");
  });
}

function draw(surface: Surface, plot: Plot, caption: string, colours: Palette): void {
  const { panel } = plot;
  const frame = plot.frameFor(WIDTH, HEIGHT, TOP);
  const title = join(panel.title, frame.scale.unit ? `[${frame.scale.unit}]` : "");
  surface.text(16, 18, pieces(title), { colour: colours.ink, size: 14, align: "left", weight: 600 });
  surface.text(WIDTH - 16, 18, shortened(caption), { colour: colours.muted, size: 11, align: "right" });
  let x = frame.box.left;
  for (const curve of panel.curves) {
    surface.polyline([x, 40, x + 22, 40], strokeOf(curve, colours));
    const name = pieces(curve.label);
    surface.text(x + 28, 40, name, { colour: colours.muted, size: 11, align: "left" });
    x += 28 + 6.4 * name.reduce((sum, { text, low }) => sum + (low ? LOW.size : 1) * text.length, 0) + 18;
  }
  drawFigure(surface, panel, frame, colours);
}

function shortened(text: string): string {
  return text.length > 60 ? `${text.slice(0, 59)}…` : text;
}
