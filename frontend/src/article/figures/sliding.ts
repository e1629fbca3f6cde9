// The filtered error: the plane of e and its rate, the line r = 0 that Lambda turns, and a start that can be dragged.

import { Plot, span, svg, text } from "../chart";
import { slider } from "../controls";
import { each, fly } from "../data";
import { dragged, live } from "../figure";
import { legend } from "../legend";
import { fixed } from "../words";

const MOST = 3;

export function sliding(): void {
  live("sliding", (stage) => {
    const { controls, redraw } = stage;
    const slope = slider(controls, "Λ₁, the line", "1/s", [0.3, 3, 1], redraw, true);
    const gain = slider(controls, "K_r1", "N s/m", [1, 15, 3], redraw, true);
    const error = slider(controls, "e at the start", "m", [-MOST, MOST, 1.5], redraw);
    const rate = slider(controls, "its rate", "m/s", [-MOST, MOST, 0], redraw);
    legend(controls, [
      ["r1", "c-vermillion", "the line r₁ = 0, and r₁"],
      ["e1", "c-blue", "the flight, and e₁"],
    ]);
    let plane: Plot | undefined;
    dragged(stage, (left, top, first) => {
      if (!plane) return false;
      const [e, de] = plane.at(left, top);
      const near = Math.hypot(plane.x(e) - plane.x(error.value), plane.y(de) - plane.y(rate.value)) < 36;
      if (first && !near) return false;
      error.set(Number(e.toFixed(2))), rate.set(Number(de.toFixed(2))), redraw();
      return true;
    });

    return () => {
      const flown = fly("sliding", {
        ...each("gains.slope_1", slope.value),
        ...each("gains.gain_1", gain.value),
        "position.0": -error.value,
        "velocity.0": -rate.value,
      });
      const [t, e, de, r] = [flown.times, flown.column("e1_x"), flown.column("e1_dot_x"), flown.column("r1_x")];
      const width = stage.width;
      const size = Math.min(width - 64, 420);
      const ends = [-MOST - 0.4, MOST + 0.4] as const;
      plane = new Plot({ left: 46 + (width - 64 - size) / 2, top: 46, width: size, height: size }, ends, ends);
      const line = [ends[0], ends[1]].map((value) => -slope.value * value);
      const below = new Plot({ left: 46, top: size + 112, width: width - 58, height: 100 }, [0, 8], span([e, r], -4, 4, 1));
      return svg(
        width,
        size + 112 + 100 + 38,
        plane.framed(
          "error e [m]",
          "its rate [m/s]",
          plane.level(0),
          plane.upright(0),
          plane.line(ends, line, "c-vermillion", "r1"),
          plane.line(e, de, "c-blue", "e1"),
          ...[0.5, 1, 1.5, 2, 3, 4].map((at) => plane!.dot(e[Math.min(flown.rows - 1, at * 50)]!, de[Math.min(flown.rows - 1, at * 50)]!, "c-blue", "e1", 2.5)),
          `<circle class="handle c-blue" cx="${plane.x(error.value).toFixed(1)}" cy="${plane.y(rate.value).toFixed(1)}" r="9"/>`,
        ),
        text(46, 14, `r₁ at the start ${fixed(r[0]!, 2)} m/s; after 4 s e₁ ${fixed(1000 * (e[Math.min(flown.rows - 1, 200)] ?? 0), 0)} mm`, "c-ink"),
        below.framed("time [s]", "e₁ [m] and r₁ [m/s]", below.level(0), below.line(t, e, "c-blue", "e1"), below.line(t, r, "c-vermillion", "r1")),
      );
    };
  });
}
