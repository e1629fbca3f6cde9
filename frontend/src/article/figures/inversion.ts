// The inversion of Eqs 40 to 52: a force to drag in space, the vehicle that makes it, and the one that the print would fly.

import { NARROW, arrow, lit, svg, text } from "../chart";
import { slider } from "../controls";
import { tools } from "../data";
import { dragged, live } from "../figure";
import { fixed } from "../words";

type Point = readonly [number, number, number];

const MOST = 10; // of each part of the force [N]
const [ARM, ROTOR] = [3.6, 1.65]; // of the vehicle
const DEGREES = 180 / Math.PI;
const [TURN, TILT] = [0.62, 0.38]; // of the camera [rad]
const [RIGHT, AWAY] = [
  [Math.cos(TURN), Math.sin(TURN), 0] as const,
  [-Math.sin(TURN) * Math.sin(TILT), Math.cos(TURN) * Math.sin(TILT), Math.cos(TILT)] as const,
];
const dot = (a: Point, b: Point): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export function inversion(): void {
  live("inversion", (stage) => {
    const force = (["f_x", "f_y", "f_z"] as const).map((name, i) => slider(stage, name, name, "N", [-MOST, MOST, [4, 3, 9][i]!]));
    let view = { x: 0, y: 0, scale: 1 };
    const place = (p: Point): readonly [number, number] => [view.x + dot(p, RIGHT) * view.scale, view.y - dot(p, AWAY) * view.scale];
    const now = (): Point => force.map((one) => one.value) as unknown as Point;
    dragged(stage, (left, top, first) => {
      const [x, y] = place(now());
      if (first && Math.hypot(left - x, top - y) > 36) return false;
      const [across, up] = [(left - x) / view.scale, (y - top) / view.scale];
      force.forEach((one, i) => one.set(Number((one.value + across * RIGHT[i]! + up * AWAY[i]!).toFixed(2))));
      stage.redraw();
      return true;
    });

    /** Arms and rotors of a vehicle at the origin with this pitch and roll. */
    const craft = (theta: number, phi: number, look: string, symbol: string): string => {
      const x = tools.direction(theta - Math.PI / 2, phi); // its own axes: the thrust's direction, a quarter turn away
      const y = tools.direction(0, phi + Math.PI / 2);
      const at = (a: number, b: number): string => {
        const [left, top] = place([a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]]);
        return `${left.toFixed(1)} ${top.toFixed(1)}`;
      };
      const ring = (a: number, b: number): string => `M${Array.from({ length: 25 }, (_, i) => at(a + ROTOR * Math.cos((i * Math.PI) / 12), b + ROTOR * Math.sin((i * Math.PI) / 12))).join("L")}`;
      return `<g class="craft ${look}"${lit(symbol)}><path d="M${at(-ARM, 0)}L${at(ARM, 0)}M${at(0, -ARM)}L${at(0, ARM)}${ring(ARM, 0)}${ring(-ARM, 0)}${ring(0, ARM)}${ring(0, -ARM)}"/></g>`;
    };
    const vector = (p: Point, look: string, symbol: string): string => arrow(...place([0, 0, 0]), ...place(p), look, symbol);

    return () => {
      const f = now();
      const [u, theta, phi] = tools.invert(...f);
      const [printed] = tools.printedRoll(...f);
      const made = tools.direction(theta, printed).map((part) => u * part) as unknown as Point;
      const missed = Math.hypot(f[0] - made[0], f[1] - made[1], f[2] - made[2]);
      const turned = (tools.invert(f[0], f[1] + 0.1, f[2])[2] - phi) * DEGREES;
      const swing = Math.abs(((turned + 540) % 360) - 180);
      const width = stage.width;
      const height = Math.min(420, Math.max(330, 0.62 * width));
      const down = width < NARROW ? 58 : 0; // below the numbers, which take its whole width
      const tall = height + down;
      view = { x: width / 2, y: 0.53 * height + down, scale: Math.min(width / 20, height / 20) };
      const grid = [-9, -6, -3, 0, 3, 6, 9].map((at) => {
        const [[a, b], [c, d], [e, g], [h, k]] = [place([at, -9, 0]), place([at, 9, 0]), place([-9, at, 0]), place([9, at, 0])];
        return `<path class="grid" d="M${a.toFixed(1)} ${b.toFixed(1)}L${c.toFixed(1)} ${d.toFixed(1)}M${e.toFixed(1)} ${g.toFixed(1)}L${h.toFixed(1)} ${k.toFixed(1)}"/>`;
      });
      const [, above] = place([0, 0, 10]);
      const [tipX, tipY] = place(f);
      const foot = place([f[0], f[1], 0]);
      const wrong = missed > 1e-6;
      const [madeX, madeY] = place(made);
      const said = [Math.min(Math.max(madeX + (madeX < tipX ? -60 : 60), 100), width - 100), Math.min(Math.max(madeY + (madeY < view.y ? -46 : 46), 84), tall - 22)] as const;
      const tip = [Math.min(tipX + 14, width - 105), tipX + 14 > width - 105 ? tipY + 28 : tipY - 8] as const;
      const covered = (x: number, y: number): boolean => Math.abs(x - tip[0] - 48) < 60 && Math.abs(y - tip[1]) < 18; // by the force's label
      const names = ([["x", [10.2, 0, 0]], ["y", [0, 10.2, 0]], ["z", [0, 0, 10.6]]] as const).slice(0, width < NARROW ? 2 : 3).map(([name, p]) => text(place(p)[0], place(p)[1] + (covered(...place(p)) ? 26 : 0), name, "c-muted", "middle"));
      return svg(
        width,
        tall,
        ...grid,
        `<path class="grid" d="M${view.x} ${view.y}V${above.toFixed(1)}"/>`,
        ...names,
        `<path class="zero" stroke-dasharray="2 4" d="M${tipX.toFixed(1)} ${tipY.toFixed(1)}L${foot[0].toFixed(1)} ${foot[1].toFixed(1)}L${view.x.toFixed(1)} ${view.y.toFixed(1)}"/>`,
        wrong ? craft(theta, printed, "ghost dashed c-vermillion", "printed") + vector(made, "dashed c-vermillion", "printed") : "",
        craft(theta, phi, "c-ink", "thd phid u"),
        vector(f, "c-blue", "u force"),
        text(...tip, "desired force F", "label c-blue", "start", "force"),
        wrong ? `<path class="leader c-vermillion"${lit("printed")} d="M${place(made).join(" ")}L${said.join(" ")}"/>${text(said[0], said[1] + (said[1] < height / 2 ? -6 : 15), "what the printed roll makes", "label c-vermillion", "middle", "printed")}` : "",
        `<circle class="handle c-blue" cx="${tipX.toFixed(1)}" cy="${tipY.toFixed(1)}" r="9"/>`,
        text(8, 18, `u_d = ${fixed(u, 2)} N, θ_d = ${fixed(theta * DEGREES, 1)}°, φ_d = ${fixed(phi * DEGREES, 1)}°`, "c-ink"),
        text(8, 38, `0.1 N more along y would turn φ_d by ${fixed(swing, swing < 10 ? 1 : 0)}°`, swing > 10 ? "c-orange" : "c-muted"),
        text(8, 58, wrong ? `the printed φ_d = ${fixed(printed * DEGREES, 1)}° misses by ${fixed(missed, 2)} N` : "the printed φ_d is the same here", wrong ? "c-vermillion" : "c-muted"),
      );
    };
  });
}
