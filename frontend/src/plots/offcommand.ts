// Why the attitude of a flight in wind stays off its command, where it does: as quadstep/metrics/off_command.py says it.

import { type Flight, difference, unwrapped } from "../data/flight";
import type { Shown } from "../session";

const FROM = 5; // degrees
const WIND = 1; // m/s

/** A sentence; "" where there is nothing to explain, or a flight went wrong in a way that explains it, too. */
export function offCommand({ flight, given, graded }: Shown): string {
  const why = flight.held && graded.labels.every((label) => label === "large error") && given?.controller.offCommand;
  const wind = Math.hypot(...["wind_x", "wind_y", "wind_z"].map((name) => late(flight, name)));
  if (!why || !(wind >= WIND)) return "";
  const [pitch, roll] = ["pitch", "roll"].map((angle) => (late(flight, `${angle}_d`, angle) * 180) / Math.PI) as [number, number];
  const [angle, off] = Math.abs(roll) > Math.abs(pitch) ? ["roll", Math.abs(roll)] : ["pitch", Math.abs(pitch)];
  const half = "in the second half of the flight";
  return off >= FROM ? `In this wind ${angle} is on average ${off.toFixed(0)}° off its command ${half}; one reason: ${why}.` : "";
}

/** The mean of a column, less another, in the second half of a flight. */
function late(flight: Flight, name: string, minus?: string): number {
  const column = flight.column(name);
  const other = minus ? flight.column(minus) : undefined;
  const values = column && (minus ? other && unwrapped(difference(column, other)) : column);
  const second = values?.subarray(values.length >> 1);
  return second?.length ? second.reduce((sum, value) => sum + value, 0) / second.length : Number.NaN;
}
