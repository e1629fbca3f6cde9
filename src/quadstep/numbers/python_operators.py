"""What Python itself asks of a number that is only written down: abs() and squares work, the rest says what to use instead."""

from typing import Any

from quadstep.numbers.functions import absolute

CHOOSE = "a law chooses with `where`, `maximum` and `minimum`, never with `if`, `and`, `or`, `max` or `min`"

INSTEAD = (
    "has no value while its law is written down: take sin, cos, exp, log, sqrt, atan2, absolute, minimum and maximum "
    "from quadstep.numbers, not float(), int(), round(), math or numpy"
)


class PythonOperators:
    """Mixed into the kinds of number of which code is made."""

    __slots__ = ()

    def __abs__(self) -> Any:
        return absolute(self)  # type: ignore[arg-type]

    def __pos__(self) -> Any:
        return self

    def __pow__(self, power: Any) -> Any:
        if isinstance(power, float | int) and power in (1, 2):
            number: Any = self
            return number if power == 1 else number * number
        raise TypeError(f"a law takes the power 2 only, not {power!r:.40}: write products, sqrt(x), or exp(p * log(x))")

    def __float__(self) -> float:
        raise TypeError(f"a {type(self).__name__} {INSTEAD}")

    __int__ = __index__ = __round__ = __trunc__ = __floor__ = __ceil__ = __float__
