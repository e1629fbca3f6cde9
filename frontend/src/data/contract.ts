// What Python writes into the page (src/quadstep/page): data as JSON, laws as JavaScript.

/** JSON has neither Infinity nor NaN: read with Number(). */
export type Num = number | "Infinity" | "-Infinity";

/** base64 of little-endian numbers. */
export type Packed = string;

export interface PageData {
  readonly format: 1;
  readonly version: string;
  readonly title: string;
  /** Parts of a paragraph, every other one in bold. */
  readonly intro: readonly string[];
  readonly links: readonly { label: string; href: string }[];
  readonly laws: Readonly<Record<string, Law>>;
  readonly presets: Readonly<Record<string, Packed>>;
  readonly tables: Readonly<Record<string, Packed>>;
  /** By code; code 0 is completed. */
  readonly outcomes: readonly { name: string; text: string; ended: boolean; limit: Limit | null }[];
  /** What grades a flight, as quadstep/metrics/verdict.py says. */
  readonly rules: readonly Rule[];
  /** What is said of a flight that left its path, or the point to hold, and what follows where it sank: {} stands for lengths. */
  readonly left: readonly [off: string, away: string, sank: string];
  readonly flights: readonly FlightData[];
  readonly claims: readonly Claim[];
  readonly story: StoryData | null;
}

/** A parameter whose limit a flight passed, and the reason: {} stands for factor times the limit. */
export interface Limit {
  readonly name: string;
  readonly text: string;
  readonly factor: number;
}

/** A flight is as commanded while the measure is at most `most`; label, text: what is said where it is not, {} for factor times the measure; measured: whether it can be told; held: the text where the path is a point, if it is another. */
export interface Rule {
  readonly metric: MeasureName;
  readonly most: number;
  readonly label: string;
  readonly text: string;
  readonly factor: number;
  readonly measured: boolean;
  readonly held: string;
}

export type Grade = "as commanded" | "flew, but" | "above the limit" | "lost";

export type MeasureName = "rmse" | "largest" | "tilt" | "share" | "relative" | "heading" | "growth" | "rateGrowth" | "overturned" | "shaking" | "saturated";

/** A guided walk. */
export interface StoryData {
  readonly title: string;
  readonly steps: readonly StepData[];
}

export interface StepData {
  readonly title: string;
  readonly text: readonly string[];
  readonly flight: string;
  readonly controller: string;
  readonly ghost: string;
  /** As settings keep them. */
  readonly values: Readonly<Record<string, readonly number[]>>;
  /** A control, "controller" or "ghost". */
  readonly move: string;
  /** A plot, "net" or "scene". */
  readonly watch: string;
  /** What of it to look at; "" where that is plain. */
  readonly look: string;
  readonly time: number | null;
  /** The stretch of time of the plots [s]; null: all. */
  readonly window: readonly [number, number] | null;
  readonly camera: "orbit" | "follow";
  readonly guess: Guess | null;
  /** Within what numbers of a flight that completes have to be [m, rad]; one number: at least that. */
  readonly success: Readonly<Partial<Record<"rmse" | "largest" | "tilt", readonly [number, number?]>>>;
  /** Whether its grade has to be "as commanded", too. */
  readonly asCommanded: boolean;
  /** What reaches it, as settings keep them. */
  readonly solution: Readonly<Record<string, readonly number[]>>;
}

/** A question before a step's flight. */
export interface Guess {
  readonly ask: string;
  readonly choices: readonly string[];
  /** The right one's place, from 0. */
  readonly answer: number;
  /** Set once somebody has guessed, the values as settings keep them. */
  readonly controller: string;
  readonly values: Readonly<Record<string, readonly number[]>>;
}

/** Facts about a compiled loop. */
export interface Law {
  readonly names: readonly string[];
  readonly starts: readonly string[];
  readonly tables: readonly string[];
  readonly columns: readonly (readonly [name: string, unit: string])[];
  readonly tasks: readonly string[];
  /** To switch neuron k off, off[i] goes to parameter number parameters[i]; presets have all on. */
  readonly neurons: readonly { parameters: readonly number[]; off: readonly number[] }[];
  /** Neurons of the net that `fly` shows, 0 for none: at each row their activity, three weights each, the net's force, the one it should make. */
  readonly net: number;
}

export interface Ticks {
  step: number;
  every: number[];
  log: number;
  last: number;
}

/** A compiled loop. rows: filled; code: index into outcomes; ended at tick * step; the result's rows are the valid ones. */
export interface LawCode {
  fly(
    parameters: Float64Array,
    tables: Float64Array[],
    start: Float64Array,
    ticks: Ticks,
    rows: Float64Array,
    net?: Float64Array,
  ): { code: number; tick: number; rows: number };
  /** Flies in place of JavaScript, where it is set and no net is asked for; its code and tick. */
  run: ((parameters: Float64Array, tables: Float64Array[], start: Float64Array, ticks: Ticks, rows: Float64Array) => [code: number, tick: number]) | undefined;
  /** As every engine computes them, to the bit. */
  cos(x: number): number;
  atan2(y: number, x: number): number;
}

