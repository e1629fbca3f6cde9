// Play, pause, speed and the bar that scrubs.

import type { Clock } from "./clock";
import { append, h, icon, iconButton } from "./dom";
import { seconds } from "./format";

const PLAY = "M8 5.2v13.6L19 12z";
const PAUSE = "M7 5h3.6v14H7zM13.4 5H17v14h-3.6z";
const START = "M6 5h2.4v14H6zM19 5.2v13.6L9.5 12z";
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

export function transport(host: HTMLElement, clock: Clock): void {
  const play = iconButton("Play (space)", PLAY, { id: "play" });
  const start = iconButton("To the start (Home)", START, { id: "to-start" });
  const bar = h("input", { type: "range", id: "scrub", min: 0, max: 1000, step: "any", value: 0, "aria-label": "Time" });
  const now = h("output", { id: "time", for: "scrub" });
  const speed = h(
    "select",
    { id: "speed", "aria-label": "Speed", title: "Speed" },
    ...SPEEDS.map((value) => h("option", { value: String(value) }, `${value}×`)),
  );
  append(host, start, play, bar, now, speed);

  play.addEventListener("click", () => clock.toggle());
  start.addEventListener("click", () => clock.seek(0));
  bar.addEventListener("input", () => clock.seek(Number(bar.value)));
  speed.addEventListener("change", () => clock.speed.set(Number(speed.value)));
  clock.speed.watch((value) => (speed.value = String(value)));
  clock.playing.watch((playing) => {
    const name = playing ? "Pause (space)" : "Play (space)";
    play.setAttribute("aria-label", name);
    play.title = name;
    play.replaceChildren(icon(playing ? PAUSE : PLAY));
  });
  const show = (): void => {
    const [t, end] = [clock.time.value, clock.end.value];
    bar.max = String(end);
    bar.value = String(t);
    bar.setAttribute("aria-valuetext", `${seconds(t)} of ${seconds(end)} seconds`);
    bar.style.setProperty("--at", `${(t / end) * 100}%`);
    now.replaceChildren(h("b", {}, seconds(t)), ` / ${seconds(end)} s`);
  };
  clock.time.watch(show);
  clock.end.follow(show);
}
