// A flight as the table quadstep itself writes: one row per log period, each column's unit in the header.

import type { Flight } from "./flight";

export function csv(flight: Flight): string {
  const width = flight.names.length;
  const lines = [flight.names.map((name, i) => `${name}[${flight.units[i] ?? "-"}]`).join(",")];
  for (let row = 0; row < flight.rows; row++) {
    lines.push(Array.from(flight.table.subarray(row * width, (row + 1) * width), String).join(","));
  }
  return lines.join("\n") + "\n";
}
