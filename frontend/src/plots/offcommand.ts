// Why the attitude of a flight through air stays off its command, where it does: as quadstep/metrics/off_command.py says it.

import { type Flight, difference } from "../data/flight";
import type { Shown } from "../session";

const FROM = 5; // degrees
const AIR = 1; // m/s

/** A sentence; "" where there is nothing to explain, or a flight went wrong in a way that explains it, too. */
export function offCommand({ flight, given, graded }: Shown): string {
  const why = flight.held && graded.labels.every((label) => label === "large error") && given?.controller.offCommand;
  const air = Math.hypot(...["x", "y", "z"].map((axis) => mean(late(flight, `v_${axis}`, `wind_${axis}`))));
  if (!why || !(air >= AIR)) return "";
  const about = (angle: string) => {
    const turns = late(flight, `${angle}_d`, angle).map((value) => value / (2 * Math.PI));
    const degrees = turns.map((turn) => 360 * (turn - Math.round(turn)));
    return { angle, off: Math.abs(mean(degrees)), swing: mean(degrees.map(Math.abs)) };
  };
  const [pitch, roll] = [about("pitch"), about("roll")];
  const [most, other] = roll.off > pitch.off ? [roll, pitch] : [pitch, roll];
  const said = `In the second half of the flight ${most.angle} is on average ${most.off.toFixed(0)}° off its command`;
  const name = other.angle === "roll" ? "Roll" : "Pitch";
  const more = ` ${name} swings more, by ${other.swing.toFixed(0)}° on average to either side of its command.`;
  const swings = Math.round(other.swing) > Math.round(most.off) ? more : "";
  return most.off >= FROM ? `${said}; one possible reason: ${why}.${swings}` : "";
}

/** A column less another, in the second half of a flight; nothing where it has not both. */
function late(flight: Flight, name: string, less: string): Float64Array {
  const [column, other] = [flight.column(name), flight.column(less)];
  return column && other ? difference(column, other).subarray(column.length >> 1) : new Float64Array();
}

function mean(values: Float64Array): number {
  return values.length ? values.reduce((sum, value) => sum + value, 0) / values.length : Number.NaN;
}
