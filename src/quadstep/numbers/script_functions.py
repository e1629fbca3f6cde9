"""The functions of script numbers, and how each operation is written in JavaScript."""

from __future__ import annotations

from collections.abc import Iterable

from quadstep.numbers.operation import OPERATIONS, Elementary, Kind, Operation, Rule
from quadstep.numbers.script import Operand, Record, ScriptCondition, ScriptNumber
from quadstep.numbers.script_scan import scan
from quadstep.numbers.script_words import ScriptWord

JAVASCRIPT = {
    "+": "({}+{})",
    "-": "({}-{})",
    "*": "({}*{})",
    "/": "({}/{})",
    "negative": "(-{})",
    "<": "({}<{})",
    "<=": "({}<={})",
    ">": "({}>{})",
    ">=": "({}>={})",
    "==": "({}==={})",
    "!=": "({}!=={})",
    "and": "({}&&{})",
    "or": "({}||{})",
    "not": "(!{})",
    "where": "({}?{}:{})",
    "sqrt": "Math.sqrt({})",
    "magnitude": "Math.abs({})",
    "bit": "((D[0]={},W[0]&{})!==0)",
    "power": "(D[0]={},W[1]=W[0]+1023<<20,W[0]=0,D[0])",
    "fraction": "(D[0]={},W[1]=W[1]&0xFFFFF|0x3FE00000,D[0])",
    "exponent": "(D[0]={},(W[1]>>>20&0x7FF)-1022)",
    "entry": "{}[{}]",
    "word": "({}|0)",
    "number": "({})",
    "word +": "({}+{}|0)",
    "word &": "({}&{})",
    "word |": "({}|{})",
    "word ^": "({}^{})",
    "word <<": "({}<<{})",
    "word >>": "({}>>>{}|0)",
}
"""Every operation but the elementary functions as text around its operands; brackets keep each separate, so that none combines
with its neighbours. D and W are the bits of one number, see `page/elementary.py`.
"""


def in_javascript(operation: str, operands: Iterable[str]) -> str:
    """An operation around its operands; an elementary function is called by its name."""
    if operation in OPERATIONS:
        return f"{operation}({','.join(operands)})"
    return JAVASCRIPT[operation].format(*operands)


class ScriptFunctions(Kind):
    """The functions of `quadstep.numbers` for script numbers."""

    @staticmethod
    def rule(operation: Operation) -> Rule:
        """A call, of what back ends write from its steps."""

        def called(_: ScriptFunctions, *given: Operand) -> ScriptNumber:
            return written(next(one.record for one in given if isinstance(one, ScriptNumber)), operation.name, *given)

        return called

    def sqrt(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "sqrt", x)

    def where(self, condition: ScriptCondition | bool, yes: Operand, no: Operand) -> Operand:
        if not isinstance(condition, ScriptCondition):
            return yes if condition else no
        record = condition.record
        a, b = record.at(yes), record.at(no)
        return yes if a == b else ScriptNumber(record, record.place("where", condition.place, a, b))

    scan: staticmethod[..., tuple[object, object]] = staticmethod(scan)

    def word(self, x: ScriptNumber) -> ScriptWord:
        return ScriptWord.of(x)

    def number(self, word: ScriptWord) -> ScriptNumber:
        return word.number()


class ScriptSteps(Elementary):
    """sin and its like written out, operation by operation."""

    where = ScriptFunctions.where

    def precise(self, x: ScriptNumber | float) -> bool:
        return True

    def bit(self, x: ScriptNumber, place: int) -> ScriptCondition:
        return ScriptCondition(x.record, written(x.record, "bit", x, 1 << place).place)

    def power(self, m: ScriptNumber) -> ScriptNumber:
        return written(m.record, "power", m)

    def fraction(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "fraction", x)

    def exponent(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "exponent", x)


def written(record: Record, operation: str, *operands: Operand) -> ScriptNumber:
    """A recorded operation on numbers, some of which may be Python numbers."""
    return ScriptNumber(record, record.place(operation, *(record.at(operand) for operand in operands)))


ScriptNumber.functions = ScriptFunctions()
