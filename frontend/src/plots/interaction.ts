// Hands on a plot: hover reads, click moves the time cursor, drag, wheel and two fingers zoom, double click shows all again.

import type { Clock } from "../view/clock";
import { timeAt } from "./figure";
import type { Plot } from "./plot";
import type { TimeWindow } from "./range";

const CLICK = 4; // pixels a click may wander
const STEP = 0.7; // of the range, for one step of zoom

export function listen(plot: Plot, window: TimeWindow, clock: Clock, hover: (t: number | undefined) => void): void {
  const { stage } = plot;
  let from: { x: number; t: number } | undefined;
  const fingers = new Map<number, { x: number; readonly t: number }>(); // where they are, and the time that each holds

  const place = (event: MouseEvent): { x: number; t: number } | undefined => {
    const { frame } = plot;
    if (!frame || plot.panel.across) return undefined; // not time across: nothing to seek
    const x = event.clientX - stage.getBoundingClientRect().left;
    const t = Math.min(Math.max(timeAt(frame, x), frame.time.least), frame.time.most);
    return { x, t };
  };

  stage.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    from = place(event);
    if (event.pointerType === "mouse") stage.setPointerCapture(event.pointerId);
    else if (from) {
      if (!fingers.size) clock.seek(from.t);
      fingers.set(event.pointerId, from);
    }
  });
  stage.addEventListener("pointermove", (event) => {
    const here = place(event);
    if (!here) return;
    const finger = fingers.get(event.pointerId);
    if (finger) finger.x = here.x;
    if (fingers.size > 1) return pinch(plot, window, [...fingers.values()]);
    hover(here.t);
    if (!from) return;
    if (event.pointerType === "mouse") plot.setBrush(Math.abs(here.x - from.x) > CLICK ? { from: from.t, to: here.t } : undefined);
    else clock.seek(here.t);
  });
  stage.addEventListener("pointerup", (event) => {
    const here = place(event);
    if (from && here && event.pointerType === "mouse") {
      if (Math.abs(here.x - from.x) > CLICK) window.zoom(from.t, here.t);
      else clock.seek(here.t);
    }
    end(event);
  });
  const end = (event: PointerEvent): void => {
    fingers.delete(event.pointerId);
    from = undefined;
    plot.setBrush(undefined);
  };
  stage.addEventListener("pointercancel", end);
  stage.addEventListener("pointerleave", () => hover(undefined));
  stage.addEventListener("dblclick", () => reset(plot, window));
  stage.addEventListener(
    "wheel",
    (event) => {
      // Without Ctrl (or a pinch) a plot that nobody has clicked lets the page scroll on.
      if (!event.ctrlKey && document.activeElement !== stage) return;
      const here = place(event);
      if (!here) return;
      event.preventDefault();
      window.zoomAbout(here.t, event.deltaY > 0 ? 1 / STEP : STEP);
    },
    { passive: false },
  );
  stage.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "+" || event.key === "=") window.zoomAbout(clock.time.value, STEP);
    else if (event.key === "-") window.zoomAbout(clock.time.value, 1 / STEP);
    else if (event.key === "0") reset(plot, window);
    else return;
    event.preventDefault();
  });
}

/** Show the stretch in which the first and the last finger still hold their times. */
function pinch({ frame }: Plot, window: TimeWindow, fingers: readonly { x: number; t: number }[]): void {
  const [one, other] = [fingers[0]!, fingers.at(-1)!];
  const rate = (other.t - one.t) / (other.x - one.x); // s/px
  if (!frame || !(rate > 0 && Number.isFinite(rate))) return;
  const least = one.t - (one.x - frame.box.left) * rate;
  window.zoom(least, least + frame.box.width * rate);
}

function reset(plot: Plot, window: TimeWindow): void {
  plot.zoomValues(undefined);
  window.reset();
}
