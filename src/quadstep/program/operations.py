"""The basic operations of recorded numbers, each with its form in every language.

Elementary functions are declared in `numbers/elementary.py`; here is what they, and laws, are made of. Values, derivatives and
enclosures of these operations are Python operators of the kinds of numbers in `numbers/`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from quadstep.numbers.operation import OPERATIONS

if TYPE_CHECKING:
    from llvmlite import ir

    from quadstep.program.instructions import Instructions

Emit: TypeAlias = "Callable[..., ir.Value]"


def built(name: str) -> Emit:
    """One instruction, by its name in llvmlite's builder."""
    return lambda emitter, *values: getattr(emitter.builder, name)(*values)


def called(name: str) -> Emit:
    return lambda emitter, x: emitter.intrinsic(name, x)


def compared(sign: str) -> Emit:
    """A comparison that fails where a number is NaN."""
    return lambda emitter, a, b: emitter.builder.fcmp_ordered(sign, a, b)


def mantissa(emitter: Instructions) -> tuple[int, int]:
    """Bits of the mantissa, and the bias of the exponent."""
    return (52, 1023) if emitter.precise else (23, 127)


def bits_of(emitter: Instructions, x: ir.Value) -> ir.Value:
    return emitter.once(("bits", x), lambda: emitter.builder.bitcast(x, emitter.wholes))


def bit(emitter: Instructions, x: ir.Value, mask: ir.Value) -> ir.Value:
    bits, builder = bits_of(emitter, x), emitter.builder
    alone = emitter.once(("alone", bits, mask), lambda: builder.and_(bits, mask))
    return builder.icmp_signed("!=", alone, emitter.whole_constant(0))


def power(emitter: Instructions, m: ir.Value) -> ir.Value:
    """2^n for m = n + SHIFTER."""
    (size, bias), builder = mantissa(emitter), emitter.builder
    moved = builder.add(bits_of(emitter, m), emitter.whole_constant(bias))
    return builder.bitcast(builder.shl(moved, emitter.whole_constant(size)), emitter.vector)


def fraction(emitter: Instructions, x: ir.Value) -> ir.Value:
    """Of a normal x > 0, in [1/2, 1)."""
    (size, bias), builder = mantissa(emitter), emitter.builder
    below = builder.and_(bits_of(emitter, x), emitter.whole_constant((1 << size) - 1))
    return builder.bitcast(builder.or_(below, emitter.whole_constant(bias - 1 << size)), emitter.vector)


def exponent(emitter: Instructions, x: ir.Value) -> ir.Value:
    """Of a normal x > 0, x = fraction 2^exponent."""
    (size, bias), builder = mantissa(emitter), emitter.builder
    carrier = 2.0**size  # put among its bits, a whole number is added to its value
    bits = int.from_bytes(struct.pack(">d" if emitter.precise else ">f", carrier), "big")
    count = builder.lshr(bits_of(emitter, x), emitter.whole_constant(size))
    carried = builder.bitcast(builder.or_(count, emitter.whole_constant(bits)), emitter.vector)
    return builder.fsub(carried, emitter.constant(carrier + (bias - 1)))


class Forms(NamedTuple):
    """An operation as text around its operands, and as instructions (emitter, *values). coq: empty where no proof needs it.

    Brackets keep each separate in JavaScript and C, so that none combines with its neighbours.
    """

    javascript: str
    c: str
    python: str
    llvm: Emit
    coq: str = ""


