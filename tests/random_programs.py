"""Random laws: short programs over numbers, smooth or not, for any kind of number."""

from collections.abc import Callable, Sequence

import numpy as np

from quadstep.numbers import Number, Vector, absolute, atan2, cos, exp, maximum, minimum, sigmoid, sin, sqrt, where

Program = Callable[[Sequence[Number]], Number]

SMOOTH = {
    "sum": lambda a, b, c: a + c * b,
    "difference": lambda a, b, c: c * a - b,
    "product": lambda a, b, c: a * b,
    "square": lambda a, b, c: a * a,
    "share": lambda a, b, c: a / (1.5 + sin(b)),
    "sine": lambda a, b, c: sin(a) + c * b,
    "cosine": lambda a, b, c: cos(a) - 1.0 + b * b,
    "exponential": lambda a, b, c: exp(0.5 * sin(a)) - 1.0,
    "sigmoid": lambda a, b, c: sigmoid(a) - 0.5,
    "angle": lambda a, b, c: atan2(a, 2.0 + cos(b)),
}
BENT = {
    "size": lambda a, b, c: absolute(a),
    "norm": lambda a, b, c: Vector([a, b]).norm(),
    "larger": lambda a, b, c: maximum(a, c * b),
    "smaller": lambda a, b, c: minimum(a, c * b),
    "limited": lambda a, b, c: minimum(maximum(a, -0.1), 0.1),
    "dead zone": lambda a, b, c: where(absolute(a) < 0.05, 0.0, a),
    "either": lambda a, b, c: where(a > b, a * a, b),
}
ROOTED = {
    "root": lambda a, b, c: sqrt(absolute(a)),
    "root of a norm": lambda a, b, c: Vector([sqrt(sqrt(a * a))]).norm(),
    "signed root": lambda a, b, c: where(a > 0.0, sqrt(absolute(a)), -sqrt(absolute(a))),
    "root of a square or not": lambda a, b, c: sqrt(where(b > 0.0, a * a, absolute(a))),
    "root of a fourth power": lambda a, b, c: sqrt((a * a) * (b * b)),
}
JUMPS = {"sign": lambda a, b, c: where(a > 0.0, 0.1, -0.1) + b}


def program(
    random: np.random.Generator, inputs: int, length: int, *kinds: dict[str, Callable[..., Number]]
) -> tuple[Program, str]:
    """A program of these kinds of steps, each from earlier results, and its text."""
    known = {name: one for kind in kinds for name, one in kind.items()}
    names = [str(random.choice(list(known))) for _ in range(length)]
    sources = [random.integers(0, inputs + step, 2) for step in range(length)]
    sources = [
        (int(a), inputs + step - 1 if step and random.random() < 0.5 else int(b)) for step, (a, b) in enumerate(sources)
    ]
    factors = [float(np.round(random.uniform(-2.0, 2.0), 2)) or 1.0 for _ in range(length)]

    def run(x: Sequence[Number]) -> Number:
        done = list(x)
        for name, (a, b), factor in zip(names, sources, factors, strict=True):
            done.append(known[name](done[a], done[b], factor))
        return done[-1]

    return run, "; ".join(f"{name} of {a}, {b} ({c})" for name, (a, b), c in zip(names, sources, factors, strict=True))
