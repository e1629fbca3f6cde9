// What the reader has set: which flight, which controller, which ghost, and every control that differs from the file.

import type { Control, Controller, FlightData } from "./contract";

export const FILE = "file"; // ghost: the same controller with the file's values

export interface Settings {
  readonly flight: string;
  readonly controller: string;
  /** "" none, FILE, or a controller's id. */
  readonly ghost: string;
  /** By key of a control: one value a component. */
  readonly values: Readonly<Record<string, readonly number[]>>;
}

/** Where a control's values are kept: shared ones by their id, a controller's own with its id in front. */
export function keyOf(control: Control, controller: Controller | undefined): string {
  return controller ? `${controller.id}.${control.id}` : control.id;
}

/** The settings of a flight as its file has it. */
export function fresh(flight: FlightData): Settings {
  return { flight: flight.id, controller: flight.controllers[0]?.id ?? "", ghost: "", values: {} };
}

/** Whether settings fly a flight as its file has it. */
export function isFresh(settings: Settings, flight: FlightData): boolean {
  return !Object.keys(settings.values).length && settings.controller === fresh(flight).controller;
}

const OUTSIDE = new Set(["t_f", "target", "yaw_end", "period", "size", "gust", "disturbance"]); // leave the loop at rest as it is, as events and the start do

/** Whether the loop at rest may be another than the file's: a steady wind tilts it, and an own one may differ where a larger circle starts. */
export function loopChanged(settings: Settings, flight: FlightData): boolean {
  const uniform = flight.controls.some(({ id }) => id === "wind");
  const outside = ({ group, id }: Control): boolean => group === "Events" || group === "Start" || OUTSIDE.has(id) || (id === "radius" && uniform);
  const moved = controlsOf(flight, controllerOf(flight, settings.controller)).filter(([control, owner]) => settings.values[keyOf(control, owner)]);
  return settings.controller !== fresh(flight).controller || moved.some(([control, owner]) => owner !== undefined || !outside(control));
}

/** Whether both fly the same. */
export function alike(one: Settings, other: Settings): boolean {
  const flown = ({ flight, controller, values }: Settings): string => JSON.stringify([flight, controller, Object.entries(values).sort(([a], [b]) => (a < b ? -1 : 1))]);
  return flown(one) === flown(other);
}

export function controllerOf(flight: FlightData, id: string): Controller | undefined {
  return flight.controllers.find((controller) => controller.id === id);
}

/** The values of a control, the file's where nothing was set. */
export function valuesOf(settings: Settings, control: Control, controller: Controller | undefined): readonly number[] {
  return settings.values[keyOf(control, controller)] ?? control.components.map((component) => component.value);
}

/** The settings with other values of a control; the file's own are not kept. */
export function withValues(
  settings: Settings,
  control: Control,
  controller: Controller | undefined,
  wanted: readonly number[],
): Settings {
  const key = keyOf(control, controller);
  const { [key]: _, ...rest } = settings.values;
  const held = control.components.map((component, i) => hold(control, wanted[i] ?? component.value));
  const same = control.components.every((component, i) => component.value === held[i]);
  return { ...settings, values: same ? rest : { ...rest, [key]: held } };
}

/** A value within what a control allows. The file's own values are always allowed. */
export function hold(control: Control, value: number): number {
  if (control.components.some((component) => component.value === value)) return value;
  const within = Math.min(Math.max(value, control.low), control.high);
  if (control.kind === "toggle") return within >= 0.5 ? 1 : 0;
  return control.kind === "neurons" ? Math.round(within) : within;
}

/** Every control of a flight under a controller, with the controller it belongs to. */
export function controlsOf(flight: FlightData, controller: Controller | undefined): (readonly [Control, Controller | undefined])[] {
  return [
    ...flight.controls.map((control) => [control, undefined] as const),
    ...(controller?.controls ?? []).map((control) => [control, controller] as const),
  ];
}
