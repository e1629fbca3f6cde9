// Numbers for people: as many digits as tell something, SI prefixes, a true minus sign.

const PREFIXES: readonly [number, string][] = [
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
];
const PREFIXED = new Set(["m", "m/s", "N", "N m", "J", "s"]);

/** A factor and a unit: a number times the factor is in that unit. */
export interface Scale {
  readonly factor: number;
  readonly unit: string;
}

/** The scale in which numbers of this size read well. Angles become degrees, other units get a prefix. */
export function scaleFor(unit: string, size: number): Scale {
  if (unit === "rad" || unit === "rad/s") return angleScale(unit, size);
  if (!plainUnit(unit)) return { factor: 1, unit: "" };
  if (!PREFIXED.has(unit) || !(size > 0) || !Number.isFinite(size)) return { factor: 1, unit };
  if (size >= 0.1 && size < 1e4) return { factor: 1, unit };
  const found = PREFIXES.find(([value]) => size >= value) ?? PREFIXES[PREFIXES.length - 1]!;
  return { factor: 1 / found[0], unit: found[1] + unit };
}

/** A unit as shown: none for pure numbers. */
export function plainUnit(unit: string): string {
  return unit === "-" || unit === "1" ? "" : unit;
}

/** Degrees for angles one can see, fractions of a radian for those one cannot. */
function angleScale(unit: string, size: number): Scale {
  if (size > 1e-3 || !(size > 0)) return { factor: 180 / Math.PI, unit: unit.replace("rad", "°") };
  return size > 1e-4 ? { factor: 1e3, unit: `m${unit}` } : { factor: 1e6, unit: `µ${unit}` };
}

/** A number with as many decimals as suit numbers of this size, so that its width stays while it changes. */
export function steady(x: number, size: number): string {
  if (!Number.isFinite(x) || !(size > 0) || size >= 1e6 || size < 1e-4) return number(x, 3);
  const decimals = Math.min(Math.max(2 - Math.floor(Math.log10(size)), size < 1000 ? 2 : 0), 6);
  return minus((Math.abs(x) < 0.5 * 10 ** -decimals ? 0 : x).toFixed(decimals));
}

/** A number with about `digits` significant digits. */
export function number(x: number, digits = 4): string {
  if (Number.isNaN(x)) return "–";
  if (!Number.isFinite(x)) return x > 0 ? "∞" : "−∞";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e6 || size < 1e-4) return scientific(x, Math.max(digits - 2, 1));
  const decimals = Math.min(Math.max(digits - 1 - Math.floor(Math.log10(size)), 0), 8);
  return minus(x.toFixed(decimals));
}

/** A number without trailing zeros, with four significant digits, or whole where it has more: for the value of a control. */
export function plain(x: number): string {
  if (!Number.isFinite(x)) return number(x);
  return minus(String(Math.abs(x) >= 1e4 ? Math.round(x) : Number(x.toPrecision(4))));
}

/** As Python's format "g" writes it, for numbers of a size that people say. */
export function short(x: number, digits: number): string {
  return number(Number(x.toPrecision(digits)), 15).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}

/** A quantity with its unit, in the scale that suits it; lengths as src/quadstep/report/units.py, handy, has them: in mm below a metre. */
export function quantity(x: number, unit: string, digits = 3): string {
  const size = Math.abs(x);
  const scale = unit === "m" && size < 1 && size >= 1e-3 ? { factor: 1e3, unit: "mm" } : scaleFor(unit, size);
  return join(number(x * scale.factor, digits), scale.unit);
}

/** A number and its unit, with a space where one belongs. */
export function join(text: string, unit: string): string {
  if (!unit) return text;
  return unit.startsWith("°") && !text.includes("×") ? text + unit : `${text}\u00a0${unit}`; // else it looks like a digit of the power
}

/** A time on the clock, in hundredths. */
export function seconds(t: number): string {
  return t.toFixed(2);
}

const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** 10 to the power e, as text. */
export function powerOfTen(e: number): string {
  const digits = [...String(Math.abs(e))].map((digit) => RAISED[Number(digit)]).join("");
  return `10${e < 0 ? "⁻" : ""}${digits}`;
}

/** A number as a factor, with this many decimals, and a power of ten: 4.2×10⁻⁵, and 10⁻⁵ where the factor is a plain 1. */
export function scientific(x: number, decimals: number): string {
  const [factor, e] = x.toExponential(decimals).split("e") as [string, string];
  return timesPower(factor, Number(e));
}

/** The same from its parts. */
export function timesPower(factor: string, e: number): string {
  return minus(/^-?1$/.test(factor) ? factor.slice(0, -1) : `${factor}×`) + powerOfTen(e);
}

function minus(text: string): string {
  return text.replace(/-/g, "−");
}
