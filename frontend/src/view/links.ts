// Links to files beside the page, and to no other place.

import { fill, h } from "./dom";

export function links(host: HTMLElement, all: readonly { readonly label: string; readonly href: string }[]): void {
  fill(host, ...all.filter(({ href }) => relative(href)).map(({ label, href }) => h("a", { href }, label)));
}

function relative(href: string): boolean {
  return !/^([a-z][a-z0-9+.-]*:|\/\/|\\)/i.test(href.trim());
}
