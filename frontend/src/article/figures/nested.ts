// Backstepping as nested commands: the vehicle, ghosts of what each step asks for, and the three pairs of curves.

import { type Box, NARROW, type Named, Plot, arrow, lit, span, svg, text } from "../chart";
import { button, slider } from "../controls";
import { each, fly } from "../data";
import { calm, live, rowAt, scrub } from "../figure";
import { fixed } from "../words";

const DEGREES = 180 / Math.PI;
const CRAFT = 1.6; // size of the vehicle
const FIRST = 232; // top of the first plot [px]
const END = 4; // of the flight [s]

/** The vehicle from the side: a bar with two rotors, tilting by theta, at (x, y) [px]. */
function vehicle(x: number, y: number, theta: number, look: string, symbol = ""): string {
  const place = `transform="translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${(-theta * DEGREES).toFixed(2)}) scale(${CRAFT})"`;
  return `<g class="craft ${look}"${lit(symbol)} ${place}><path d="M-26 0H26M-26 0v-7M26 0v-7M-38-7h24M14-7h24"/><circle r="4.5"/></g>`;
}

export function nested(): void {
  live("nested", (stage) => {
    const { redraw, run } = stage;
    const play = button(run, "Play", () => {
      shown = Math.max(0, time.value >= END ? 0 : time.value);
      playing = playing ? 0 : performance.now() - 1000 * shown;
      time.set(shown);
      play.textContent = playing ? "Stop" : "Play";
      if (playing) requestAnimationFrame(step);
    });
    const slope = slider(stage, "Lambda1", "Λ_1, outer loop", "/s", [0.2, 3, 1], true);
    const gain = slider(stage, "K_r1", "K_r1, outer loop", "N s/m", [1, 12, 3], true);
    const inner = slider(stage, "Lambda2", "Λ_2, K_r2 = 16.7 Λ_2", "/s", [1, 30, 15], true);
    const time = slider(stage, "time", "time", "s", [0, END, 0.14], false, run);
    let plots: readonly Plot[] = [];
    scrub(stage, time, () => plots);
    let [playing, shown] = [0, 0];
    const alone = "alone" in document.documentElement.dataset;
    const step = (now: number): void => {
      if (!playing) return;
      const taken = time.value !== shown; // by a finger, a link, or the end of a lost flight
      if (alone && now - playing > 1000 * END + 1500) playing = now; // a moment at rest, and again
      if (!taken) time.set(Math.min((now - playing) / 1000, END));
      shown = time.value;
      if (taken || (shown >= END && !alone) || stage.drawing.getBoundingClientRect().bottom < 0) play.click();
      else requestAnimationFrame(step);
      redraw();
    };
    const once = new IntersectionObserver(([one]) => {
      if (one!.isIntersecting) once.disconnect(), play.click();
    });
    if (!calm()) once.observe(stage.drawing);

    return () => {
      const flown = fly("nested", {
        ...each("gains.slope_1", slope.value),
        ...each("gains.gain_1", gain.value),
        ...each("gains.slope_2", inner.value),
        ...each("gains.gain_2", (250 / 15) * inner.value),
      });
      const [t, x, wanted] = [flown.times, flown.column("x"), flown.column("x_d")];
      const [speed, wish] = [flown.column("x_dot"), flown.column("velocity_x")];
      const [tilt, asked] = [flown.column("theta").map((a) => a * DEGREES), flown.column("theta_d").map((a) => a * DEGREES)];
      const row = rowAt(flown, time);
      const width = stage.width;

      const scale = (width - 60) / 5;
      const [middle, left] = [116, 30 + 3.6 * scale];
      const at = (value: number): number => Math.min(Math.max(left + value * scale, 42), width - 42);
      const here = at(x[row]!);
      const arrows = (name: string, value: number, up: number, look: string, symbol: string): string => {
        const end = here + value * scale * 0.4;
        const right = Math.max(here, end) + 8;
        const fits = right + 7 * name.length < width;
        return arrow(here, middle - up, end, middle - up, look, symbol) + text(fits ? right : Math.min(here, end) - 8, middle - up + 4, name, look, fits ? "start" : "end", symbol);
      };
      const scene = [
        `<path class="ground" d="M0 192H${width}"/>`,
        vehicle(at(0), middle, 0, "ghost c-muted", "e1"),
        text(at(0), middle + 46, "target", "c-muted", "middle", "e1"),
        `<path class="gap c-ink"${lit("e1")} d="M${here.toFixed(1)} ${middle + 28}H${at(0).toFixed(1)}"/>`,
        Math.abs(at(0) - here) > 60 ? text((here + at(0)) / 2, middle + 48, "e_1", "c-ink", "middle", "e1") : "",
        vehicle(here, middle, asked[row]! / DEGREES, "ghost dashed c-vermillion", "thd"),
        Math.abs(asked[row]! - tilt[row]!) > 3 ? text(here - 42, middle + 64, "desired tilt", "c-vermillion", "start", "thd") : "",
        vehicle(here, middle, tilt[row]! / DEGREES, "c-ink", "th"),
        arrows("desired velocity v", wish[row]!, 70, "dashed c-blue", "v"),
        arrows("velocity", speed[row]!, 54, "c-blue", "vel"),
        text(8, 18, `t = ${fixed(t[row]!, 2)} s`, "c-ink"),
        flown.lost
          ? text(width - 8, width < NARROW ? 33 : 18, `${flown.lost}: the curves end there`, "c-vermillion", "end")
          : text(width - 8, width < NARROW ? 33 : 18, `e_1 ${fixed(-x[row]!, 2)} m, r_1 ${fixed(wish[row]! - speed[row]!, 2)} m/s, θ ${fixed(tilt[row]!, 0)}°, θ_d ${fixed(asked[row]!, 0)}°`, "c-muted", "end"),
      ];
      const box = (i: number): Box => ({ left: 46, top: FIRST + i * 134, width: width - 58, height: 90 });
      const ends = [0, END] as const;
      plots = [new Plot(box(0), ends, span([x, wanted], -6, 6, 1, 0.35)), new Plot(box(1), ends, span([speed, wish], -8, 8, 1, 0.35)), new Plot(box(2), ends, span([tilt, asked], -90, 90, 10, 0.35))];
      const pair = (plot: Plot, xName: string, yName: string, flew: Named, wished: Named): string =>
        plot.framed(xName, yName, plot.line(t, wished.ys, wished.look, wished.symbol), plot.line(t, flew.ys, flew.look, flew.symbol), plot.upright(t[row]!), plot.labels(t, [flew, wished]));
      const [places, speeds, tilts] = plots as [Plot, Plot, Plot];
      return svg(
        width,
        FIRST + 2 * 134 + 90 + 36,
        ...scene,
        pair(places, "", "position x [m]", { ys: x, said: "where it is", look: "c-ink", symbol: "e1" }, { ys: wanted, said: "where it should be", look: "dashed c-muted", symbol: "e1" }),
        pair(speeds, "", "velocity [m/s]", { ys: speed, said: "velocity", look: "c-blue", symbol: "r1 vel" }, { ys: wish, said: "desired velocity v", look: "dashed c-blue", symbol: "r1 v" }),
        pair(tilts, "time [s]", "tilt [°]", { ys: tilt, said: "tilt θ", look: "c-vermillion", symbol: "th" }, { ys: asked, said: "desired tilt θ_d", look: "dashed c-vermillion", symbol: "thd" }),
      );
    };
  });
}
