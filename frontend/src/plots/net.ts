// What the first net does: its force beside the one it should make, its neurons' activity, and its weights as a heat map.

import type { Net } from "../data/engine";
import { h } from "../view/dom";
import { number } from "../view/format";
import { palette } from "../view/theme";
import { indexAt } from "./curve";
import { type Curve, DASHES, type Panel } from "./panel";

const AXES = ["x", "y", "z"] as const;
const HUES = ["blue", "orange", "green"] as const;
const ROW = 18; // px
const BARS = 36;
const LEFT = 48; // as the plots above

export const NET = "net";
export const NET_TITLE = "Net: force, neurons and weights";

/** logarithmic: sizes on an axis of powers of ten. */
export function netPanel(net: Net, logarithmic: boolean): Panel {
  const { times, rows, width, neurons } = net;
  const size = logarithmic ? Math.abs : (value: number): number => value;
  const column = (at: number): Float64Array => times.map((_, row) => size(rows[row * width + at]!));
  const curves = AXES.flatMap((axis, i): Curve[] => {
    const base = { hue: HUES[i]!, dash: DASHES[i]!, times };
    return [
      { ...base, label: axis, name: axis, role: "flown", values: column(width - 6 + i) },
      { ...base, label: `${axis}, to cancel`, name: `${axis}, to cancel`, role: "desired", values: column(width - 3 + i) },
    ];
  });
  const note = `Pale bands: the force that would cancel the disturbance. Below, at the cursor: the activity and the three weights of each of the ${neurons} neurons.`;
  const able = logarithmic && curves.some((curve) => curve.values.some((value) => value > 0));
  return { id: NET, title: "Force of the net", note, unit: "N", logarithmic: able, curves };
}

/** Bars and heat map at one time. */
export class NetFoot {
  private readonly canvas = h("canvas", { role: "img", class: "net-picture" });
  readonly element = h("div", { class: "net" }, this.canvas);
  private net: Net | undefined;
  private most = 1;
  private time = 0;

  constructor() {
    new ResizeObserver(() => this.draw()).observe(this.element);
    palette.follow(() => this.draw());
  }

  show(net: Net): void {
    this.net = net;
    this.most = 0;
    const { rows, width } = net;
    const count = (width - 6) / 4;
    for (let at = 0; at < rows.length; at++) {
      const place = at % width;
      if (place >= count && place < 4 * count) this.most = Math.max(this.most, Math.abs(rows[at]!));
    }
    this.draw();
  }

  setTime(t: number): void {
    this.time = t;
    this.draw();
  }

  private draw(): void {
    const { net, canvas } = this;
    const width = this.element.clientWidth;
    const height = BARS + 3 * ROW + 22;
    const pen = net && width ? canvas.getContext("2d") : null;
    if (!net || !pen || !net.times.length) return;
    canvas.width = Math.round(width * devicePixelRatio);
    canvas.height = Math.round(height * devicePixelRatio);
    canvas.style.height = `${height}px`;
    pen.scale(devicePixelRatio, devicePixelRatio);
    const colours = palette.value;
    const count = (net.width - 6) / 4;
    const row = indexAt(net.times, this.time) * net.width;
    const step = Math.min((width - LEFT - 10) / net.neurons, 40);
    pen.font = '11px Inter, system-ui, sans-serif';
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    pen.fillStyle = colours.muted;
    pen.fillText("active", LEFT - 7, BARS / 2);
    AXES.forEach((axis, k) => pen.fillText(`to ${axis}`, LEFT - 7, BARS + ROW * (k + 0.5) + 4));
    for (let i = 0; i < net.neurons; i++) {
      const x = LEFT + i * step;
      const active = net.rows[row + i]!;
      pen.fillStyle = colours.grid;
      pen.fillRect(x, 0, step - 2, BARS);
      pen.fillStyle = colours.muted;
      pen.fillRect(x, BARS * (1 - active), step - 2, BARS * active);
      for (let k = 0; k < 3; k++) {
        const weight = net.rows[row + count + 3 * i + k]!;
        pen.fillStyle = colours.grid;
        pen.fillRect(x, BARS + 4 + k * ROW, step - 2, ROW - 2);
        pen.globalAlpha = this.most > 0 ? Math.sqrt(Math.abs(weight) / this.most) : 0;
        pen.fillStyle = weight > 0 ? colours.vermillion : colours.blue;
        pen.fillRect(x, BARS + 4 + k * ROW, step - 2, ROW - 2);
        pen.globalAlpha = 1;
      }
    }
    const bottom = height - 8;
    pen.textAlign = "left";
    pen.fillStyle = colours.blue;
    pen.fillText(this.most > 0 ? `weights: ${number(-this.most, 2)}` : "all weights are 0", LEFT, bottom);
    pen.textAlign = "right";
    pen.fillStyle = colours.vermillion;
    if (this.most > 0) pen.fillText(`+${number(this.most, 2)}`, LEFT + step * net.neurons, bottom);
    canvas.setAttribute("aria-label", `The ${net.neurons} neurons of the first net at ${this.time.toFixed(1)} s: activity and weights; the largest weight of the flight is ${number(this.most, 2)}`);
  }
}
