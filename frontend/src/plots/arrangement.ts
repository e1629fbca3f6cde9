// Which plots stand where, as the reader chose: hidden ones, their order, log axes, and plots of their own.

import { Watched } from "../view/events";
import type { Custom, Kind } from "./custom";

export class Arrangement {
  /** Counts changes. */
  readonly changed = new Watched(0);
  readonly custom: Custom[] = [];
  private readonly chosen = new Map<string, boolean>();
  private readonly logs = new Map<string, boolean>();
  private order: string[] = [];
  private made = 0;

  /** usual: where the reader has not chosen. */
  shows(id: string, usual: boolean): boolean {
    return this.chosen.get(id) ?? usual;
  }

  /** Whether its axis is logarithmic; undefined: as it comes. */
  log(id: string): boolean | undefined {
    return this.logs.get(id);
  }

  /** Show or hide a plot; one of the reader's own that is hidden is gone. */
  choose(id: string, show: boolean): void {
    const own = this.custom.findIndex((custom) => custom.id === id);
    if (own >= 0) this.custom.splice(own, 1);
    else this.chosen.set(id, show);
    this.tell();
  }

  toggleLog(id: string, now: boolean): void {
    this.logs.set(id, !now);
    this.tell();
  }

  add(kind: Kind, columns: readonly string[], logarithmic: boolean): void {
    const id = `own-${++this.made}`;
    this.custom.unshift({ id, kind, columns, logarithmic });
    this.order.unshift(id);
    this.tell();
  }

  /** One place up or down among those shown. */
  move(id: string, step: 1 | -1, shown: readonly string[]): void {
    const order = [...shown];
    const at = order.indexOf(id);
    if (order[at + step] === undefined) return;
    [order[at], order[at + step]] = [order[at + step]!, order[at]!];
    this.order = order;
    this.tell();
  }

  /** Before all others. */
  first(id: string): void {
    this.order = [id, ...this.order.filter((other) => other !== id)];
    this.chosen.set(id, true);
    this.tell();
  }

  /** In the reader's order; what was never moved stays where it comes. */
  sorted<T extends { readonly id: string }>(all: readonly T[]): T[] {
    const rank = (one: T, i: number): number => (this.order.includes(one.id) ? this.order.indexOf(one.id) : this.order.length + i);
    return all.map((one, i) => [one, rank(one, i)] as const).sort((a, b) => a[1] - b[1]).map(([one]) => one);
  }

  private tell(): void {
    this.changed.set(this.changed.value + 1);
  }
}
