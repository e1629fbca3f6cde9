// window.quadstep: what a test, a teacher or the console can ask of the page.

import { csv } from "./data/csv";
import { controlsOf, controllerOf, withValues } from "./data/settings";
import { exactShare } from "./rate/interval";
import type { Tally } from "./rate/judge";
import { readScene } from "./scene/panel";
import type { SceneView } from "./scene/view";
import type { Session, Shown } from "./session";
import type { Clock } from "./view/clock";

/** scene, rate: where there is one. */
export function api(session: Session, clock: Clock, scene: () => SceneView | undefined, rate: () => Tally | undefined): object {
  const shown = (): Shown => {
    const now = session.shown.value;
    if (!now) throw new Error("no flight is shown");
    return now;
  };
  return Object.freeze({
    version: session.page.version,
    flights: () => session.page.flights.map((flight) => flight.id),
    /** Show a flight as its file has it. */
    select: (id: string) => session.select(id),
    columns: () => [...shown().flight.names],
    units: () => [...shown().flight.units],
    /** The flight on the screen, row by row. */
    rows: (): number[][] => {
      const { names, rows, table } = shown().flight;
      return Array.from({ length: rows }, (_, i) => Array.from(table.subarray(i * names.length, (i + 1) * names.length)));
    },
    csv: () => csv(shown().flight),
    outcome: () => {
      const { flight, ghost, live, took, graded, dragged, whole } = shown();
      const end = ghost ? { held: ghost.held, ended: ghost.ended, why: ghost.why } : null;
      return { held: flight.held, ended: flight.ended, why: flight.why, grade: graded.grade, reasons: [...graded.reasons], left: graded.left, ghost: end, live, took, dragged, whole: whole ?? null };
    },
    /** RMSE and largest error [m], largest tilt [rad], share of the full thrust, largest thrust [N]. */
    summary: () => ({ ...shown().measures }),
    conditions: () => shown().conditions.map(({ condition, left, right, holds }) => ({ text: condition.text, left, right, holds })),
    settings: () => structuredClone(shown().settings),
    controls: () => {
      const { data, settings } = shown();
      return controlsOf(data, controllerOf(data, settings.controller)).map(([control, owner]) => ({
        id: control.id,
        controller: owner?.id ?? "",
        values: control.components.map((component) => component.value),
      }));
    },
    /** One value for all components, or one each; flies. */
    setControl: (id: string, value: number | readonly number[]) => {
      const { data, settings } = shown();
      const found = controlsOf(data, controllerOf(data, settings.controller)).find(([control]) => control.id === id);
      if (!found) throw new Error(`no control ${id}`);
      const values = typeof value === "number" ? found[0].components.map(() => value) : value;
      session.apply(withValues(settings, found[0], found[1], values));
    },
    setController: (controller: string) => session.apply({ ...shown().settings, controller }),
    setGhost: (ghost: string) => session.apply({ ...shown().settings, ghost }),
    /** The log that was opened: name, kind, signals. */
    log: () => {
      const log = session.log.value;
      return log ? { name: log.name, kind: log.kind, signals: log.series.map(({ name, unit, values }) => ({ name, unit, count: values.length })) } : null;
    },
    /** One of its signals: times [s] and values. */
    signal: (name: string) => {
      const found = session.log.value?.series.find((one) => one.name === name);
      return found ? [Array.from(found.times), Array.from(found.values)] : null;
    },
    /** Fly once more with the settings as they are; milliseconds it took. */
    fly: (): number => {
      session.apply({ ...shown().settings });
      return shown().took;
    },
    /** Body to world as the scene draws it, at time t: w, x, y, z. */
    attitude: (t: number): number[] => {
      readScene();
      const q = quadstepScene.attitudeAt(shown().flight, shown().data.scene.attitude, t);
      return [q.w, q.x, q.y, q.z];
    },
    /** A share of flights with its exact 95 % interval. */
    share: (count: number, total: number) => exactShare(count, total),
    /** The flights of the campaign with these settings, as far as they are flown. */
    rate: () => {
      const tally = rate();
      if (!tally) return null;
      const { flown, failures, done } = tally;
      const all = { outcome: tally.code, ended: tally.ended, position_rmse: tally.position_rmse, largest_error: tally.largest_error, success: tally.success };
      return { flown, failures, done, ...Object.fromEntries(Object.entries(all).map(([name, values]) => [name, Array.from(values)])) };
    },
    /** Where the camera is, and the height of the ground [m]. */
    camera: () => scene()?.eye ?? null,
    seek: (t: number) => clock.seek(t),
    time: () => clock.time.value,
    play: () => clock.playing.set(true),
    pause: () => clock.playing.set(false),
    playing: () => clock.playing.value,
  });
}
