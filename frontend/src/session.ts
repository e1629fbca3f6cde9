// What the page shows now: settings, the flight they give, its ghost, and the judgement on its gains.

import type { FlightData, PageData } from "./data/contract";
import { type Judged, judge } from "./data/conditions";
import { type Inputs, type Net, fly, flyNet, ghostOf, inputs } from "./data/engine";
import type { Flight } from "./data/flight";
import { recordedFlight } from "./data/recorded";
import { type Settings, controllerOf, fresh, isFresh } from "./data/settings";
import type { Log } from "./logs/log";
import { type Graded, grade } from "./summary/grade";
import { type Measures, measure } from "./summary/measure";
import { Watched } from "./view/events";

export interface Shown {
  readonly data: FlightData;
  readonly settings: Settings;
  readonly flight: Flight;
  readonly ghost: Flight | undefined;
  readonly given: Inputs | undefined;
  readonly conditions: readonly Judged[];
  readonly measures: Measures;
  readonly graded: Graded;
  /** Whether it flies as the file says. */
  readonly asFiled: boolean;
  readonly live: boolean;
  /** What flying took [ms]. */
  readonly took: number;
  /** The length of the axis of time [s]. */
  readonly end: number;
}

export class Session {
  readonly shown = new Watched<Shown | undefined>(undefined);
  /** An earlier flight that is laid over, and a log that was opened. */
  readonly kept = new Watched<Flight | undefined>(undefined);
  readonly log = new Watched<Log | undefined>(undefined);
  private recorded = new Map<string, Flight | undefined>();
  private lastNet: { flight: Flight; net: Net | undefined } | undefined;
  private readonly measured = new Map<string, Measures>();

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
    const asFiled = isFresh(settings, data);
    const here = measure(flight, data, given);
    // What Python measured comes first: a recording in the page is thinned.
    const measures = flown ? here : { ...here, ...data.summary.filed };
    if (asFiled) this.measured.set(data.id, measures);
    const planned = given ? given.ticks.last * given.ticks.step : flight.last;
    this.shown.set({
      data,
      settings,
      flight,
      ghost,
      given,
      conditions: given ? judge(given) : [],
      measures,
      graded: grade(flight.held, measures, this.page.rules),
      asFiled,
      live: flown !== undefined,
      took: performance.now() - before,
      end: Math.max(flight.last, ghost?.last ?? 0, flight.held ? 0 : Math.min(planned, flight.ended * 1.15)),
    });
  }

  /** What the file's own flight was like: as Python measured it, and what it did not as flown here. */
  filed({ data, measures }: Shown): Measures {
    let found = this.measured.get(data.id);
    if (!found) {
      const settings = fresh(data);
      const controller = controllerOf(data, settings.controller);
      const given = controller && inputs(this.page, data, controller, settings);
      const flight = given && fly(this.page, given);
      found = { ...(flight ? measure(flight, data, given) : measures), ...data.summary.filed };
      this.measured.set(data.id, found);
    }
    return found;
  }

  /** Whether the law that flies has a net to show. */
  hasNet({ given }: Shown): boolean {
    return given !== undefined && (this.page.laws[given.controller.law]?.net ?? 0) > 0;
  }

  /** The first net of the flight, row by row as the law shows it; undefined: there is none to show. */
  net({ given, flight }: Shown): Net | undefined {
    const law = given && this.page.laws[given.controller.law];
    if (!given || !law?.net) return undefined;
    if (this.lastNet?.flight !== flight) this.lastNet = { flight, net: flyNet(given, law) };
    return this.lastNet.net;
  }

  private asRecorded(data: FlightData): Flight | undefined {
    if (!this.recorded.has(data.id)) this.recorded.set(data.id, recordedFlight(this.page, data));
    return this.recorded.get(data.id);
  }
}
