// The bowl: level sets of L with a flight and the ball b_r, and the terms of its rate stacked, the omitted one among them.

import { NARROW, Plot, span, svg, text } from "../chart";
import { slider } from "../controls";
import { each, fly, tools } from "../data";
import { live } from "../figure";
import { legend } from "../legend";
import { fixed } from "../words";

const TERMS = [
  ["rate_position", "c-blue", "gp"],
  ["rate_attitude", "c-green", "ga"],
  ["rate_unknown", "c-orange", "gu"],
  ["rate_coupling", "c-vermillion", "gc"],
] as const;
const [MASS, INERTIA, J_MOST] = [1, 5, 10]; // of the paper's vehicle, level

export function lyapunov(): void {
  live("lyapunov", (stage) => {
    const { controls, redraw } = stage;
    const inner = slider(controls, "Λ₂, the inner loop", "1/s", [0.5, 15, 0.5], redraw, true);
    const bound = slider(controls, "W_B, bound of weights", "", [0, 6, 2], redraw);
    const time = slider(controls, "time", "s", [0, 12, 4.6], redraw);
    legend(controls, [
      ["gp", "c-blue", "outer gain"],
      ["ga", "c-green", "inner gain"],
      ["gu", "c-orange", "what nets would have to learn"],
      ["gc", "c-vermillion", "the omitted coupling"],
      ["ball", "c-pink", "the ball b_r"],
    ]);

    return () => {
      const gain = 6 * (inner.value / 0.5) ** (Math.log(250 / 6) / Math.log(30)); // K_r2 from 6 to 250, above the printed bound
      const flown = fly("lyapunov", { ...each("gains.slope_2", inner.value), ...each("gains.gain_2", gain) });
      const [t, r1, r2] = [flown.times, flown.column("norm_r1"), flown.column("norm_r2")];
      const height = flown.column("lyapunov");
      const row = Math.min(flown.rows - 1, Math.round(time.value / 0.02));
      const width = stage.width;

      const size = Math.min(width - 64, 380);
      const plane = new Plot({ left: 46 + (width - 64 - size) / 2, top: 54, width: size, height: 0.75 * size }, [0, Math.min(3, Math.max(0.6, 1.1 * Math.max(...r1)))], [0, Math.min(3, Math.max(0.3, 1.1 * Math.max(...r2)))]);
      const around = Array.from({ length: 41 }, (_, i) => (i * Math.PI) / 80);
      const level = (L: number): string =>
        plane.line(around.map((a) => Math.sqrt((2 * L) / MASS) * Math.cos(a)), around.map((a) => Math.sqrt((2 * L) / INERTIA) * Math.sin(a)), "thin c-muted", "lp la");
      const [right, printed] = tools.ball(0.01, bound.value, 0.02, Math.min(3 - MASS, gain - J_MOST * inner.value));
      const ball = (radius: number, look: string): string => plane.line(around.map((a) => radius * Math.cos(a)), around.map((a) => radius * Math.sin(a)), `${look} c-pink`, "ball");

      const zero = new Float64Array(flown.rows);
      const [up, down] = [zero.slice(), zero.slice()];
      const columns = TERMS.map(([name]) => flown.column(name));
      const stacked = TERMS.map(([, look, symbol], i) => {
        const [highs, lows] = [up.slice(), down.slice()];
        columns[i]!.forEach((value, k) => (value > 0 ? (up[k]! += value) : (down[k]! += value)));
        return { look, symbol, parts: [[highs, up.slice()], [down.slice(), lows]] as const };
      });
      const total = Float64Array.from(zero, (_, k) => columns.reduce((all, one) => all + one[k]!, 0));
      const top = 54 + 0.75 * size + 74;
      const rates = new Plot({ left: 46, top, width: width - 58, height: 170 }, [0, 12], span([up.subarray(0, flown.rows), down.subarray(0, flown.rows)], -12, 12, 0.2));
      const terms = stacked.flatMap(({ look, symbol, parts }) => parts.map(([low, high]) => rates.area(t, low, high, look, symbol)));
      return svg(
        width,
        top + 170 + 38,
        text(8, 16, `K_r1 − mΛ₁ = 2, K_r2 − J_M Λ₂ = ${fixed(gain - J_MOST * inner.value, 1)}${width < NARROW ? "" : ": every printed condition holds"}`, "c-ink"),
        flown.lost ? text(width - 8, 34, `the flight is ${flown.lost}`, "c-vermillion", "end") : text(width - 8, 34, `L = ${fixed(height[row]!, 3)} J, L̇ = ${fixed(total[row]!, 3)} W`, "c-muted", "end"),
        plane.framed(
          "|r₁| [m/s]",
          "|r₂| [rad/s]",
          ...[0.01, 0.03, 0.07, 0.13, 0.3, 1, 3, 8].map(level),
          ball(printed, "dashed"),
          ball(right, ""),
          plane.line(r1, r2, "c-ink"),
          plane.dot(r1[row]!, r2[row]!, "c-ink", "", 5),
        ),
        rates.framed(
          "time [s]",
          "the terms of the rate of L [W], stacked",
          ...terms,
          rates.level(0),
          rates.line(t, total, "c-ink"),
          rates.upright(t[row]!),
        ),
      );
    };
  });
}