export interface FlightData {
  readonly id: string;
  readonly name: string;
  readonly group: string;
  readonly note: string;
  readonly claims: readonly number[];
  readonly outcome: { readonly code: number; readonly ended: number; readonly text: string; readonly why: string; readonly grade: Grade; readonly reasons: readonly string[]; readonly left: boolean };
  readonly facts: readonly (readonly [label: string, value: string])[];
  readonly summary: SummaryData;
  /** Why it is not flown live; "" if it is. */
  readonly whyNot: string;
  readonly warnings: readonly string[];
  /** The grade of the file's loop at rest, and why if it is not sound; "" where it is not known. */
  readonly margins: string;
  readonly recorded: Recorded | null;
  readonly controllers: readonly Controller[];
  readonly controls: readonly Control[];
  readonly ticks: Readonly<Ticks>;
  readonly scene: SceneData;
  readonly panels: readonly PanelData[];
  /** Its place where its group is a table; colour: of many flights like it, instead of its mark. */
  readonly cell: { readonly block: string; readonly row: string; readonly column: string; readonly rowAxis: string; readonly columnAxis: string; readonly colour: string } | null;
  readonly rate: Rate | null;
  /** Above which it fails, as quadstep/metrics/verdict.py says. */
  readonly limits: readonly Rule[];
}

/** Many flights like one, as a campaign flies them. */
export interface Rate {
  /** WebAssembly, in base64. */
  readonly module: string;
  readonly double: boolean;
  readonly flights: number;
  /** Names of the numbers that all flights share, in order: "start.…" or "parameters.…"; and of those that differ. */
  readonly constants: readonly string[];
  readonly varies: readonly string[];
  /** One row a varying number, one column a flight. */
  readonly rows: Packed;
  readonly every: readonly number[];
  readonly results: number;
  /** The most that a metric may be. */
  readonly failure: Readonly<Partial<Record<"position_rmse" | "largest_error", number>>>;
  readonly keys: readonly string[];
  readonly random: readonly string[];
}

export interface SummaryData {
  /** Errors count from this time on [s]. */
  readonly since: number;
  /** The parameter that holds a rotor's greatest thrust [N]. */
  readonly limit: string | null;
  /** The parameter that holds its least thrust [N]. */
  readonly least: string | null;
  /** From the vehicle's centre to its farthest rotor [m]; 0: not known. */
  readonly arm: number;
  /** Of a newton along the axis of each rotor, what all of them lift [N]. */
  readonly upward: number;
  /** How much of its path is flown, in a clause; "" for all of it. */
  readonly cut: string;
  /** What Python measured of the file's flight, as far as it did. share: greatest part of the rotors' full thrust. */
  readonly filed: Readonly<Partial<Record<MeasureName, number>>>;
}

export interface Recorded {
  readonly columns: readonly (readonly [string, string])[];
  readonly rows: Packed;
  readonly type: "f64" | "f32";
  readonly count: number;
  readonly period: number;
}

export interface Controller {
  readonly id: string;
  readonly label: string;
  readonly law: string;
  readonly preset: string;
  readonly overrides: readonly (readonly [index: number, value: Num])[];
  readonly tables: readonly string[];
  readonly start: readonly Num[];
  readonly controls: readonly Control[];
  readonly conditions: readonly Condition[];
  /** Why the attitude stays off its command in moving air; "" if it does not. */
  readonly offCommand: string;
}

export interface Control {
  readonly id: string;
  readonly label: string;
  readonly unit: string;
  readonly group: string;
  readonly hint: string;
  readonly kind: "number" | "toggle" | "neurons";
  readonly scale: "linear" | "log";
  /** Of the slider. */
  readonly min: number;
  readonly max: number;
  /** Of what may be typed. */
  readonly low: number;
  readonly high: number;
  readonly step: number;
  readonly components: readonly Component[];
}

export interface Component {
  readonly label: string;
  readonly value: number;
  readonly sets: readonly Effect[];
}

/** new = factor * value + offset, or factor / value + offset, instead of the old or added to it; or the start's rotor speeds, with which the value as a mass hovers. */
export interface Effect {
  readonly what: "parameter" | "start" | "duration" | "hover";
  readonly name: string;
  readonly factor: Num;
  readonly power: 1 | -1;
  readonly offset: Num;
  readonly add: boolean;
}

export interface Condition {
  readonly text: string;
  readonly left: Term;
  readonly right: Term;
  readonly orEqual: boolean;
  readonly source: string;
  /** Whether it is no theory's, but says which of two parameters is the smaller. */
  readonly order: boolean;
  readonly unit: string;
}

/** An operation on terms; a comparison is 1 where it holds, else 0, and `where` takes its second term where the first is not 0. */
export type Operation = "+" | "-" | "*" | "/" | "max" | "min" | "negative" | "magnitude" | "sqrt" | "<" | "<=" | ">" | ">=" | "where";

export type Term = Num | { readonly name: string } | { readonly op: Operation; readonly of: readonly Term[] };

export interface Claim {
  readonly name: string;
  readonly sentence: string;
  readonly measured: string;
  readonly verdict: "holds" | "fails" | "undecided";
  readonly flights: readonly string[];
  readonly look: string;
  readonly panels: readonly string[];
}

export interface PanelData {
  readonly id: string;
  readonly title: string;
  readonly unit: string;
  readonly lines: readonly { label: string; column: string; minus: string | null; dashed: boolean }[];
  readonly log: boolean;
  /** Of what a flight may lack, which is zero throughout then. */
  readonly optional: boolean;
}

type Triple<T> = readonly [T, T, T];

export interface SceneData {
  readonly arm: number;
  readonly radius: number;
  readonly rotors: readonly { position: Triple<number>; spin: 1 | -1; force: string | null }[];
  /** Thrust of one rotor at hover [N]. */
  readonly hover: number;
  readonly position: Triple<string>;
  readonly wanted: Triple<string>;
  readonly attitude:
    | { readonly kind: "lagrange"; readonly columns: Triple<string> }
    | { readonly kind: "quaternion"; readonly columns: readonly [string, string, string, string] };
  readonly thrust: string | null;
  readonly arrows: readonly {
    label: string;
    unit: string;
    kind: "force" | "wind";
    columns: Triple<string> | null;
    parameters: Triple<string> | null;
  }[];
  readonly ground: number;
}
