"""Any Python callable as a controller: its inputs, the effect of its answer, and its exceptions."""

import numpy as np
import pytest

from quadstep.control.opaque import Opaque, OpaqueGains, flying, friendly
from quadstep.interfaces.controller import NOT_SAID, Measured
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import from_yaw_pitch_roll
from quadstep.numbers.scan import FUNCTIONS

ATTITUDE = from_yaw_pitch_roll(vector(0.4, -0.2, 0.1))
MEASURED = Measured(vector(1, 2, 3), vector(4, 5, 6), ATTITUDE, vector(7, 8, 9), 10.0, vector(11, 12, 13))
REFERENCE = Reference(vector(14, 15, 16), vector(17, 18, 19), vector(20, 21, 22), 23.0, 24.0)


def test_it_is_told_everything_by_name_and_its_answer_is_the_command():
    told = []

    def controller(t, measured, reference):
        told.append((t, measured, reference))
        return 3.0, (0.1, 0.2, 0.3)

    with flying(controller) as (law, gains):
        command, _ = law.law(law.start(MEASURED, gains), MEASURED, REFERENCE, gains, 1.5, 0.002)
    ((t, measured, reference),) = told
    assert (t, measured.period) == (1.5, 0.002)
    for name in ("position", "velocity", "attitude", "rates"):
        np.testing.assert_array_equal(getattr(measured, name), list(getattr(MEASURED, name)))
    for name in ("position", "velocity", "acceleration"):
        np.testing.assert_array_equal(getattr(reference, name), list(getattr(REFERENCE, name)))
    assert (reference.yaw, reference.yaw_rate) == (23.0, 24.0)
    assert (command.thrust, list(command.torque)) == (3.0, [0.1, 0.2, 0.3])
    assert command.desired_attitude is NOT_SAID


def test_what_it_raises_is_raised_after_the_block_and_it_is_forgotten():
    before = set(FUNCTIONS)

    def controller(t, measured, reference):
        raise RuntimeError("no idea")

    with pytest.raises(RuntimeError, match="no idea"), flying(controller) as (law, gains):
        command, _ = law.law((), MEASURED, REFERENCE, gains, 0.0, 0.002)
        assert np.isnan([command.thrust, *command.torque]).all()
    assert set(FUNCTIONS) == before


def test_an_answer_of_the_wrong_shape_is_an_error():
    with (
        pytest.raises(ValueError, match="should return thrust and torque"),
        flying(lambda t, m, r: (1.0, (2.0, 3.0))) as (law, gains),
    ):
        law.law((), MEASURED, REFERENCE, gains, 0.0, 0.002)


def test_asked_the_very_same_again_it_repeats_itself():
    """Lanes that fill a block repeat a flight: a controller that remembers would count them."""
    count = []
    function = friendly(lambda t, m, r: (count.append(t) or len(count), (0.0, 0.0, 0.0)))
    inputs = np.arange(26.0)
    assert [function(inputs)[0] for _ in range(4)] == [1.0] * 4
    assert function(inputs + 1.0)[0] == 2.0
    assert function(inputs)[0] == 3.0
    assert len(count) == 3


def test_arrays_ask_once_an_element():
    def controller(t, measured, reference):
        return 2.0 * measured.position[0], measured.rates

    batch = MEASURED._replace(position=Vector((np.array([1.0, 2.0, 3.0]), 0.0, 0.0)))
    with flying(controller) as (law, gains):
        command, _ = law.law((), batch, REFERENCE, gains, 0.0, 0.002)
    np.testing.assert_array_equal(command.thrust, [2.0, 4.0, 6.0])


def test_it_is_structure_that_many_callables_share():
    assert hash(Opaque()) == hash(Opaque())
    assert OpaqueGains(3.0).handle == 3.0
