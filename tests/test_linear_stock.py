"""The loops of the stock autopilots, flown on both sides of what `linear` says of them."""

import math

import pytest

from quadstep import Mission
from quadstep.control.registry import STOCK
from quadstep.linear.analysis import analyse_rest
from tests.challenge.margins import HOLD, NEUTRAL, scaled

QUICK = "px4-cascade", "crazyflie-pid"
"""In an ordinary run; `make challenge` searches both sides of margins under every one."""


@pytest.mark.parametrize("law", [law if law in QUICK else pytest.param(law, marks=pytest.mark.thorough) for law in STOCK])
def test_a_flown_loop_decays_within_its_gain_margins_and_grows_beyond_them(law):
    """The factors of its modes by differences of flights, with the command of roll scaled on its way to the rotors."""
    found = analyse_rest(Mission(vehicle={"preset": "x500"}, path=HOLD, controller={"type": law}))
    roll = [channel.name for channel in found.analysis.channels].index("roll")
    margins = found.analysis.margins[roll]
    for gain in (margins.gain_up, margins.gain_down):
        assert 0.0 < gain < math.inf
        assert scaled(found.rest, roll, gain**0.95) < NEUTRAL
        assert scaled(found.rest, roll, gain**1.05) > NEUTRAL
