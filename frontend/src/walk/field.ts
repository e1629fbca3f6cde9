// Many flights of one kind as a small table: one mark each, rows and columns named, one stop for the Tab key and arrows within.

import type { FlightData } from "../data/contract";
import { h } from "../view/dom";
import { rich } from "../view/notation";

/** The flight with which a page opens: of a table that with the median error, else the first. */
export function typical(flights: readonly FlightData[]): FlightData | undefined {
  const error = (flight: FlightData): number => flight.summary.filed["rmse"] ?? Infinity;
  const held = flights.filter(({ outcome }) => outcome.grade !== "lost").sort((a, b) => error(a) - error(b));
  return (flights[0]?.cell && held[held.length >> 1]) ?? flights[0];
}

/** One table a block of cells. button: that of a flight. */
export function field(flights: readonly FlightData[], button: (flight: FlightData) => HTMLButtonElement): HTMLElement {
  const blocks = unique(flights.map((flight) => flight.cell!.block));
  const made = h("div", { class: "field" }, ...blocks.map((block) => table(block, flights.filter((flight) => flight.cell!.block === block), button)));
  const buttons = [...made.querySelectorAll("button")];
  buttons.forEach((one, i) => (one.tabIndex = i ? -1 : 0));
  made.addEventListener("focusin", (event) => {
    for (const one of buttons) one.tabIndex = one === event.target ? 0 : -1;
  });
  made.addEventListener("keydown", (event) => {
    const to = event.target instanceof HTMLButtonElement ? neighbour(event.target, event.key) : null;
    if (!to) return;
    event.preventDefault();
    event.stopPropagation();
    to.focus();
  });
  return made;
}

function table(block: string, flights: readonly FlightData[], button: (flight: FlightData) => HTMLButtonElement): HTMLElement {
  const { rowAxis, columnAxis } = flights[0]!.cell!;
  const rows = unique(flights.map((flight) => flight.cell!.row));
  const columns = unique(flights.map((flight) => flight.cell!.column));
  const cell = (row: string, column: string): HTMLElement => {
    const found = flights.find((flight) => flight.cell!.row === row && flight.cell!.column === column);
    const made = h("td", {}, found ? button(found) : null);
    made.style.background = found?.cell!.colour ?? "";
    made.classList.toggle("coloured", made.style.background !== "");
    return made;
  };
  return h(
    "table",
    {},
    h("caption", {}, ...rich(`${block}${block && "; "}${rowAxis} down, ${columnAxis} across`)),
    h("thead", {}, h("tr", {}, h("td"), ...columns.map((column) => h("th", { scope: "col" }, column)))),
    h("tbody", {}, ...rows.map((row) => h("tr", {}, h("th", { scope: "row" }, row), ...columns.map((column) => cell(row, column))))),
  );
}

const STEPS: Readonly<Record<string, readonly [number, number]>> = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };

/** The button that an arrow leads to from another, through the tables as if they stood in one row. */
function neighbour(from: HTMLButtonElement, key: string): HTMLButtonElement | null {
  const step = STEPS[key];
  const tables = [...(from.closest(".field")?.querySelectorAll("table") ?? [])];
  const rows = Math.max(0, ...tables.map((one) => one.tBodies[0]?.rows.length ?? 0));
  const grid = Array.from({ length: rows }, (_, row) => tables.flatMap((one) => [...(one.tBodies[0]?.rows[row]?.querySelectorAll("button") ?? [])]));
  const row = grid.findIndex((buttons) => buttons.includes(from));
  if (!step || row < 0) return null;
  return grid[row + step[0]]?.[grid[row]!.indexOf(from) + step[1]] ?? null;
}

function unique(values: readonly string[]): string[] {
  return [...new Set(values)];
}
