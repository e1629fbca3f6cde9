// The bowl: level sets of L with a flight and the ball b_r, and the terms of its rate stacked, the omitted one among them.

import { NARROW, Plot, lit, span, svg, text } from "../chart";
import { slider } from "../controls";
import { each, fly, tools } from "../data";
import { live, scrub } from "../figure";
import { fixed } from "../words";

const TERMS = [
  ["rate_position", "c-blue", "gp", "outer gain"],
  ["rate_attitude", "c-sky", "ga", "inner gain"],
  ["rate_unknown", "c-gold", "gu", "what nets would have to learn"],
  ["rate_coupling", "c-vermillion", "gc", "the omitted coupling"],
] as const;
const [MASS, INERTIA, J_MOST] = [1, 5, 10]; // of the paper's vehicle, level
const [WEIGHTS, MISSED] = [1, 0.02]; // W_B and |eps_v| that the ball is drawn for

export function lyapunov(): void {
  live("lyapunov", (stage) => {
    const slope = slider(stage, "Lambda2", "Λ_2, inner loop", "/s", [0.5, 15, 0.5], true);
    const gain = slider(stage, "K_r2", "K_r2, inner loop", "N m s", [6, 250, 6], true);
    const kappa = slider(stage, "kappa", "κ, of the ball alone", "", [0.01, 3, 0.2], true);
    const time = slider(stage, "time", "time", "s", [0, 12, 4.6]);
    let plots: readonly Plot[] = [];
    scrub(stage, time, () => plots);

    return () => {
      const flown = fly("lyapunov", { ...each("gains.slope_2", slope.value), ...each("gains.gain_2", gain.value) });
      const surplus = gain.value - J_MOST * slope.value;
      const [t, r1, r2] = [flown.times, flown.column("norm_r1"), flown.column("norm_r2")];
      const height = flown.column("lyapunov");
      const row = Math.min(flown.rows - 1, Math.round(time.value / 0.02));
      const width = stage.width;

      const size = Math.min(width - 64, 380);
      const plane = new Plot({ left: 46 + (width - 64 - size) / 2, top: 92, width: size, height: 0.75 * size }, [0, Math.min(1.6, Math.max(0.6, 1.1 * Math.max(...r1)))], [0, Math.min(1.6, Math.max(0.3, 1.1 * Math.max(...r2)))]);
      const around = Array.from({ length: 41 }, (_, i) => (i * Math.PI) / 80);
      const level = (L: number): string => {
        const [across, up] = [Math.sqrt((2 * L) / MASS), Math.sqrt((2 * L) / INERTIA)];
        const named = across * 0.9 < plane.xs[1] && across > 0.35 * plane.xs[1] ? plane.label(across * 0.88, up * 0.47, `${L} J`, "small c-muted", "la lp") : "";
        return plane.line(around.map((a) => across * Math.cos(a)), around.map((a) => up * Math.sin(a)), "thin c-muted", "la lp") + named;
      };
      const [right, printed] = tools.ball(kappa.value, WEIGHTS, MISSED, Math.min(3 - MASS, surplus));
      const ball = (radius: number, look: string, said: string, at: number): string =>
        surplus <= 0 ? "" : plane.line(around.map((a) => radius * Math.cos(a)), around.map((a) => radius * Math.sin(a)), `${look} c-pink`, "ball") + plane.label(radius * Math.cos(at) + 0.01 * plane.xs[1], radius * Math.sin(at), said, "c-pink", "ball");

      const zero = new Float64Array(flown.rows);
      const [up, down] = [zero.slice(), zero.slice()];
      const columns = TERMS.map(([name]) => flown.column(name));
      const stacked = TERMS.map(([, look, symbol], i) => {
        const [highs, lows] = [up.slice(), down.slice()];
        columns[i]!.forEach((value, k) => (value > 0 ? (up[k]! += value) : (down[k]! += value)));
        return { look, symbol, parts: [[highs, up.slice()], [down.slice(), lows]] as const };
      });
      const total = Float64Array.from(zero, (_, k) => columns.reduce((all, one) => all + one[k]!, 0));
      const keys = TERMS.map(([, look, symbol, name], i) => {
        const [left, y] = width < NARROW ? [46, 92 + 0.75 * size + 58 + 18 * i] : [46 + [0, 84, 168, 372][i]!, 92 + 0.75 * size + 58];
        return `<rect class="area ${look}"${lit(symbol)} x="${left}" y="${(y - 10).toFixed(1)}" width="11" height="11"/>${text(left + 16, y, name, "c-ink", "start", symbol)}`;
      });
      const top = 92 + 0.75 * size + (width < NARROW ? 146 : 92);
      const rates = new Plot({ left: 46, top, width: width - 58, height: 170 }, [0, 12], span([up, down], -8, 8, 0.2));
      plots = [rates];
      const terms = stacked.flatMap(({ look, symbol, parts }) => parts.map(([low, high]) => rates.area(t, low, high, look, symbol)));
      return svg(
        width,
        top + 170 + 38,
        text(8, 16, `K_r1 − mΛ_1 = 3 − 1 = 2 > 0: holds`, "c-ink"),
        text(8, 36, `K_r2 − J_M Λ_2 = ${fixed(gain.value, 1)} − 10 · ${fixed(slope.value, 2)} = ${fixed(surplus, 1)}${surplus > 0 ? " > 0: holds" : ": does not hold"}`, surplus > 0 ? "c-ink" : "c-vermillion"),
        text(8, 56, flown.lost ? `the flight is ${flown.lost}` : `at ${fixed(t[row]!, 2)} s: L = ${fixed(height[row]!, 3)} J, its rate ${fixed(total[row]!, 3)} W`, total[row]! > 0.005 ? "c-vermillion" : "c-muted"),
        plane.framed(
          "|r_1| [m/s]",
          "|r_2| [rad/s]",
          ...[0.01, 0.03, 0.07, 0.13, 0.3, 1, 3].map(level),
          plane.line(r1, r2, "thin c-ink faint"),
          plane.line(r1.subarray(0, row + 1), r2.subarray(0, row + 1), "c-ink"),
          plane.dot(r1[row]!, r2[row]!, "c-ink", "", 5),
          plane.label(r1[row]!, r2[row]!, "  the flight", "c-ink"),
          ball(printed, "dashed", "b_r as printed", 1.15),
          ball(right, "", "b_r", 0.5),
        ),
        ...keys,
        rates.framed(
          "time [s]",
          "terms of the rate of L [W]; the line is their sum",
          ...terms,
          rates.level(0),
          rates.line(t, total, "c-ink"),
          rates.upright(t[row]!),
        ),
      );
    };
  });
}
