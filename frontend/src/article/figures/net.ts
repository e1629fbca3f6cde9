// The first net: its ten functions over the flight, their weights at one time, and the sum beside the force to be made.

import { Plot, lit, span, svg, text } from "../chart";
import { choice, slider } from "../controls";
import { data, fly } from "../data";
import { live } from "../figure";
import { legend } from "../legend";
import { fixed } from "../words";

export function net(): void {
  live("net", (stage) => {
    const { controls, redraw } = stage;
    const learning = slider(controls, "F₁, learning rate", "", [0.5, 100, 5], redraw, true);
    const damping = slider(controls, "κ, forgetting", "", [0.001, 3, 0.01], redraw, true);
    const scale = slider(controls, "disturbance, times", "", [0, 2, 1], redraw);
    const time = slider(controls, "time", "s", [0, 10, 3], redraw);
    const axis = choice(controls, "force along", ["x", "y", "z"], redraw);
    legend(controls, [
      ["mu", "c-green", "functions µᵢ"],
      ["w", "c-orange", "weights Ŵᵢ"],
      ["sum", "c-blue", "their sum Ŵᵀµ"],
      ["true", "c-ink dashed", "the force it should equal"],
    ]);

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
      const row = Math.min(flown.rows - 1, Math.round(time.value / 0.02));
      const width = stage.width;
      const ends = [0, 10] as const;
      const box = (top: number, height: number) => ({ left: 52, top, width: width - 64, height });
      const activity = new Plot(box(28, 110), ends, [0, 1]);
      const bars = new Plot(box(194, 110), [0.5, count + 0.5], span(weights, -60, 60, 0.02));
      const sum = new Plot(box(352, 150), ends, span([made, wanted], -40, 40, 0.2));
      const bar = (i: number): string => {
        const [zero, top, wide] = [bars.y(0), bars.y(weights[i]![row]!), bars.x(1) - bars.x(0)];
        return `<rect class="bar c-orange"${lit("w")} x="${(bars.x(i + 1) - wide * 0.3).toFixed(1)}" width="${(wide * 0.6).toFixed(1)}" y="${Math.min(zero, top).toFixed(1)}" height="${Math.max(0.5, Math.abs(top - zero)).toFixed(1)}"/>`;
      };
      return svg(
        width,
        352 + 150 + 38,
        activity.framed("", "activity µᵢ of each of the ten functions", ...neurons.map((one) => activity.line(t, one, "thin c-green", "mu")), activity.upright(t[row]!)),
        bars.framed("", `weights Ŵᵢ along ${"xyz"[axis.value]} at ${fixed(t[row]!, 2)} s`, bars.level(0), ...neurons.map((_, i) => bar(i))),
        sum.framed("time [s]", `force along ${"xyz"[axis.value]} [N]: the sum and the true one`, sum.level(0), sum.line(t, wanted, "dashed c-ink", "true"), sum.line(t, made, "c-blue", "sum"), sum.upright(t[row]!)),
        flown.lost ? text(width - 12, 344, flown.lost, "c-vermillion", "end") : "",
      );
    };
  });
}
