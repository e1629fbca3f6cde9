// A surface on the screen.

import { Watched } from "../view/events";
import type { Piece } from "../view/notation";
import { type Box, FONT, LOW, type Lettering, type Stroke, type Surface } from "./surface";

/** Whether the page's letters have come, or cannot: what is drawn before would have to be drawn again. */
export const lettered = new Watched(false);
const come = (): void => lettered.set(true);
void document.fonts.load(`12px ${FONT}`).then(come, come);

export class CanvasSurface implements Surface {
  private font = ""; // setting it, even to what it is, costs more than the text

  constructor(private readonly pen: CanvasRenderingContext2D) {}

  polyline(points: ArrayLike<number>, stroke: Stroke): void {
    const { pen } = this;
    pen.save();
    pen.strokeStyle = stroke.colour;
    pen.lineWidth = stroke.width;
    pen.globalAlpha = stroke.opacity ?? 1;
    pen.lineJoin = "round";
    pen.setLineDash([...stroke.dash]);
    pen.beginPath();
    let down = false;
    for (let i = 0; i + 1 < points.length; i += 2) {
      const x = points[i]!;
      const y = points[i + 1]!;
      if (Number.isNaN(y)) {
        down = false;
        continue;
      }
      if (down) pen.lineTo(x, y);
      else pen.moveTo(x, y);
      down = true;
    }
    pen.stroke();
    pen.restore();
  }

  rectangle(box: Box, fill: string, opacity = 1): void {
    const { pen } = this;
    pen.save();
    pen.globalAlpha = opacity;
    pen.fillStyle = fill;
    pen.fillRect(box.left, box.top, box.width, box.height);
    pen.restore();
  }

  circle(x: number, y: number, radius: number, fill: string, ring: string): void {
    const { pen } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fillStyle = fill;
    pen.fill();
    pen.lineWidth = 1.5;
    pen.strokeStyle = ring;
    pen.stroke();
  }

  text(x: number, y: number, text: string | readonly Piece[], lettering: Lettering): void {
    const { pen } = this;
    if (typeof text !== "string") {
      const { size } = lettering;
      for (const { text: piece, low } of text) {
        this.text(x, low ? y + LOW.drop * size : y, piece, low ? { ...lettering, size: LOW.size * size } : lettering);
        x += pen.measureText(piece).width;
      }
      return;
    }
    pen.fillStyle = lettering.colour;
    const font = `${lettering.weight ?? 400} ${lettering.size}px ${FONT}`;
    if (font !== this.font) pen.font = this.font = font;
    pen.textAlign = lettering.align;
    pen.textBaseline = "middle";
    pen.fillText(text, x, y);
  }

  clipped(box: Box, draw: () => void): void {
    const { pen } = this;
    pen.save();
    pen.beginPath();
    pen.rect(box.left, box.top, box.width, box.height);
    pen.clip();
    draw();
    pen.restore();
  }
}
