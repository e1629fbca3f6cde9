// Elements made from text, never from markup: what a mission file says is only ever text.

type Child = Node | string | null | undefined;
type Attributes = Record<string, string | number | boolean | null | undefined>;

/** An element `<tag class="...">` with attributes and children; strings become text nodes. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    element.setAttribute(name, value === true ? "" : String(value));
  }
  append(element, ...children);
  return element;
}

export function append(parent: Element, ...children: Child[]): void {
  for (const child of children) if (child !== null && child !== undefined) parent.append(typeof child === "string" ? typeset(child) : child);
}

/** Text as it is set: the apostrophe of a word is not that of a typewriter. */
export function typeset(text: string): string {
  return text.includes("'") ? text.replace(/(?<=\p{L})'(?=\p{L})/gu, "’") : text;
}

/** Replaces everything in an element. */
export function fill(parent: Element, ...children: Child[]): void {
  parent.replaceChildren();
  append(parent, ...children);
}

/** The same for what has no listeners; what is there already stays, so that it is not laid out again. */
export function renew(parent: Element, ...children: Child[]): void {
  const made = parent.cloneNode() as Element;
  append(made, ...children);
  if (!made.isEqualNode(parent)) parent.replaceChildren(...made.childNodes);
}

/** Runs a script that the page holds as text until it is needed. */
export function run(text: string): void {
  const script = h("script");
  script.textContent = text;
  document.head.append(script);
}

/** The element of the page's frame with this id. */
export function byId(id: string): HTMLElement {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
}

/** An icon button: a path drawn in a 24 by 24 box, with a name for those who cannot see it. */
export function iconButton(name: string, path: string, attributes: Attributes = {}): HTMLButtonElement {
  const button = h("button", { type: "button", class: "icon", "aria-label": name, title: name, ...attributes });
  button.append(icon(path));
  return button;
}

const SVG = "http://www.w3.org/2000/svg";

export function icon(path: string): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS(SVG, "path");
  shape.setAttribute("d", path);
  svg.append(shape);
  return svg;
}

/** A short horizontal stroke in the colour and dash of a curve, for legends. */
export function swatch(colour: string, dash: readonly number[], width = 2): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 22 8");
  svg.setAttribute("class", "swatch");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(SVG, "line");
  const set = (name: string, value: string | number): void => line.setAttribute(name, String(value));
  set("x1", 0), set("x2", 22), set("y1", 4), set("y2", 4);
  set("stroke", colour), set("stroke-width", width);
  if (dash.length) set("stroke-dasharray", dash.join(" "));
  svg.append(line);
  return svg;
}
