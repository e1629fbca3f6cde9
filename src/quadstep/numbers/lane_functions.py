"""The functions of lanes, straight-line and without calls."""

import struct

from llvmlite import ir

from quadstep.numbers.lane import Condition, Emitter, Lane, Operand
from quadstep.numbers.lane_calls import call
from quadstep.numbers.lane_scan import scan
from quadstep.numbers.lane_words import LaneWord
from quadstep.numbers.operation import Elementary


class LaneFunctions(Elementary):
    """The functions of `quadstep.numbers` for lanes."""

    def precise(self, x: Lane) -> bool:
        return x.emitter.double

    def bit(self, x: Lane, place: int) -> Condition:
        emitter, builder = x.emitter, x.emitter.builder
        bits, mask, zero = bits_of(x), emitter.whole_constant(1 << place), emitter.whole_constant(0)
        alone = emitter.once(("and", bits, mask), lambda: builder.and_(bits, mask))
        return Condition(emitter, emitter.once(("bit", alone), lambda: builder.icmp_signed("!=", alone, zero)))

    def power(self, m: Lane) -> Lane:
        emitter, builder = m.emitter, m.emitter.builder
        size, bias = mantissa(emitter)

        def shifted() -> ir.Value:
            moved = builder.add(bits_of(m), emitter.whole_constant(bias))
            return builder.bitcast(builder.shl(moved, emitter.whole_constant(size)), emitter.vector)

        return Lane(emitter, emitter.once(("power", m.value), shifted))

    def fraction(self, x: Lane) -> Lane:
        emitter, builder = x.emitter, x.emitter.builder
        size, bias = mantissa(emitter)

        def below() -> ir.Value:
            kept = builder.and_(bits_of(x), emitter.whole_constant((1 << size) - 1))
            return builder.bitcast(builder.or_(kept, emitter.whole_constant(bias - 1 << size)), emitter.vector)

        return Lane(emitter, emitter.once(("fraction", x.value), below))

    def exponent(self, x: Lane) -> Operand:
        emitter, builder = x.emitter, x.emitter.builder
        size, bias = mantissa(emitter)
        carrier = 2.0**size  # put among its bits, a whole number is added to its value

        def carried() -> ir.Value:
            count = builder.lshr(bits_of(x), emitter.whole_constant(size))
            return builder.bitcast(builder.or_(count, emitter.whole_constant(whole(emitter, carrier))), emitter.vector)

        return Lane(emitter, emitter.once(("exponent", x.value), carried)) - (carrier + (bias - 1))

    def sqrt(self, x: Lane) -> Lane:
        return Lane(x.emitter, x.emitter.intrinsic("sqrt", x.value))

    def where(self, condition: Condition | bool, yes: Operand, no: Operand) -> Operand:
        if not isinstance(condition, Condition):
            return yes if condition else no
        if yes is no:
            return yes
        emitter = condition.emitter
        a, b = emitter.value(yes), emitter.value(no)
        choose = emitter.builder.select
        return Lane(emitter, emitter.once(("select", condition.value, a, b), lambda: choose(condition.value, a, b)))

    call = staticmethod(call)
    scan: "staticmethod[..., tuple[object, object]]" = staticmethod(scan)

    def word(self, x: Lane) -> LaneWord:
        return LaneWord.of(x)

    def number(self, word: LaneWord) -> Lane:
        return word.number()


def mantissa(emitter: Emitter) -> tuple[int, int]:
    """Bits of the mantissa, and the bias of the exponent."""
    return (52, 1023) if emitter.double else (23, 127)


def whole(emitter: Emitter, value: float) -> int:
    """The bits of a number of the lanes' kind."""
    return int.from_bytes(struct.pack(">d" if emitter.double else ">f", value), "big")


def bits_of(x: Lane) -> ir.Value:
    """The same bits as a whole number."""
    emitter = x.emitter
    return emitter.once(("bits", x.value), lambda: emitter.builder.bitcast(x.value, emitter.wholes))


Lane.functions = LaneFunctions()