FORMS = {
    "+": Forms("({}+{})", "({} + {})", "{} + {}", built("fadd"), coq="({} + {})"),
    "-": Forms("({}-{})", "({} - {})", "{} - {}", built("fsub"), coq="({} - {})"),
    "*": Forms("({}*{})", "({} * {})", "{} * {}", built("fmul"), coq="({} * {})"),
    "/": Forms("({}/{})", "({} / {})", "{} / {}", built("fdiv"), coq="({} / {})"),
    "negative": Forms("(-{})", "(-{})", "-{}", built("fneg"), coq="(- {})"),
    "magnitude": Forms("Math.abs({})", "qs_abs({})", "abs({})", called("fabs"), coq="(Rabs {})"),
    "sqrt": Forms("Math.sqrt({})", "qs_sqrt({})", "sqrt({})", called("sqrt"), coq="(sqrt {})"),
    "<": Forms("({}<{})", "({} < {})", "{} < {}", compared("<"), coq="(Rlt_dec {} {})"),
    "<=": Forms("({}<={})", "({} <= {})", "{} <= {}", compared("<="), coq="(Rle_dec {} {})"),
    ">": Forms("({}>{})", "({} > {})", "{} > {}", compared(">"), coq="(Rgt_dec {} {})"),
    ">=": Forms("({}>={})", "({} >= {})", "{} >= {}", compared(">="), coq="(Rge_dec {} {})"),
    "==": Forms("({}==={})", "qs_equal({}, {})", "{} == {}", compared("==")),
    "!=": Forms("({}!=={})", "(!qs_equal({}, {}))", "{} != {}", lambda to, a, b: to.builder.fcmp_unordered("!=", a, b)),
    "and": Forms("({}&&{})", "({} && {})", "{} and {}", built("and_")),
    "or": Forms("({}||{})", "({} || {})", "{} or {}", built("or_")),
    "not": Forms("(!{})", "(!{})", "not {}", built("not_")),
    "where": Forms("({}?{}:{})", "({} ? {} : {})", "{1} if {0} else {2}", built("select"), coq="(if {} then {} else {})"),
    "bit": Forms("((D[0]={},W[0]&{})!==0)", "((qs_bits({}) & {}) != 0u)", "bit({}, {})", bit),
    "power": Forms("(D[0]={},W[1]=W[0]+1023<<20,W[0]=0,D[0])", "qs_power({})", "power({})", power),
    "fraction": Forms("(D[0]={},W[1]=W[1]&0xFFFFF|0x3FE00000,D[0])", "qs_fraction({})", "fraction({})", fraction),
    "exponent": Forms("(D[0]={},(W[1]>>>20&0x7FF)-1022)", "qs_exponent({})", "exponent({})", exponent),
    "word": Forms("({}|0)", "((uint32_t){})", "word({})", lambda emitter, x: emitter.builder.fptosi(x, emitter.words)),
    "number": Forms("({})", "((real){})", "real({})", lambda emitter, word: emitter.builder.sitofp(word, emitter.vector)),
    "word +": Forms("({}+{}|0)", "({} + {})", "{} + {}", built("add")),
    "word &": Forms("({}&{})", "({} & {})", "{} & {}", built("and_")),
    "word |": Forms("({}|{})", "({} | {})", "{} | {}", built("or_")),
    "word ^": Forms("({}^{})", "({} ^ {})", "{} ^ {}", built("xor")),
    "word <<": Forms("({}<<{})", "({} << {})", "{} << {}", built("shl")),
    "word >>": Forms("({}>>>{}|0)", "({} >> {})", "{} >> {}", built("lshr")),
    "entry": Forms("{}[{}]", "{}[(int32_t){}]", "real({}[int({})])", lambda to, table, index: to.looked_up(table, index)),
}  # fmt: skip
"""In JavaScript, D and W are the bits of one number, see `page/laws.py`."""

CONDITIONS = frozenset(("<", "<=", ">", ">=", "==", "!=", "and", "or", "not", "bit"))
COMMUTATIVE = frozenset("+*")
WORDS = frozenset(("word +", "word &", "word |", "word ^", "word <<", "word >>"))
"""Operations of two words, of which the second may be an integer."""


def in_javascript(operation: str, operands: Sequence[str]) -> str:
    """An operation around its operands; an elementary function is called by its name."""
    if operation in OPERATIONS:
        return f"{operation}({','.join(operands)})"
    return FORMS[operation].javascript.format(*operands)


def in_c(operation: str, operands: Sequence[str]) -> str:
    """An operation around its operands. Raises TypeError for one that C does not have."""
    if operation in OPERATIONS:
        return f"qs_{operation}({', '.join(operands)})"
    if operation not in FORMS:
        raise TypeError(f"the operation {operation!r} cannot be written in C")
    return FORMS[operation].c.format(*operands)


def constant_text(value: float) -> str:
    """A Python float as a JavaScript literal; the same double."""
    if value != value:  # noqa: PLR0124 (NaN)
        return "NaN"
    text = repr(value).replace("inf", "Infinity").removesuffix(".0")
    return f"({text})" if text.startswith("-") else text
