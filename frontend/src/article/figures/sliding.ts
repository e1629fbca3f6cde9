// The filtered error: the plane of e and its rate, the line r = 0 that Lambda turns, and a start that can be dragged.

import { Plot, span, svg, text } from "../chart";
import { slider } from "../controls";
import { each, fly } from "../data";
import { dragged, live } from "../figure";
import { fixed } from "../words";

const MOST = 3;

export function sliding(): void {
  live("sliding", (stage) => {
    const slope = slider(stage, "Lambda1", "Λ_1, slope of the line", "/s", [0.3, 3, 1], true);
    const gain = slider(stage, "K_r1", "K_r1", "N s/m", [1, 12, 3], true);
    const error = slider(stage, "e", "e_1 at the start", "m", [-MOST, MOST, 1.5]);
    const rate = slider(stage, "rate", "its rate", "m/s", [-MOST, MOST, 0]);
    let plane: Plot | undefined;
    dragged(stage, (left, top, first) => {
      if (!plane) return false;
      const [e, de] = plane.at(left, top);
      const near = Math.hypot(plane.x(e) - plane.x(error.value), plane.y(de) - plane.y(rate.value)) < 36;
      if (first && !near) return false;
      error.set(Number(e.toFixed(2))), rate.set(Number(de.toFixed(2))), stage.redraw();
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
      const lineAt = -Math.min(2.6, 2.2 / slope.value);
      const line = [ends[0], ends[1]].map((value) => -slope.value * value);
      const below = new Plot({ left: 46, top: size + 112, width: width - 58, height: 100 }, [0, 5], span([e, r], -4, 4, 1, 0.28));
      return svg(
        width,
        size + 112 + 100 + 38,
        plane.framed(
          "position error e_1 [m]",
          "its rate [m/s]",
          plane.level(0),
          plane.upright(0),
          plane.line(ends, line, "c-vermillion", "r1"),
          plane.line(e, de, "c-blue", "e1"),
          ...[0.5, 1, 1.5, 2, 3, 4].map((at) => plane!.dot(e[Math.min(flown.rows - 1, at * 50)]!, de[Math.min(flown.rows - 1, at * 50)]!, "c-blue", "e1", 2.5)),
          plane.label(lineAt, -slope.value * lineAt, "the line r_1 = 0", "c-vermillion", "r1"),
          text(plane.x(error.value) + 14, plane.y(rate.value) - 8, "start", "label c-blue", "start", "e1"),
          `<circle class="handle c-blue" cx="${plane.x(error.value).toFixed(1)}" cy="${plane.y(rate.value).toFixed(1)}" r="9"/>`,
        ),
        flown.lost ? text(46, 34, `${flown.lost}: the curves end there`, "c-vermillion") : "",
        text(46, 14, `r_1 at the start: ${fixed(r[0]!, 2)} m/s${flown.rows > 250 ? `; e_1 after 5 s: ${fixed(1000 * e[250]!, 0)} mm` : ""}`, "c-ink"),
        below.framed("time [s]", "e_1 [m] and r_1 [m/s]", below.level(0), below.line(t, e, "c-blue", "e1"), below.line(t, r, "c-vermillion", "r1"), below.labels(t, [{ ys: e, said: "error e_1 [m]", look: "c-blue", symbol: "e1" }, { ys: r, said: "filtered error r_1 [m/s]", look: "c-vermillion", symbol: "r1" }], 0.4, 0.45)),
      );
    };
  });
}
