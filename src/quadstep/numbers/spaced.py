"""Evenly spaced numbers."""


def evenly_spaced(low: float, high: float, count: int) -> list[float]:
    """`count` numbers from low to high, both included exactly; only low if count is 1."""
    step = (high - low) / max(count - 1, 1)
    numbers = [low + i * step for i in range(count)]
    if count > 1:
        numbers[-1] = high
    return numbers
