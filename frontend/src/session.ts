// What the page shows now: settings, the flight they give, its ghost, and the judgement on its gains.

import type { FlightData, PageData } from "./data/contract";
import { type Judged, judge } from "./data/conditions";
import { type Inputs, fly, ghostOf, inputs } from "./data/engine";
import type { Flight } from "./data/flight";
import { recordedFlight } from "./data/recorded";
import { type Settings, controllerOf, fresh } from "./data/settings";
import { Watched } from "./view/events";

export interface Shown {
  readonly data: FlightData;
  readonly settings: Settings;
  readonly flight: Flight;
  readonly ghost: Flight | undefined;
  readonly given: Inputs | undefined;
  readonly conditions: readonly Judged[];
  readonly live: boolean;
  /** What flying took [ms]. */
  readonly took: number;
  /** The length of the axis of time [s]. */
  readonly end: number;
}

export class Session {
  readonly shown = new Watched<Shown | undefined>(undefined);
  private recorded = new Map<string, Flight | undefined>();

  constructor(readonly page: PageData) {}

  flight(id: string): FlightData | undefined {
    return this.page.flights.find((flight) => flight.id === id);
  }

  select(id: string): void {
    const flight = this.flight(id);
    if (flight) this.apply(fresh(flight));
  }

  /** Fly with these settings and show it. */
  apply(settings: Settings): void {
    const data = this.flight(settings.flight);
    if (!data) return;
    const before = performance.now();
    const controller = controllerOf(data, settings.controller);
    const given = controller && inputs(this.page, data, controller, settings);
    const flown = given && fly(this.page, given);
    const flight = flown ?? this.asRecorded(data);
    if (!flight) return;
    const other = flown ? ghostOf(data, settings) : undefined;
    const behind = other && inputs(this.page, data, other.controller, settings, other.own);
    const ghost = behind && fly(this.page, behind);
    const planned = given ? given.ticks.last * given.ticks.step : flight.last;
    this.shown.set({
      data,
      settings,
      flight,
      ghost,
      given,
      conditions: given ? judge(given) : [],
      live: flown !== undefined,
      took: performance.now() - before,
      end: Math.max(flight.last, ghost?.last ?? 0, flight.held ? 0 : Math.min(planned, flight.ended * 1.15)),
    });
  }

  private asRecorded(data: FlightData): Flight | undefined {
    if (!this.recorded.has(data.id)) this.recorded.set(data.id, recordedFlight(this.page, data));
    return this.recorded.get(data.id);
  }
}
