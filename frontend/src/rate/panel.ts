// How often flights like the one on the screen fail: a sentence and a histogram that follow the controls.

import type { FlightData, PageData, Rate } from "../data/contract";
import { inputs } from "../data/engine";
import { controllerOf, fresh } from "../data/settings";
import { CanvasSurface } from "../plots/canvas";
import { ticks as marks } from "../plots/ticks";
import type { Session, Shown } from "../session";
import { byId, fill, h } from "../view/dom";
import { number, plain, quantity } from "../view/format";
import { palette } from "../view/theme";
import { exactShare, shareDifference } from "./interval";
import { Tally } from "./judge";
import { Pool, type Setting } from "./pool";
import type { Done } from "./worker";

type Metric = keyof Rate["failure"];
const NAMES: Record<Metric, string> = { largest_error: "largest error", position_rmse: "position RMSE" };
const BINS = 48;
const ENDS = [2, 3, 6, 12, 24, BINS]; // times the limit, which is then an edge of a bin
const HEIGHT = 120; // px
const PAUSE = 100; // ms between pictures while flights are counted: drawing takes time from the workers

export class RatePanel {
  tally: Tally | undefined;
  private flight = "";
  private from = ""; // when errors begin to count, in words
  private pool: Pool | undefined;
  private rate: Rate | undefined;
  private usual: readonly number[] = [];
  private own: Setting | undefined; // as the file has it
  private now: Setting | undefined; // of the tally
  private before: Tally | undefined; // its flights
  private counted: Tally | undefined; // what flies now
  private readonly most = new Map<Metric, number>(); // the right end of each histogram
  private readonly words = h("p", { id: "rate-words" });
  private readonly pictures = h("div"); // a histogram for each metric with a limit
  private readonly note = h("p", { class: "note" });
  private histograms = new Map<Metric, HTMLCanvasElement>();
  private drawing = 0;
  private due = 0; // when to draw what is counted [ms]

  constructor(
    private readonly page: PageData,
    private readonly session: Session,
  ) {
    fill(byId("rate"), h("h3", {}, "How often does it fail?"), this.words, this.pictures, this.note);
    this.show();
    palette.follow(() => this.request());
    new ResizeObserver(() => this.request()).observe(byId("rate"));
  }

  /** What is shown now. */
  show(): void {
    const shown = this.session.shown.value;
    if (!shown) return;
    const { data } = shown;
    if (data.id !== this.flight) this.open(data);
    const { rate, pool } = this;
    byId("rate").hidden = !rate;
    if (!rate || !pool) return;
    const setting = this.setting(shown, rate);
    this.note.hidden = this.pictures.hidden = setting === undefined;
    if (!setting) {
      pool.fly(this.tally = this.counted = this.now = undefined);
      const own = controllerOf(data, shown.settings.controller) === data.controllers[0];
      this.words.textContent = `The campaign ${own ? `varies ${rate.keys.join("; ")} itself; restore the original value${rate.keys.length > 1 ? "s" : ""}` : "flies the mission’s controller; restore it"} to see the failure rate.`;
      return;
    }
    if (this.now && alike(setting, this.now)) return; // a control came to rest where it was
    this.now = setting;
    const own = this.own !== undefined && alike(setting, this.own);
    this.tally = own && this.before?.done ? this.before : new Tally(rate);
    if (own) this.before = this.tally;
    this.due = 0;
    this.count(this.tally, setting);
    this.draw(); // at once, or the count before would stand beside the new values
  }

  private count(tally: Tally, setting: Setting): void {
    this.counted = tally;
    this.pool?.fly(tally.done ? undefined : setting);
  }

  /** A portion has been flown; after the last one of the setting shown, the flights of the file where they are not known yet. */
  private told(done: Done): void {
    const { counted, own, rate } = this;
    counted?.add(done);
    if (counted?.done && rate && own && !this.before?.done) this.count((this.before = new Tally(rate)), own);
    if (!counted?.done && performance.now() < this.due) return;
    this.due = performance.now() + PAUSE;
    this.request();
  }

  private open(data: FlightData): void {
    this.flight = data.id;
    this.from = data.summary.since > 0 ? ` from ${plain(data.summary.since)}\u00a0s on` : "";
    this.rate = data.rate ?? undefined;
    this.most.clear();
    const limited = Object.keys(this.rate?.failure ?? {}) as Metric[];
    this.histograms = new Map((limited.length ? limited : ["largest_error" as const]).map((metric) => [metric, h("canvas", { role: "img" })]));
    fill(this.pictures, ...this.histograms.values());
    this.pool = data.rate ? new Pool(data, data.rate, (done) => this.told(done)) : undefined;
    const controller = data.controllers[0];
    const given = controller && inputs(this.page, data, controller, fresh(data));
    this.own = given ? { given, law: this.page.laws[controller.law]!, last: given.ticks.last } : undefined;
    this.usual = data.rate && this.own ? varied(data.rate, this.own) : [];
    this.before = this.now = undefined;
  }

