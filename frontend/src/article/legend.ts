// Formulas and curves point at each other: to touch a symbol lights its curves up, and what is not meant steps back.

import { h } from "../view/dom";
import { rich } from "../view/notation";

/** A line of what the curves mean, as buttons, so that a keyboard lights them too. entries: symbol, its name, what it is. */
export function legend(where: Element, entries: readonly (readonly [symbol: string, look: string, text: string])[]): void {
  const list = h("div", { class: "legend", role: "group", "aria-label": "What the curves are" });
  for (const [symbol, look, text] of entries) {
    list.append(h("button", { type: "button", class: `key ${look}`, "data-for": symbol, "aria-pressed": "false" }, h("span", {}, ...rich(text))));
  }
  where.append(list);
}

/** Listens to symbols in formulas (class s-name) and to legends (data-for). */
export function startLighting(): void {
  const nameOf = (target: EventTarget | null): readonly [string, Element] | undefined => {
    const at = target instanceof Element ? target.closest('[class*="s-"], [data-for]') : null;
    if (!at) return undefined;
    const name = at.getAttribute("data-for") ?? [...at.classList].find((one) => one.startsWith("s-"))?.slice(2);
    return name ? [name, at] : undefined;
  };
  let stuck = "";
  const light = (name: string, at?: Element): void => {
    const figure = at?.closest("section");
    for (const section of document.querySelectorAll("main section")) section.toggleAttribute("data-lit", name !== "" && section === figure);
    style.textContent = name ? `section[data-lit] .drawing [data-s]:not([data-s~="${name}"]){opacity:.16}section[data-lit] .drawing [data-s~="${name}"]{opacity:1;stroke-width:3.2px}section[data-lit] .s-${name}{color:var(--lit)}` : "";
    for (const key of document.querySelectorAll("[data-for]")) key.setAttribute("aria-pressed", String(key.getAttribute("data-for") === name && name === stuck));
  };
  const style = document.head.appendChild(document.createElement("style"));
  document.addEventListener("pointerover", (event) => {
    const found = nameOf(event.target);
    if (found) light(...found);
    else if (!stuck) light("");
  });
  document.addEventListener("click", (event) => {
    const found = nameOf(event.target);
    const name = found && found[0] !== stuck ? found[0] : "";
    stuck = name;
    light(name, found?.[1]);
  });
}
