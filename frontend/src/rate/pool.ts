// The flights of a campaign in workers, a few at a time, so that a new setting is flown at once; without WebAssembly one by one, by the page's laws.

import type { FlightData, Law, Rate } from "../data/contract";
import type { Inputs } from "../data/engine";
import { lawCode } from "../data/page";
import { doubles } from "../data/packed";
import { compiled } from "../data/webassembly";
import { type Done, type Job, type Setup, work } from "./worker";

const PORTION = 8; // flights: whole vectors, and no worker waits long for another
const MOST_WORKERS = 4;

/** What a setting flies with. */
export interface Setting {
  readonly given: Inputs;
  readonly law: Law;
  /** The last tick. */
  readonly last: number;
}

export class Pool {
  private readonly columns: Float64Array;
  private workers: Worker[] | undefined;
  private idle: Worker[] = []; // each as often as it may be given a portion
  private job: Omit<Job, "past"> | undefined;
  private setting: Setting | undefined;
  private id = 0;

  /** told: each portion of the latest setting. */
  constructor(
    private readonly data: FlightData,
    private readonly rate: Rate,
    private readonly told: (done: Done) => void,
  ) {
    this.columns = doubles(rate.rows);
  }

  /** Fly all flights with this setting, if there is one; what still flies with another is forgotten. */
  fly(setting: Setting | undefined): void {
    this.id++;
    this.job = undefined;
    if (!setting) return;
    const { given, law, last } = setting;
    const [starts, names] = [new Map(law.starts.map((name, i) => [name, i])), given.names];
    const value = (name: string): number => {
      const key = name.slice(name.indexOf(".") + 1);
      return (name.startsWith("start.") ? given.start[starts.get(key) ?? -1] : given.parameters[names.get(key) ?? -1]) ?? Number.NaN;
    };
    this.setting = setting;
    this.job = { id: this.id, constants: Float64Array.from(this.rate.constants, value), last, first: 0 };
    const module = this.workers ? undefined : compiled(this.rate.module);
    if (module) this.start(setting, module);
    if (!this.workers) return this.alone(this.id, 0);
    for (const worker of this.idle.splice(0)) this.next(worker);
  }

  private start({ given }: Setting, module: WebAssembly.Module): void {
    const { rate } = this;
    const url = URL.createObjectURL(new Blob([`(${work.toString()})()`], { type: "text/javascript" }));
    const tables = Float64Array.from(given.tables.flatMap((table) => [...table]));
    const { double, flights, results, every } = rate;
    const setup: Setup = { module, double, flights, constants: rate.constants.length, results, step: given.ticks.step, every, columns: this.columns, tables };
    this.workers = Array.from({ length: Math.min(navigator.hardwareConcurrency || 2, MOST_WORKERS) }, () => {
      const worker = new Worker(url);
      worker.postMessage(setup);
      worker.onmessage = ({ data }: MessageEvent<Done>) => {
        if (data.id === this.id) this.told(data);
        this.next(worker);
      };
      return worker;
    });
    this.idle = [...this.workers, ...this.workers]; // the next portion is there while the page draws
  }

  private next(worker: Worker): void {
    const { job } = this;
    if (!job || job.first >= this.rate.flights) return void this.idle.push(worker);
    const past = Math.min(job.first + PORTION, this.rate.flights);
    worker.postMessage({ ...job, past } satisfies Job);
    this.job = { ...job, first: past };
  }

  /** One flight by the page's own law, then the next. */
  private alone(id: number, flight: number): void {
    if (id !== this.id || flight >= this.rate.flights) return;
    this.told({ id, first: flight, past: flight + 1, rows: this.one(flight) });
    setTimeout(() => this.alone(id, flight + 1));
  }

  /** What a module writes of a flight, but for the score of what does not count. */
  private one(flight: number): Float64Array {
    const { given, law, last } = this.setting!;
    const { rate, columns, data } = this;
    const parameters = given.parameters.slice();
    const start = given.start.slice();
    rate.varies.forEach((name, row) => {
      const key = name.slice(name.indexOf(".") + 1);
      const [array, at] = name.startsWith("start.") ? [start, law.starts.indexOf(key)] : [parameters, given.names.get(key) ?? -1];
      array[at] = columns[row * rate.flights + flight]!;
    });
    const sample = rate.every[rate.every.length - 1]!;
    const ticks = { ...given.ticks, last, log: sample };
    const width = law.columns.length;
    const table = new Float64Array((Math.floor(last / sample) + 1) * width);
    const end = lawCode(given.controller.law)!.fly(parameters, given.tables, start, ticks, table);
    const column = (name: string): number => law.columns.findIndex(([own]) => own === name);
    const axes = data.scene.position.map((name, i) => [column(name), column(data.scene.wanted[i]!)] as const);
    const rows = new Float64Array(rate.results);
    rows[0] = end.code;
    rows[1] = end.tick;
    const since = Math.max(0, data.summary.since - 0.5 * ticks.step);
    for (let row = 0; row < end.rows; row++) {
      if (row * sample * ticks.step < since) continue;
      const away = axes.map(([flown, wanted]) => table[row * width + wanted]! - table[row * width + flown]!);
      const square = away[0]! * away[0]! + away[1]! * away[1]! + away[2]! * away[2]!;
      rows[2]!++;
      rows[3]! += square;
      rows[4] = Math.max(rows[4]!, square);
    }
    return rows;
  }
}
