"""Python operations that a recorded number cannot support, and what to use instead."""

from typing import NoReturn, Self

CHOOSE = "a law chooses with `where`, `maximum` and `minimum`, never with `if`, `and`, `or`, `max` or `min`"

INSTEAD = (
    "has no value while its law is recorded: take sin, cos, exp, log, sqrt, atan2, absolute, minimum and maximum "
    "from quadstep.numbers, not float(), int(), round(), math or numpy"
)


class PythonOperators:
    """Mixin for the kinds of number from which code is generated."""

    __slots__ = ()

    def __pos__(self) -> Self:
        return self

    def __pow__(self, power: object) -> NoReturn:
        # Python's own power of a float is a library's, in its last bit not always the product.
        raise TypeError("a law cannot use powers: write x * x, sqrt(x), or exp(p * log(x))")

    def __float__(self) -> NoReturn:
        raise TypeError(f"a {type(self).__name__} {INSTEAD}")

    __int__ = __index__ = __round__ = __trunc__ = __floor__ = __ceil__ = __float__

    def __mod__(self, other: object) -> NoReturn:
        raise TypeError("a law cannot use remainders: % and // are discontinuous, and its numbers have no such operation")

    __rmod__ = __floordiv__ = __rfloordiv__ = __divmod__ = __rdivmod__ = __mod__

    # What numpy.sin(x) and the like call on an object that is no array.
    sin = cos = tan = exp = log = sqrt = fabs = tanh = arcsin = arccos = arctan = sinh = cosh = __float__
