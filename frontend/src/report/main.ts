// Figures of reports answer: hover reads the values, dragging sideways shows a part, a double click or a button all again.

import { number } from "../view/format";
import { type Bar, type Curve, Panel, type Told } from "./panel";
import { share, valueAt } from "./scale";

const SVG = "http://www.w3.org/2000/svg";
const CLICK = 5; // points a click may wander
const NEAR = 12; // points from a curve that is no function of x

for (const svg of document.querySelectorAll<SVGSVGElement>("svg[data-axes]")) listen(svg.closest<HTMLElement>(".drawn")!, svg.dataset.axes!);

/** drawn: a figure, in one drawing or in strips. axes: what Python says of all of them. */
function listen(drawn: HTMLElement, axes: string): void {
  const panels = (JSON.parse(axes) as Told[]).map((told) => new Panel(drawn, told));
  const holder = drawn.parentElement!;
  const said = made("div", "reading");
  const all = made("button", "whole");
  all.textContent = "Show all";
  all.hidden = said.hidden = true;
  holder.append(said, all);
  const cross = document.createElementNS(SVG, "path");
  cross.setAttribute("class", "cross");
  const brush = document.createElementNS(SVG, "rect");
  brush.setAttribute("class", "brush");
  let from: { panel: Panel; x: number } | undefined;

  const place = (event: PointerEvent, { svg }: Panel): DOMPoint => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM()!.inverse());
  const under = (event: PointerEvent): Panel | undefined =>
    panels.find((panel) => {
      const { x, y } = place(event, panel);
      const { box } = panel.told;
      return x >= box[0] && x <= box[0] + box[2] && y >= box[1] && y <= box[1] + box[3];
    });
  const alike = (panel: Panel): Panel[] =>
    panels.filter((one) => one.parts && one.told.x.low === panel.told.x.low && one.told.x.high === panel.told.x.high && one.told.across === panel.told.across);

  const quiet = (): void => {
    said.hidden = true;
    cross.removeAttribute("d");
    brush.removeAttribute("width");
  };
  const whole = (): void => {
    for (const one of panels) one.reset();
    all.hidden = true;
    quiet();
  };

  drawn.addEventListener("pointermove", (event) => {
    const panel = from?.panel ?? under(event);
    if (!panel) return quiet();
    const at = place(event, panel);
    panel.svg.append(cross, brush);
    read(panel, at, panel.bar(event.target), said, cross);
    const box = holder.getBoundingClientRect();
    const right = event.clientX - box.left > 0.6 * box.width;
    said.style.left = right ? "" : `${event.clientX - box.left + 16}px`;
    said.style.right = right ? `${box.right - event.clientX + 16}px` : "";
    const above = Math.max(4 - box.top, 4 - said.offsetHeight); // the figure, or at the top of the window, so that it hides no peak
    said.style.top = `${panel.over ? above : event.clientY + 12 - box.top}px`;
    if (!from) return;
    const [left, top, width, height] = panel.told.box;
    const to = Math.min(Math.max(at.x, left), left + width);
    brush.setAttribute("x", String(Math.min(from.x, to)));
    brush.setAttribute("y", String(top));
    brush.setAttribute("height", String(height));
    brush.setAttribute("width", String(Math.abs(to - from.x)));
  });
  drawn.addEventListener("pointerdown", (event) => {
    const panel = under(event);
    if (event.pointerType !== "mouse" || event.button !== 0 || !panel?.parts) return;
    event.preventDefault(); // which would mark text
    drawn.setPointerCapture(event.pointerId);
    from = { panel, x: place(event, panel).x };
  });
  drawn.addEventListener("pointerup", (event) => {
    if (!from) return;
    const { panel, x } = from;
    const [left, , width] = panel.told.box;
    const to = Math.min(Math.max(place(event, panel).x, left), left + width);
    from = undefined;
    brush.removeAttribute("width");
    if (Math.abs(to - x) < CLICK) return;
    const [low, high] = [Math.min(x, to), Math.max(x, to)].map((one) => valueAt(panel.x, (one - left) / width)) as [number, number];
    for (const one of alike(panel)) one.show(low, high);
    all.hidden = false;
    quiet();
  });
  drawn.addEventListener("pointerleave", quiet);
  drawn.addEventListener("dblclick", whole);
  all.addEventListener("click", whole);
}