  /** What the campaign flies with; undefined where a control set what the campaign varies, or another controller flies. */
  private setting({ data, settings, given, last }: Shown, rate: Rate): Setting | undefined {
    const law = given && this.page.laws[given.controller.law];
    if (!given || !law || controllerOf(data, settings.controller) !== data.controllers[0]) return undefined;
    const setting = { given, law, last };
    return varied(rate, setting).every((value, i) => Object.is(value, this.usual[i])) ? setting : undefined;
  }

  private request(): void {
    this.drawing ||= requestAnimationFrame(() => {
      this.drawing = 0;
      this.draw();
    });
  }

  private draw(): void {
    const { tally, rate } = this;
    if (!tally || !rate) return;
    this.pictures.classList.toggle("counting", !tally.flown);
    if (!tally.flown) this.words.textContent = "Counting…";
    else this.words.replaceChildren(...sentence(tally), ...paired(tally, this.original));
    const varied = [...rate.keys, ...rate.random.map((one) => `${one}, drawn anew for each flight`)];
    this.note.textContent = [
      fails(rate, this.from),
      this.original ? "Outline: the same flights with the original values." : "",
      varied.length ? `Varied from flight to flight: ${varied.join("; ")}.` : "",
      tally.done ? "" : `${whole(tally.flown)} of ${whole(rate.flights)} flown so far.`,
    ].filter(Boolean).join(" ");
    if (tally.flown || !this.before?.flown) for (const [metric, canvas] of this.histograms) this.histogram(metric, canvas, tally, rate);
  }

  /** The flights of the file, where others are shown. */
  private get original(): Tally | undefined {
    return this.before?.done && this.before !== this.tally ? this.before : undefined;
  }

  private histogram(metric: Metric, canvas: HTMLCanvasElement, tally: Tally, rate: Rate): void {
    const name = `${NAMES[metric]}${this.from}`;
    const limit = rate.failure[metric];
    const kept = completed(tally, metric);
    const most = this.most.get(metric) || (limit ? limit * endOf(kept, limit) : roundUp(Math.max(...kept))) || 1;
    if (tally.done && kept.length) this.most.set(metric, most);
    const counts = binned(kept, most);
    const usual = this.original ? binned(completed(this.original, metric), most).map((count) => (count * tally.flown) / rate.flights) : [];
    const above = kept.filter((value) => value > most).length;
    const lost = tally.code.filter((code) => code > 0).length;
    const width = canvas.parentElement?.clientWidth ?? 0;
    const pen = canvas.getContext("2d");
    if (!pen || !width) return;
    canvas.style.height = `${HEIGHT}px`;
    [canvas.width, canvas.height] = [Math.round(width * devicePixelRatio), Math.round(HEIGHT * devicePixelRatio)];
    pen.scale(devicePixelRatio, devicePixelRatio);
    const surface = new CanvasSurface(pen);
    const colours = palette.value;
    const [floor, right, top] = [HEIGHT - 34, width - (above ? 102 : 46), 18];
    const x = (value: number): number => 6 + (value / most) * (right - 6);
    const tallest = Math.max(...counts, ...usual.map(Math.ceil)) || Math.max(above, lost, 1);
    const bar = (left: number, wide: number, count: number, colour: string): void => {
      const height = Math.min(count / tallest, 1) * (floor - top);
      surface.rectangle({ left, top: floor - height, width: wide, height }, colour);
    };
    counts.forEach((count, i) => {
      const from = x((i * most) / BINS);
      const beyond = limit !== undefined && ((i + 0.5) * most) / BINS > limit;
      bar(from, x(((i + 1) * most) / BINS) - from - 1, count, beyond ? colours.vermillion : colours.blue);
    });
    surface.polyline([6, floor + 0.5, width - 6, floor + 0.5], { colour: colours.line, width: 1, dash: [] });
    const small = { colour: colours.muted, size: 11, align: "center" } as const;
    const outline = usual.flatMap((count, i) => [i, i + 1].flatMap((edge) => [x((edge * most) / BINS), floor - (count / tallest) * (floor - top)]));
    if (outline.length) surface.polyline(outline, { colour: colours.ink, width: 1.2, dash: [] });
    if (limit !== undefined) {
      surface.polyline([x(limit), x(limit) < 68 ? top : 4, x(limit), floor], { colour: colours.ink, width: 1, dash: [3, 3] });
      surface.text(Math.max(x(limit) + 4, 68), 8, "limit", { ...small, align: "left" });
    }
    surface.polyline([6, top + 0.5, right, top + 0.5], { colour: colours.line, width: 1, dash: [2, 3] });
    surface.text(6, 8, `${tallest} flight${tallest === 1 ? "" : "s"}`, { ...small, align: "left" });
    // Apart, as high as the scale reaches, with their counts
    const apart = (middle: number, count: number, name: string, colour: string): void => {
      bar(middle - 11, 22, count, colour);
      if (count > tallest) surface.polyline([middle - 13, top + 14, middle + 13, top + 8], { colour: colours.panel, width: 3, dash: [] });
      if (count) surface.text(middle, 8, `${count}`, { ...small, colour: colours.ink });
      surface.text(middle, floor + 11, name, small);
    };
    if (above) apart(width - 71, above, `> ${plain(most)}`, limit === undefined ? colours.blue : colours.vermillion);
    apart(width - 21, lost, "lost", colours.vermillion);
    for (const value of marks(0, most, right / 70)) if (!above || x(value) < right - 10) surface.text(x(value), floor + 11, plain(value), small);
    surface.text((6 + right) / 2, floor + 26, `${name} [m]`, small);
    canvas.setAttribute("aria-label", `Histogram of the ${name} of ${kept.length} completed flights${above ? `, ${above} of them above ${plain(most)} m` : ""}; ${lost} were lost.`);
  }
}

