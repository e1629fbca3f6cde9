// The exact interval of a share, as quadstep/metrics/statistics.py has it (Clopper and Pearson 1934).

const TAIL = 0.025;

interface Estimate {
  readonly value: number;
  readonly low: number;
  readonly high: number;
}

/** A share of flights with its interval at 95 %. tail: the chance that it misses the truth on either side. */
export function exactShare(count: number, total: number, tail = TAIL): Estimate {
  const low = count === 0 ? 0 : betaQuantile(tail, count, total - count + 1);
  const high = count === total ? 1 : betaQuantile(1 - tail, count + 1, total - count);
  return { value: count / total, low, high };
}

/** The change of a share between two settings of the same flights, of which `more` fail only with the second, `fewer` only with the first. */
export function shareDifference(more: number, fewer: number, total: number): Estimate {
  const [up, down] = [exactShare(more, total, 0.5 * TAIL), exactShare(fewer, total, 0.5 * TAIL)];
  return { value: up.value - down.value, low: up.low - down.high, high: up.high - down.low };
}

/** x with I_x(a, b) = p, by bisection; a, b: whole. */
function betaQuantile(p: number, a: number, b: number): number {
  let [low, high] = [0, 1];
  while (high - low > 1e-12 * high) {
    const middle = 0.5 * (low + high);
    if (middle === low || middle === high) break;
    if (incompleteBeta(middle, a, b) < p) low = middle;
    else high = middle;
  }
  return 0.5 * (low + high);
}

/** I_x(a, b) of whole a and b: the chance of at least a successes in a + b - 1 trials of chance x. Summed away from the middle, so that no term counts before the first. */
function incompleteBeta(x: number, a: number, b: number): number {
  const n = a + b - 1;
  const above = x * (n + 1) <= a;
  const first = above ? a : a - 1;
  const odds = x / (1 - x);
  let term = Math.exp(logFactorial(n) - logFactorial(first) - logFactorial(n - first) + first * Math.log(x) + (n - first) * Math.log1p(-x));
  let sum = 0;
  for (let k = first; k >= 0 && k <= n && term > 1e-18 * sum; k += above ? 1 : -1) {
    sum += term;
    term *= above ? ((n - k) / (k + 1)) * odds : k / (n - k + 1) / odds;
  }
  return above ? sum : 1 - sum;
}

const factorials = [0];

function logFactorial(n: number): number {
  while (factorials.length <= n) factorials.push(factorials[factorials.length - 1]! + Math.log(factorials.length));
  return factorials[n]!;
}
