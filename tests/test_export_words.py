"""The comments of an exported header: unit and meaning of every member."""

import re
from typing import NamedTuple

import pytest

from quadstep.control.registry import names
from quadstep.export.c.comments import UNKNOWN, of_structure
from quadstep.export.c.compiled import exported
from quadstep.export.c.header import header
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import gain
from quadstep.vehicle.paper import State
from quadstep.vehicle.planar import PlanarState
from tests.exports import paper_mission, plane_mission, real_mission
from tests.needs import POLICY, needs

BUILT = [
    pytest.param(mission, kind, id=f"{where} {kind}", marks=needs(POLICY) if kind == "raptor" else ())
    for where, mission, measures in (
        ("real", real_mission, Measured),
        ("paper", paper_mission, State),
        ("plane", plane_mission, PlanarState),
    )
    for kind in names(measures)
]


@pytest.mark.parametrize(("mission", "kind"), BUILT)
def test_every_member_of_a_header_has_a_comment(mission, kind):
    text = header(exported(mission({"type": kind}).plan(), False))
    lines = [line for line in text.splitlines() if re.match(r" +(} )?(\w+ )?\w+(\[\d+\])*;", line)]
    assert len(lines) > 20
    assert [line for line in lines if not re.search(r"; /\* .+ \*/$", line) or UNKNOWN in line] == []


def test_a_comment_is_what_a_docstring_says_of_a_field():
    class Filtered(NamedTuple):
        """value [rad]: filtered, see Eq. 27. rate [rad/s], jerk [rad/s^3]: its rates; of the last axis, turned about body x.

        >>> body: none
        """

        value: float
        rate: float
        jerk: float
        body: float = gain(1.0, "kg", "mass of it")
        axis: float = 0.0

    class Plain(NamedTuple):
        inner: Filtered
        plain: float = 0.0

    words = of_structure(Plain(Filtered(0.0, 0.0, 0.0)), {"axis": "-, along it"})
    assert words("inner.value") == "rad, filtered, see Eq. 27"
    told = "rate [rad/s], jerk [rad/s^3]: its rates; of the last axis, turned about body x"
    assert words("inner.rate") == words("inner.jerk") == told
    assert words("inner.body") == "kg, mass of it"
    assert words("inner.axis") == "-, along it"
    assert words("inner") == "value [rad]: filtered, see Eq. 27"
    assert words("plain") == UNKNOWN
