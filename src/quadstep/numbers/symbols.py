"""SymPy expressions as numbers: pass symbols to a law, and the result is the equation that the code actually computes.

Comparing symbols gives a relational, which `where` turns into a `Piecewise`. Loaded only when a value is a SymPy object.
"""

import sympy
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from quadstep.numbers.operation import Kind, Operation, Rule


class Symbols(Kind):
    """The functions of `quadstep.numbers` for SymPy expressions."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        return lambda _, *given: operation.sympy(sympy, *given)

    sqrt = staticmethod(sympy.sqrt)

    def where(self, condition: object, yes: sympy.Expr, no: sympy.Expr) -> sympy.Expr:
        """Decided at once where the condition is known."""
        if isinstance(condition, bool | BooleanTrue | BooleanFalse):
            return yes if condition else no
        return sympy.Piecewise((yes, condition), (no, True), evaluate=False)


SYMBOLS = Symbols()
