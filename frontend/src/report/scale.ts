// An axis of a figure: from its values to places in the drawing and back, as Matplotlib maps them.

export interface Axis {
  readonly low: number;
  readonly high: number;
  readonly kind: "linear" | "log" | "symlog";
  readonly edge: number; // of a symlog axis: up to where it is linear
}

const LINEAR = 1 / 0.9; // of a symlog axis: length of the linear part, in decades

function forward(axis: Axis, value: number): number {
  if (axis.kind === "log") return Math.log10(value);
  if (axis.kind === "linear") return value;
  const size = Math.abs(value) / axis.edge;
  return Math.sign(value) * (size <= 1 ? size * LINEAR : LINEAR + Math.log10(size));
}

function inverse(axis: Axis, at: number): number {
  if (axis.kind === "log") return 10 ** at;
  if (axis.kind === "linear") return at;
  const size = Math.abs(at);
  return Math.sign(at) * axis.edge * (size <= LINEAR ? size / LINEAR : 10 ** (size - LINEAR));
}

/** Where a value is, 0 at the low end and 1 at the high one. */
export function share(axis: Axis, value: number): number {
  const low = forward(axis, axis.low);
  return (forward(axis, value) - low) / (forward(axis, axis.high) - low);
}

/** The value at such a place. */
export function valueAt(axis: Axis, place: number): number {
  const low = forward(axis, axis.low);
  return inverse(axis, low + place * (forward(axis, axis.high) - low));
}
