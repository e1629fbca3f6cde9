// The amplitude spectrum of a signal: mean taken off, Hann's window, a fast Fourier transform of a power of two.

const MOST = 1 << 16;

/** times: frequencies [Hz], from the first above zero; values: amplitudes. Samples are taken evenly, straight between rows. */
export function spectrum(times: Float64Array, values: Float64Array): { times: Float64Array; values: Float64Array } {
  const size = Math.min(2 ** Math.floor(Math.log2(Math.max(values.length, 2))), MOST);
  const [first, last] = [times[0] ?? 0, times[times.length - 1] ?? 0];
  const step = (last - first) / (size - 1);
  if (!(step > 0) || size < 8) return { times: new Float64Array(), values: new Float64Array() };
  const real = new Float64Array(size);
  for (let i = 0, row = 0; i < size; i++) {
    const t = first + i * step;
    while (row + 2 < times.length && times[row + 1]! <= t) row++;
    const share = (t - times[row]!) / (times[row + 1]! - times[row]! || 1);
    const value = values[row]! + (values[row + 1]! - values[row]!) * Math.min(Math.max(share, 0), 1);
    real[i] = Number.isFinite(value) ? value : 0;
  }
  const mean = real.reduce((sum, value) => sum + value, 0) / size;
  for (let i = 0; i < size; i++) real[i] = (real[i]! - mean) * (0.5 - 0.5 * Math.cos((2 * Math.PI * i) / size));
  const imaginary = new Float64Array(size);
  transform(real, imaginary);
  const half = size / 2;
  const frequencies = Float64Array.from({ length: half - 1 }, (_, k) => (k + 1) / (size * step));
  return { times: frequencies, values: frequencies.map((_, k) => (4 * Math.hypot(real[k + 1]!, imaginary[k + 1]!)) / size) };
}

/** In place; the length a power of two (Cooley and Tukey 1965). */
export function transform(real: Float64Array, imaginary: Float64Array): void {
  const n = real.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [real[i], real[j]] = [real[j]!, real[i]!];
      [imaginary[i], imaginary[j]] = [imaginary[j]!, imaginary[i]!];
    }
  }
  for (let width = 2; width <= n; width *= 2) {
    const half = width / 2;
    for (let k = 0; k < half; k++) {
      const angle = (-2 * Math.PI * k) / width;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      for (let at = k; at < n; at += width) {
        const to = at + half;
        const [a, b] = [real[to]! * c - imaginary[to]! * s, real[to]! * s + imaginary[to]! * c];
        [real[to], imaginary[to]] = [real[at]! - a, imaginary[at]! - b];
        [real[at], imaginary[at]] = [real[at]! + a, imaginary[at]! + b];
      }
    }
  }
}
