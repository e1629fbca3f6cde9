// What the page shows now: settings, the flight they give, its ghost, and the judgement on its gains.

import type { FlightData, PageData } from "./data/contract";
import { type Judged, judge } from "./data/conditions";
import { Draft } from "./data/draft";
import { type Inputs, type Net, fly, flyNet, ghostOf, inputs } from "./data/engine";
import type { Flight } from "./data/flight";
import { recordedFlight } from "./data/recorded";
import { type Settings, alike, controllerOf, fresh, isFresh } from "./data/settings";
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
  /** Whether a control is being dragged. */
  readonly dragged: boolean;
  /** All that would be flown, where only its beginning was, because a control is being dragged [s]. */
  readonly whole: number | undefined;
  /** The last tick of all that would be flown. */
  readonly last: number;
  /** What flying took [ms]. */
  readonly took: number;
  /** The length of the axis of time [s]. */
  readonly end: number;
}

/** What a flight is compared with: the file's, or in a walk its step's as it began. */
export interface Original {
  readonly measures: Measures;
  readonly held: boolean;
  readonly ended: number; // [s]
  /** Whether it is the flight itself. */
  readonly same: boolean;
}

export class Session {
  readonly shown = new Watched<Shown | undefined>(undefined);
  /** An earlier flight that is laid over, and a log that was opened. */
  readonly kept = new Watched<Flight | undefined>(undefined);
  readonly log = new Watched<Log | undefined>(undefined);
  private recorded = new Map<string, Flight | undefined>();
  private lastNet: { flight: Flight; net: Net | undefined } | undefined;
  private readonly measured = new Map<string, Measures>();
  private readonly draft = new Draft();
  private begun: { readonly settings: Settings; readonly flown: Omit<Original, "same"> | undefined } | undefined;

  /** cursor: the time at which the reader looks [s]. */
  constructor(
    readonly page: PageData,
    private readonly cursor: () => number,
  ) {}

  flight(id: string): FlightData | undefined {
    return this.page.flights.find((flight) => flight.id === id);
  }

  select(id: string): void {
    const flight = this.flight(id);
    if (flight) this.apply(fresh(flight));
  }

  /** Fly with these settings and show it; dragged: no more of it than there is time for between two pictures. */
  apply(settings: Settings, dragged = false): void {
    const data = this.flight(settings.flight);
    if (!data) return;
    const before = performance.now();
    const controller = controllerOf(data, settings.controller);
    const other = ghostOf(data, settings);
    const all = controller && inputs(this.page, data, controller, settings);
    const cut = (some: Inputs): Inputs =>
      dragged ? { ...some, ticks: this.draft.ticks(some.ticks, [controller, other?.controller].flatMap((one) => one?.law ?? []), this.cursor()) } : some;
    const given = all && cut(all);
    const flown = given && this.fly(given);
    const flight = flown ?? this.asRecorded(data);
    if (!flight) return;
    const behind = flown && other && inputs(this.page, data, other.controller, settings, other.own);
    const ghost = behind && this.fly(cut(behind));
    const asFiled = isFresh(settings, data);
    const here = measure(flight, data, given);
    // What Python measured comes first: a recording in the page is thinned.
    const measures = flown ? here : { ...here, ...data.summary.filed };
    const whole = flown?.held && given!.ticks.last < all!.ticks.last ? all!.ticks.last * all!.ticks.step : undefined;
    if (asFiled && whole === undefined) this.measured.set(data.id, measures);
    const planned = all ? all.ticks.last * all.ticks.step : flight.last;
    this.shown.set({
      data,
      settings,
      flight,
      ghost,
      given,
      conditions: given ? judge(given) : [],
      measures,
      graded: grade(flight, measures, this.page, data.limits),
      asFiled,
      live: flown !== undefined,
      dragged,
      whole,
      last: all?.ticks.last ?? 0,
      took: performance.now() - before,
      end: Math.max(flight.last, ghost?.last ?? 0, whole ?? 0, flight.held ? 0 : Math.min(planned, flight.ended * 1.15)),
    });
  }

  /** A step of a walk begins with these settings; undefined: nobody walks. */
  begin(settings?: Settings): void {
    const data = settings && this.flight(settings.flight);
    const { given, flight } = data ? this.asSet(data, settings) : {};
    this.begun = settings && { settings, flown: data && flight && { measures: measure(flight, data, given), held: flight.held, ended: flight.ended } };
  }

  original(shown: Shown): Original {
    const { data, settings, asFiled } = shown;
    const { begun } = this;
    if (begun?.flown && begun.settings.flight === data.id && !isFresh(begun.settings, data)) return { ...begun.flown, same: alike(begun.settings, settings) };
    return { measures: this.filed(shown), held: data.outcome.grade !== "lost", ended: data.outcome.ended, same: asFiled };
  }

  /** What the file's own flight was like: as Python measured it, and what it did not as flown here. */
  private filed({ data, measures }: Shown): Measures {
    let found = this.measured.get(data.id);
    if (!found) {
      const { given, flight } = this.asSet(data);
      found = { ...(flight ? measure(flight, data, given) : measures), ...data.summary.filed };
      this.measured.set(data.id, found);
    }
    return found;
  }

  /** Lay a flight, as its file has it, behind those that are shown. */
  keep(data: FlightData): void {
    this.kept.set(this.asSet(data).flight ?? this.asRecorded(data));
  }

  private asSet(data: FlightData, settings = fresh(data)): { given: Inputs | undefined; flight: Flight | undefined } {
    const controller = controllerOf(data, settings.controller);
    const given = controller && inputs(this.page, data, controller, settings);
    return { given, flight: given && fly(this.page, given) };
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

  private fly(given: Inputs): Flight | undefined {
    const before = performance.now();
    const flight = fly(this.page, given);
    if (flight) this.draft.flew(given.controller.law, flight.ended / given.ticks.step, performance.now() - before);
    return flight;
  }

  private asRecorded(data: FlightData): Flight | undefined {
    if (!this.recorded.has(data.id)) this.recorded.set(data.id, recordedFlight(this.page, data));
    return this.recorded.get(data.id);
  }
}
