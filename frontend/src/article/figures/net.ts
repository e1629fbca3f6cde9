// The first net: its ten functions over the flight, their weights at one time, and the sum beside the force to be made.

import { Plot, keys, lit, span, svg, text } from "../chart";
import { choice, slider } from "../controls";
import { data, fly } from "../data";
import { live, rowAt, scrub } from "../figure";
import { fixed } from "../words";

export function net(): void {
  live("net", (stage) => {
    const learning = slider(stage, "F1", "F_1, learning rate", "", [0.5, 20, 5], true);
    const damping = slider(stage, "kappa", "κ, forgetting", "", [0.001, 3, 0.01], true);
    const scale = slider(stage, "scale", "disturbance, times", "", [0, 2, 1]);
    const time = slider(stage, "time", "time", "s", [0, 10, 3], false, stage.run);
    const axis = choice(stage.controls, "force along", ["x", "y", "z"], stage.redraw);
    let plots: readonly Plot[] = [];
    scrub(stage, time, () => plots);

    return () => {
      const flown = fly("net", {
        "gains.force_net.learning_rate": learning.value,
        "gains.force_net.damping": damping.value,
        "disturbance.scale": scale.value,
      });
      const count = data.neurons;
      const t = flown.times;
      const neurons = Array.from({ length: count }, (_, i) => flown.column(`net_${i}`));
      const weights = Array.from({ length: count }, (_, i) => flown.column(`net_${count + 3 * i + axis.value}`));
      const made = flown.column(`net_${4 * count + axis.value}`);
      const wanted = flown.column(`net_${4 * count + 3 + axis.value}`);
      const row = rowAt(flown, time);
      const width = stage.width;
      const ends = [0, 10] as const;
      const [meant, lines] = keys(52, 350, width, [["the net: Σ Ŵ_i µ_i", "c-blue", "sum"], [`what it should equal, −A_${"xyz"[axis.value]}`, "dashed c-ink", "true"]]);
      const height = 356 + lines + 5 + 188;
      const box = (top: number, height: number) => ({ left: 52, top, width: width - 64, height });
      const activity = new Plot(box(28, 110), ends, [0, 1]);
      const bars = new Plot(box(190, 100), [0.5, count + 0.5], span(weights, -60, 60, 0.02));
      const sum = new Plot(box(height - 188, 150), ends, span([made, wanted], -40, 40, 0.2));
      plots = [activity, sum];
      const bar = (i: number): string => {
        const [zero, top, wide] = [bars.y(0), bars.y(weights[i]![row]!), bars.x(1) - bars.x(0)];
        return `<rect class="bar c-orange"${lit(`w n${i}`)} x="${(bars.x(i + 1) - wide * 0.3).toFixed(1)}" width="${(wide * 0.6).toFixed(1)}" y="${Math.min(zero, top).toFixed(1)}" height="${Math.max(0.5, Math.abs(top - zero)).toFixed(1)}"/>`;
      };
      return svg(
        width,
        height,
        meant,
        activity.framed("", "values of the ten functions µ_i", ...neurons.map((one, i) => activity.line(t, one, "thin c-green", `mu n${i}`)), activity.upright(t[row]!)),
        bars.framed("function i", `their weights Ŵ_i along ${"xyz"[axis.value]} at ${fixed(t[row]!, 2)} s`, bars.level(0), ...neurons.map((_, i) => bar(i))),
        sum.framed("time [s]", `force along ${"xyz"[axis.value]} [N]`, sum.level(0), sum.line(t, wanted, "dashed c-ink", "true"), sum.line(t, made, "c-blue", "sum"), sum.upright(t[row]!)),
        flown.lost ? text(width - 12, height - 195, `${flown.lost}: the curves end there`, "c-vermillion", "end") : "",
      );
    };
  });
}
