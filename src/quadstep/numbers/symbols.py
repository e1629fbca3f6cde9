"""SymPy expressions as numbers: pass symbols to a law, and the result is the equation that the code actually computes.

Comparing symbols gives a relational, which `where` turns into a `Piecewise`. Loaded only when a value is a SymPy object.
"""

import sympy
from sympy.logic.boolalg import BooleanFalse, BooleanTrue


class Symbols:
    """The functions of `quadstep.numbers` for SymPy expressions."""

    sin = staticmethod(sympy.sin)
    cos = staticmethod(sympy.cos)
    exp = staticmethod(sympy.exp)
    log = staticmethod(sympy.log)
    sqrt = staticmethod(sympy.sqrt)
    atan2 = staticmethod(sympy.atan2)

    def sigmoid(self, x: sympy.Expr) -> sympy.Expr:
        return 1 / (1 + sympy.exp(-x))

    def where(self, condition: object, yes: sympy.Expr, no: sympy.Expr) -> sympy.Expr:
        """Decided at once where the condition is known."""
        if isinstance(condition, bool | BooleanTrue | BooleanFalse):
            return yes if condition else no
        return sympy.Piecewise((yes, condition), (no, True), evaluate=False)


SYMBOLS = Symbols()
