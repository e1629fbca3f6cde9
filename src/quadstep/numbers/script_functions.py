"""The functions of script numbers, and how each operation is written in JavaScript."""

from typing import Any

from quadstep.numbers.script import Record, ScriptCondition, ScriptNumber
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
    "sin": "Math.sin({})",
    "cos": "Math.cos({})",
    "exp": "Math.exp({})",
    "log": "Math.log({})",
    "sqrt": "Math.sqrt({})",
    "atan2": "Math.atan2({}+0,{}+0)",  # -0 counts as 0, as everywhere
    "entry": "{}[{}|0]",
    "word": "({}|0)",
    "word +": "({}+{}|0)",
    "word &": "({}&{})",
    "word |": "({}|{})",
    "word ^": "({}^{})",
    "word <<": "({}<<{})",
    "word >>": "({}>>>{}|0)",
}
"""Every operation as text around its operands; brackets keep each a whole, so that none can be read with its neighbours."""


class ScriptFunctions:
    """The functions of `quadstep.numbers` for script numbers."""

    def sin(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "sin", x)

    def cos(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "cos", x)

    def exp(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "exp", x)

    def log(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "log", x)

    def sqrt(self, x: ScriptNumber) -> ScriptNumber:
        return written(x.record, "sqrt", x)

    def atan2(self, y: Any, x: Any) -> ScriptNumber:
        return written(y.record if isinstance(y, ScriptNumber) else x.record, "atan2", y, x)

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        if not isinstance(condition, ScriptCondition):
            return yes if condition else no
        record = condition.record
        a, b = record.at(yes), record.at(no)
        return yes if a == b else ScriptNumber(record, record.place("where", condition.place, a, b))

    def word(self, x: ScriptNumber) -> ScriptWord:
        return ScriptWord.of(x)

    def number(self, word: ScriptWord) -> ScriptNumber:
        return word.number()


def written(record: Record, operation: str, *operands: Any) -> ScriptNumber:
    """A recorded operation on numbers, some of which may be Python's."""
    return ScriptNumber(record, record.place(operation, *(record.at(operand) for operand in operands)))


ScriptNumber.functions = ScriptFunctions()