/** A metric of the flights that were completed. */
function completed(tally: Tally, metric: Metric): Float64Array {
  return tally[metric].filter((value, i) => tally.code[i] === 0 && Number.isFinite(value));
}

/** How many limits the axis spans: so many that few values lie beyond. */
function endOf(values: Float64Array, limit: number): number {
  return ENDS.find((end) => values.filter((value) => value > end * limit).length <= values.length / 20) ?? BINS;
}

/** How many values each bar holds, of those up to `most`; one on an edge is in the bar below it, as a flight at its limit is a success. */
function binned(values: Float64Array, most: number): number[] {
  const counts = new Array<number>(BINS).fill(0);
  for (const value of values) if (value <= most) counts[Math.max(Math.ceil((value / most) * BINS) - 1, 0)]!++;
  return counts;
}

/** The numbers that the campaign varies, as this setting has them. */
function varied({ varies }: Rate, { given, law }: Setting): number[] {
  return varies.map((name) => {
    const key = name.slice(name.indexOf(".") + 1);
    return name.startsWith("start.") ? given.start[law.starts.indexOf(key)]! : given.parameters[given.names.get(key) ?? -1]!;
  });
}

function sentence({ failures, flown }: Tally): Node[] {
  const { value, low, high } = exactShare(failures, flown);
  const percent = (share: number): string => `${number(100 * share, 3)}\u00a0%`;
  const strong = h("b", {}, `${whole(failures)} of ${whole(flown)} flight${flown === 1 ? "" : "s"} ${failures === 1 ? "fails" : "fail"}: ${percent(value)}`);
  return [strong, document.createTextNode(` (95 % interval ${percent(low)} to ${percent(high)}).`)];
}

/** A count of flights. */
function whole(count: number): string {
  return count.toLocaleString("en");
}

/** What counts as a failure. */
function fails({ failure }: Rate, from: string): string {
  const bounds = Object.entries(failure).map(([name, most]) => `, or if its ${NAMES[name as Metric]}${from} exceeds ${quantity(most, "m")}`);
  return `A flight fails if it is lost${bounds.join("")}.`;
}

/** What the same flights do with the values of the file, once all of both are flown. */
function paired(tally: Tally, before: Tally | undefined): Node[] {
  if (!tally.done || !before) return [];
  const more = before.success.filter((good, i) => good && !tally.success[i]).length;
  const fewer = tally.success.filter((good, i) => good && !before.success[i]).length;
  const { value, low, high } = shareDifference(more, fewer, tally.flown);
  const [least, most] = value < 0 ? [-high, -low] : [low, high];
  const points = (share: number): string => number(100 * share, 3);
  const told = value ? `${points(Math.abs(value))} points ${value < 0 ? "fewer" : "more"} than` : "as many as";
  const may = least > 0 || !value ? "" : ", which may be chance";
  return [document.createTextNode(` That is ${told} with the original values (${whole(before.failures)}; 95 % interval of the difference ${points(least)} to ${points(most)}${value ? "" : " points"})${may}.`)];
}

/** Whether two settings fly with the same numbers. */
function alike(one: Setting, other: Setting): boolean {
  const same = (a: ArrayLike<number>, b: ArrayLike<number>): boolean => a.length === b.length && Array.from(a).every((value, i) => Object.is(value, b[i]));
  return one.last === other.last && same(one.given.parameters, other.given.parameters) && same(one.given.start, other.given.start);
}

/** To one or two significant digits, upwards. */
function roundUp(value: number): number {
  if (!(value > 0)) return 0;
  const step = 10 ** Math.floor(Math.log10(value)) / 2;
  return Math.ceil(value / step) * step;
}
