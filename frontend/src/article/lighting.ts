// Formulas and curves point at each other: to touch a symbol or a curve lights up both, and what is not meant steps back.

/** A symbol and the element that was touched. */
type Found = readonly [name: string, at: Element];

/** Symbols in formulas have the class s-name, what is drawn of them the attribute data-s. */
export function startLighting(): void {
  const seen = new Set<string>();
  for (const symbol of document.querySelectorAll('math [class^="s-"]')) {
    const [name, section] = [symbol.classList[0]!.slice(2), symbol.closest("section")];
    const drawn = section?.querySelector(`.drawing [data-s~="${name}"]`);
    if (!drawn) continue;
    symbol.classList.add(...[...drawn.classList].filter((one) => one.startsWith("c-") || one === "dashed")); // the colour of its curve
    if (!seen.has(`${section!.id} ${name}`)) symbol.setAttribute("tabindex", "0");
    seen.add(`${section!.id} ${name}`);
  }
  const style = document.head.appendChild(document.createElement("style"));
  const nameOf = (target: EventTarget | null): Found | undefined => {
    const at = target instanceof Element ? target.closest('math [class^="s-"][class*=" c-"], .drawing [data-s]') : null;
    return at ? [at.getAttribute("data-s")?.split(" ").at(-1) ?? at.classList[0]!.slice(2), at] : undefined;
  };
  let stuck: Found | undefined;
  const light = ([name, at]: Found | readonly [] = []): void => {
    const meant = at?.closest("section");
    for (const section of document.querySelectorAll("main section")) section.toggleAttribute("data-lit", section === meant);
    style.textContent = !name ? "" : `section[data-lit] .drawing [data-s]:not([data-s~="${name}"]){opacity:.16}section[data-lit] .drawing [data-s~="${name}"]{opacity:1;stroke-width:3.2px}section[data-lit] .drawing text[data-s]{stroke-width:4px!important}section[data-lit] .s-${name}{background-color:var(--wash)}`;
  };
  let [rest, over]: [string, EventTarget | null] = ["", null];
  document.addEventListener("pointermove", (event) => {
    const here = `${event.screenX} ${event.screenY}`;
    const moved = here !== rest && event.target !== over && !event.buttons; // not where the page scrolls under a resting mouse
    rest = here;
    if (moved) light(nameOf((over = event.target)) ?? stuck ?? nameOf(document.activeElement));
  });
  document.addEventListener("focusin", (event) => light(nameOf(event.target)));
  document.addEventListener("focusout", () => light());
  document.addEventListener("click", (event) => {
    const found = nameOf(event.target);
    stuck = found && found[0] !== stuck?.[0] ? found : undefined;
    light(stuck);
  });
}