/** Says what the curves, or a bar, are where the pointer is. */
function read(panel: Panel, at: DOMPoint, bar: Bar | undefined, said: HTMLElement, cross: SVGPathElement): void {
  const [left, top, width, height] = panel.told.box;
  const rows: [string, number][] = [];
  const spot = panel.spot(at, NEAR);
  if (spot) {
    const [x, y, wide, high, name, lines] = spot;
    said.replaceChildren(row(name, ""), ...lines.map(([what, value]) => row(what, value)));
    said.hidden = false;
    cross.setAttribute("d", high ? `M${x} ${y}h${wide}v${high}h${-wide}z` : `M${x - 4} ${y - 4}h${wide + 8}v8h${-wide - 8}z`);
    return;
  }
  if (bar) {
    const label = bar.along === "x" ? panel.told.across : panel.told.up;
    if (bar.name) rows.push([bar.name, Number.NaN]);
    rows.push(...[bar.low, bar.high].filter((value) => value !== 0 || bar.low === bar.high).map((value): [string, number] => [label, value]));
    cross.removeAttribute("d");
  } else if (panel.over) {
    const x = valueAt(panel.x, Math.min(Math.max((at.x - left) / width, 0), 1));
    rows.push([panel.told.across, x]);
    const unit = /\s*\[[^\]]*\]$/.exec(panel.told.up)?.[0] ?? "";
    for (const one of panel.curves) rows.push([one.name ? one.name + unit : panel.told.up, interpolated(panel, one, x)]);
    cross.setAttribute("d", `M${left + width * share(panel.x, x)} ${top}v${height}`);
  } else {
    const near = nearest(panel, at);
    cross.removeAttribute("d");
    if (!near) {
      said.hidden = true;
      return;
    }
    if (near.name) rows.push([near.name, Number.NaN]);
    rows.push([panel.told.across, near.x], [panel.told.up, near.y]);
    cross.setAttribute("d", `M${near.at[0] - 5} ${near.at[1]}h10M${near.at[0]} ${near.at[1] - 5}v10`);
  }
  said.replaceChildren(...rows.map(([name, value]) => row(name, value)));
  said.hidden = false;
}

/** What a curve is at x: on the straight line between two of its points as they are drawn. */
function interpolated({ told }: Panel, { x: xs, y: ys }: Curve, x: number): number {
  if (x < xs[0]! || x > xs[xs.length - 1]!) return Number.NaN;
  let [low, high] = [0, xs.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle]! <= x) low = middle;
    else high = middle;
  }
  const [from, to, at] = [xs[low]!, xs[high]!, x].map((one) => share(told.x, one)) as [number, number, number];
  const [first, last] = [ys[low]!, ys[high]!].map((one) => share(told.y, one)) as [number, number];
  return to > from ? valueAt(told.y, first + ((at - from) / (to - from)) * (last - first)) : ys[low]!;
}

function nearest(panel: Panel, at: DOMPoint): { name: string; x: number; y: number; at: [number, number] } | undefined {
  const [left, top, width, height] = panel.told.box;
  let best = NEAR;
  let found: ReturnType<typeof nearest>;
  for (const one of panel.curves) {
    one.x.forEach((x, i) => {
      const here: [number, number] = [left + width * share(panel.x, x), top + height * (1 - share(panel.y, one.y[i]!))];
      const off = Math.hypot(here[0] - at.x, here[1] - at.y);
      if (off < best) [best, found] = [off, { name: one.name, x, y: one.y[i]!, at: here }];
    });
  }
  return found;
}

/** A name, with what is below it, and its value. */
function row(name: string, value: number | string): HTMLElement {
  const line = made("div", "");
  const unit = /\s*\[([^\]]*)\]$/.exec(name);
  const words = made("span", "");
  for (const [i, part] of (unit ? name.slice(0, unit.index) : name).split(/_\{([^}]*)\}/).entries()) {
    const piece = document.createElement(i % 2 ? "sub" : "span");
    piece.textContent = part;
    words.append(piece);
  }
  const shown = made("b", "");
  const text = typeof value === "string" ? value : Number.isNaN(value) ? "" : number(value, 3);
  shown.textContent = text && unit ? `${text}\u00a0${unit[1]}` : text;
  line.append(words, shown);
  return line;
}

function made(tag: string, kind: string): HTMLElement {
  const element = document.createElement(tag);
  element.className = kind;
  return element;
}
