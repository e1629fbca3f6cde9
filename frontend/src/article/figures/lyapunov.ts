// The bowl: level sets of L with a flight and the ball b_r, and the terms of its rate stacked, the omitted one among them.

import { NARROW, Plot, keys, span, svg, text } from "../chart";
import { slider } from "../controls";
import { each, fly, tools } from "../data";
import { live, rowAt, scrub } from "../figure";
import { fixed } from "../words";

const TERMS = [
  ["rate_position", "c-blue", "gp", "outer gain"],
  ["rate_attitude", "c-sky", "ga", "inner gain"],
  ["rate_unknown", "c-gold", "gu", "what nets would have to learn"],
  ["rate_coupling", "c-vermillion", "gc", "the omitted coupling"],
] as const;
const [MASS, INERTIA, J_MOST] = [1, 5, 10]; // of the paper's vehicle, level
const MOST = 8; // of the terms that are shown [W]
const [WEIGHTS, MISSED, KAPPA] = [1, 0.02, 0.2]; // W_B, |eps_v| and, at first, kappa that the ball is drawn for

export function lyapunov(): void {
  live("lyapunov", (stage) => {
    const slope = slider(stage, "Lambda2", "Λ_2, inner loop", "/s", [0.5, 15, 0.5], true);
    const gain = slider(stage, "K_r2", "K_r2, inner loop", "N m s", [6, 250, 6], true);
    const kappa = slider(stage, "kappa", "κ, of the ball alone", "", [0.01, 3, KAPPA], true);
    const time = slider(stage, "time", "time", "s", [0, 7, 4.6], false, stage.run);
    let plots: readonly Plot[] = [];
    scrub(stage, time, () => plots);

    return () => {
      const flown = fly("lyapunov", { ...each("gains.slope_2", slope.value), ...each("gains.gain_2", gain.value) });
      const surplus = gain.value - J_MOST * slope.value;
      const more = Math.abs(surplus) < 0.1 ? 2 : 0; // decimals, or it would be written as 0
      const [t, r1, r2] = [flown.times, flown.column("norm_r1"), flown.column("norm_r2")];
      const height = flown.column("lyapunov");
      const row = rowAt(flown, time);
      const width = stage.width;

      const misprint = surplus > 0 && kappa.value !== KAPPA; // once it is asked for
      const size = Math.min(width - 64, 380);
      const lines = ([["the flight", "c-green", ""], ["still to come", "thin faint c-green", ""], ["heights of L", "ring c-muted", "la lp"], ...(surplus > 0 ? [["b_r", "dashdot c-pink", "ball"]] : []), ...(misprint ? [["b_r as printed", "dashed c-pink", "ball"]] : [])] as const) as readonly (readonly [string, string, string])[];
      const [meant, deep] = keys(8, 80, width, lines);
      const plane = new Plot({ left: 46 + (width - 64 - size) / 2, top: 92 + deep, width: size, height: 0.75 * size }, [0, Math.min(1.6, Math.max(0.6, 1.1 * Math.max(...r1)))], [0, Math.min(1.6, Math.max(0.3, 1.1 * Math.max(...r2)))]);
      const around = Array.from({ length: 41 }, (_, i) => (i * Math.PI) / 80);
      const far = (x: number, y: number): number => Math.min(...r1.map((one, k) => (k % 20 ? Infinity : Math.hypot(plane.x(one) - plane.x(x) - 18, plane.y(r2[k]!) - plane.y(y) - 4))));
      const taken: (readonly [number, number])[] = []; // where rings are labelled
      const level = (L: number): string => {
        const [across, up] = [around.map((a) => Math.sqrt((2 * L) / MASS) * Math.cos(a)), around.map((a) => Math.sqrt((2 * L) / INERTIA) * Math.sin(a))];
        const places = around.flatMap((_, i) => {
          const [x, y] = [plane.x(across[i]!), plane.y(up[i]!)];
          const free = x > 0.2 * size && x < size - 34 && y > 10 && y < 0.75 * size - 14 && taken.every(([left, top]) => Math.abs(left - x) > 40 || Math.abs(top - y) > 15);
          return i % 4 || !free ? [] : [[far(across[i]!, up[i]!), i] as const];
        });
        const [clear, at] = places.reduce((best, one) => (one[0] > best[0] ? one : best), [20, 0] as const);
        if (clear > 20) taken.push([plane.x(across[at]!), plane.y(up[at]!)]);
        const named = clear > 20 ? text(plane.x(across[at]!), plane.y(up[at]!) + 4, `${L} J`, "label small c-muted", "start", "la lp") : "";
        return plane.line(across, up, "ring c-muted", "la lp") + named;
      };
      const [right, printed] = tools.ball(kappa.value, WEIGHTS, MISSED, Math.min(3 - MASS, surplus));
      const ball = (radius: number, look: string): string => {
        const [across, up] = [around.map((a) => radius * Math.cos(a)), around.map((a) => radius * Math.sin(a))];
        return surplus <= 0 ? "" : plane.area(across, up.map(() => 0), up, "pale c-pink", "ball") + plane.line(across, up, `${look} c-pink`, "ball");
      };

      const zero = new Float64Array(flown.rows);
      const [up, down] = [zero.slice(), zero.slice()];
      const columns = TERMS.map(([name]) => flown.column(name));
      const stacked = TERMS.map(([, look, symbol], i) => {
        const [highs, lows] = [up.slice(), down.slice()];
        columns[i]!.forEach((value, k) => (value > 0 ? (up[k]! += value) : (down[k]! += value)));
        return { look, symbol, parts: [[highs, up.slice()], [down.slice(), lows]] as const };
      });
      const total = zero.slice();
      for (const column of columns) column.forEach((value, k) => (total[k]! += value));
      const [terms, tall] = keys(46, 92 + deep + 0.75 * size + 58, width, [...TERMS.map(([, look, symbol, name]) => [name, `area ${look}`, symbol] as const), ["their sum", "c-ink", ""]]);
      const top = 92 + deep + 0.75 * size + 58 + tall + 15;
      const [rate, seen] = [`${fixed(total[row]!, 3)} W`, r2[row]! > 0.01];
      const bound = seen ? `${fixed(Math.abs(columns[2]![row]!) / r2[row]!, 1)} N m` : "";
      const long = `at ${fixed(t[row]!, 2)} s: L = ${fixed(height[row]!, 3)} J with the integrals, its rate ${rate}${seen ? `, |ε| at least ${bound}` : ""}`;
      const said = width > NARROW ? long : `L = ${fixed(height[row]!, 3)} J, its rate ${rate}${seen ? `, |ε| ≥ ${bound}` : ""}`;
      const deepest = width > NARROW ? 170 : 120; // on a telephone all of it should be seen at once
      const rates = new Plot({ left: 46, top, width: width - 58, height: deepest }, [0, 7], span([up, down], -MOST, MOST, 0.2, 0));
      const cut = Math.max(...up) > MOST || Math.min(...down) < -MOST;
      plots = [rates];
      const areas = stacked.flatMap(({ look, symbol, parts }) => parts.map(([low, high]) => rates.area(t, low, high, look, symbol)));
      return svg(
        width,
        top + deepest + 38,
        text(8, 16, `K_r1 − mΛ_1 = 3 − 1 = 2 > 0: holds`, "c-ink"),
        text(8, 36, `K_r2 − J_M Λ_2 = ${fixed(gain.value, 1 + more)} − 10 · ${fixed(slope.value, 2 + more)} = ${fixed(surplus, 1 + more)}${surplus > 0 ? " > 0: holds" : ": does not hold"}`, surplus > 0 ? "c-ink" : "c-vermillion"),
        text(8, 56, flown.lost ? `the flight is ${flown.lost}` : said, total[row]! > 0.005 ? "c-vermillion" : "c-muted"),
        plane.framed(
          "|r_1| [m/s]",
          "|r_2| [rad/s]",
          ...[3, 1, 0.3, 0.13, 0.07, 0.03, 0.01].filter((L) => plane.x(Math.sqrt((2 * L) / MASS)) - plane.x(0) > size / 5).map(level),
          misprint ? ball(printed, "dashed") : "",
          ball(right, "dashdot"),
          plane.line(r1, r2, "thin faint c-green"),
          plane.line(r1.subarray(0, row + 1), r2.subarray(0, row + 1), "c-green"),
          plane.dot(r1[row]!, r2[row]!, "c-green", "", 5),
        ),
        meant,
        terms,
        rates.framed(
          "time [s]",
          `terms of the rate of L [W]${cut ? `, clipped at ±${MOST} W` : ""}`,
          ...areas,
          rates.level(0),
          rates.line(t, total, "c-ink"),
          rates.upright(t[row]!),
        ),
      );
    };
  });
}
