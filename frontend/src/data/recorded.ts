// A flight that Python flew, shown as it was.

import type { FlightData, PageData } from "./contract";
import { Flight } from "./flight";
import { doubles, singles } from "./packed";

export function recordedFlight(page: PageData, data: FlightData): Flight | undefined {
  const { recorded, outcome } = data;
  if (!recorded) return undefined;
  const table = recorded.type === "f32" ? singles(recorded.rows) : doubles(recorded.rows);
  const diverged = page.outcomes[outcome.code]?.ended ?? outcome.code !== 0;
  return new Flight(
    recorded.columns.map(([name]) => name),
    recorded.columns.map(([, unit]) => unit),
    table,
    diverged ? outcome.why || outcome.text : "",
    outcome.ended,
  );
}
