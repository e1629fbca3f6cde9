// Backstepping as nested commands: the vehicle, ghosts of what each step asks for, and the three pairs of curves.

import { type Box, NARROW, Plot, arrow, lit, span, svg, text } from "../chart";
import { button, slider } from "../controls";
import { each, fly } from "../data";
import { live } from "../figure";
import { legend } from "../legend";
import { fixed } from "../words";

const DEGREES = 180 / Math.PI;

/** The vehicle from the side: a bar with two rotors, leaning by theta, at (x, y) [px]. */
function vehicle(x: number, y: number, theta: number, look: string, symbol = ""): string {
  const place = `transform="translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${(-theta * DEGREES).toFixed(2)})"`;
  return `<g class="craft ${look}"${lit(symbol)} ${place}><path d="M-26 0H26M-26 0v-7M26 0v-7M-38-7h24M14-7h24"/><circle r="4.5"/></g>`;
}

export function nested(): void {
  live("nested", (stage) => {
    const { controls, redraw } = stage;
    const slope = slider(controls, "Λ₁, the outer loop", "1/s", [0.2, 3, 1], redraw, true);
    const gain = slider(controls, "K_r1, the outer loop", "N s/m", [1, 12, 3], redraw, true);
    const inner = slider(controls, "Λ₂, the inner loop", "1/s", [1.5, 30, 15], redraw, true);
    const time = slider(controls, "time", "s", [0, 8, 0.1], redraw);
    legend(controls, [
      ["e1", "c-ink", "position and e₁"],
      ["v", "c-blue dashed", "desired velocity"],
      ["vel", "c-blue", "velocity"],
      ["thd", "c-vermillion dashed", "desired lean θ_d"],
      ["th", "c-vermillion", "lean θ"],
    ]);
    let playing = 0;
    const play = button(controls, "Play", () => {
      playing = playing ? 0 : performance.now() - 1000 * (time.value >= 8 ? 0 : time.value);
      play.textContent = playing ? "Stop" : "Play";
      if (playing) requestAnimationFrame(step);
    });
    const alone = "alone" in document.documentElement.dataset;
    const step = (now: number): void => {
      if (!playing) return;
      if (alone && now - playing > 10_000) playing = now; // two seconds at rest, and again
      time.set(Math.min((now - playing) / 1000, 8));
      if (time.value >= 8 && !alone) (playing = 0), (play.textContent = "Play");
      else requestAnimationFrame(step);
      redraw();
    };
    if (alone && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) play.click();

    return () => {
      const flown = fly("nested", {
        ...each("gains.slope_1", slope.value),
        ...each("gains.gain_1", gain.value),
        ...each("gains.slope_2", inner.value),
        ...each("gains.gain_2", (250 / 15) * inner.value),
      });
      const [t, x, wanted] = [flown.times, flown.column("x"), flown.column("x_d")];
      const [speed, wish] = [flown.column("x_dot"), flown.column("velocity_x")];
      const [lean, asked] = [flown.column("theta").map((a) => a * DEGREES), flown.column("theta_d").map((a) => a * DEGREES)];
      const row = Math.min(flown.rows - 1, Math.round(time.value / 0.02));
      const width = stage.width;

      const scale = (width - 60) / 5;
      const [middle, left] = [96, 30 + 3.6 * scale];
      const at = (value: number): number => Math.min(Math.max(left + value * scale, 26), width - 26);
      const here = at(x[row]!);
      const scene = [
        `<path class="ground" d="M0 150H${width}"/>`,
        vehicle(at(0), middle, 0, "ghost c-muted", "e1"),
        text(at(0), middle + 34, "its place", "c-muted", "middle"),
        `<path class="gap c-ink"${lit("e1")} d="M${here.toFixed(1)} ${middle + 20}H${at(0).toFixed(1)}"/>`,
        vehicle(here, middle, asked[row]! / DEGREES, "ghost dashed c-vermillion", "thd"),
        vehicle(here, middle, lean[row]! / DEGREES, "c-ink", "th"),
        arrow(here, middle - 44, here + wish[row]! * scale * 0.4, middle - 44, "dashed c-blue", "v"),
        arrow(here, middle - 32, here + speed[row]! * scale * 0.4, middle - 32, "c-blue", "vel"),
        text(8, 18, `t = ${fixed(t[row]!, 2)} s`, "c-ink"),
        text(width - 8, width < NARROW ? 36 : 18, `e₁ ${fixed(-x[row]!, 2)} m, r₁ ${fixed(wish[row]! - speed[row]!, 2)} m/s, lean late by ${fixed(asked[row]! - lean[row]!, 1)}°`, "c-muted", "end"),
      ];
      const box = (i: number): Box => ({ left: 46, top: 190 + i * 128, width: width - 58, height: 84 });
      const ends = [0, 8] as const;
      const places = new Plot(box(0), ends, span([x, wanted], -6, 6, 1));
      const speeds = new Plot(box(1), ends, span([speed, wish], -8, 8, 1));
      const leans = new Plot(box(2), ends, span([lean, asked], -90, 90, 10));
      return svg(
        width,
        190 + 2 * 128 + 84 + 36,
        ...scene,
        places.framed("", "position x [m], and where it should be", places.line(t, wanted, "dashed c-muted", "e1"), places.line(t, x, "c-ink", "e1"), places.upright(t[row]!)),
        speeds.framed("", "velocity [m/s], and the desired one", speeds.line(t, wish, "dashed c-blue", "v r1"), speeds.line(t, speed, "c-blue", "vel r1"), speeds.upright(t[row]!)),
        leans.framed("time [s]", "lean [°], and the desired one", leans.line(t, asked, "dashed c-vermillion", "thd"), leans.line(t, lean, "c-vermillion", "th"), leans.upright(t[row]!)),
      );
    };
  });
}
