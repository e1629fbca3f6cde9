"""Numbers evenly apart."""


def evenly_spaced(low: float, high: float, count: int) -> list[float]:
    """`count` numbers from low to high, both exactly there; only low if it is one."""
    step = (high - low) / max(count - 1, 1)
    numbers = [low + i * step for i in range(count)]
    if count > 1:
        numbers[-1] = high
    return numbers
