// Numbers as people write them.

export function minus(value: number): string {
  return String(value).replace("-", "−");
}

/** With so many decimals. */
export function fixed(value: number, decimals: number): string {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? (0).toFixed(decimals) : text.replace("-", "−");
}
