"""The published policy: its golden outputs, its conventions by symmetry, its place among a vehicle's rotors."""

import re
import sys
from importlib.resources import as_file, files

import numpy as np
import pytest

from quadstep import UserError, fly
from quadstep.control.mixers import quarters
from quadstep.control.raptor import Raptor, act, published
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import from_yaw_pitch_roll, multiply
from tests.needs import POLICY, needs, package

h5py = package("h5py")
pytestmark = needs(POLICY)

ZERO = vector(0.0, 0.0, 0.0)
REFERENCE = Reference(vector(1.0, 2.0, 3.0), vector(0.1, -0.2, 0.3), ZERO, 0.0, 0.0)
MEASURED = Measured(
    vector(1.3, 1.8, 3.1),
    vector(0.5, 0.4, -0.1),
    from_yaw_pitch_roll(vector(0.1, 0.2, -0.3)),
    vector(0.6, -0.7, 0.8),
    26.0,
    ZERO,
)


def plan(vehicle="x500", **content):
    path = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 2.0], "duration": 2.0}
    mission = {"vehicle": {"preset": vehicle}, "path": path, "controller": {"type": "raptor"}, **content}
    return MultirotorMission.model_validate(mission).plan()


def test_the_policy_gives_the_golden_outputs_of_its_package():
    with as_file(files("foundation_policy").joinpath("blob", "checkpoint.h5")) as path, h5py.File(path) as file:
        inputs, outputs = (file["example"][name][()].astype(float) for name in ("input", "output"))
    neurons = published().begin
    for seen, wanted in zip(inputs[:60], outputs[:60], strict=True):
        action, neurons = act(published(), Vector(seen.T.copy()), neurons)
        np.testing.assert_allclose(np.array(list(action)).T, wanted, atol=1e-6)


def test_it_is_shown_errors_attitude_and_rates_in_its_order():
    law, gains = Raptor(), plan().parameters.gains
    seen = list(law.observation(MEASURED, REFERENCE, gains))
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_euler("ZYX", [0.1, 0.2, -0.3]).as_matrix()
    np.testing.assert_allclose(seen, [0.3, -0.2, 0.1, *rotation.ravel(), 0.4, 0.6, -0.4, 0.6, -0.7, 0.8], atol=1e-12)
    far = MEASURED._replace(position=vector(9.0, -9.0, 3.0))
    assert list(law.observation(far, REFERENCE, gains))[:3] == [1.0, -1.0, 0.0]


def test_a_world_turned_about_the_vertical_looks_the_same():
    law, gains = Raptor(), plan().parameters.gains
    c, s = np.cos(0.7), np.sin(0.7)

    def turned(v):
        return vector(c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])

    reference = REFERENCE._replace(position=turned(REFERENCE.position), velocity=turned(REFERENCE.velocity), yaw=0.7)
    measured = MEASURED._replace(
        position=turned(MEASURED.position),
        velocity=turned(MEASURED.velocity),
        attitude=multiply(from_yaw_pitch_roll(vector(0.7, 0.0, 0.0)), MEASURED.attitude),
    )
    there, here = (list(law.observation(*one, gains)) for one in ((measured, reference), (MEASURED, REFERENCE)))
    np.testing.assert_allclose(there, here, atol=1e-12)
    turning = list(law.observation(MEASURED, REFERENCE._replace(yaw_rate=0.5), gains))
    assert turning[-1] == pytest.approx(0.3)


def test_a_vehicle_that_spins_the_other_way_round_is_flown_in_a_mirror():
    """Left for right: the same motors are asked for the same, those of the other side."""
    gains = plan().parameters.gains
    side = np.array([1.0, -1.0, 1.0])
    yaw, pitch, roll = 0.1, 0.2, -0.3

    def mirrored(v):
        return vector(*(side * list(v)))

    reference = REFERENCE._replace(position=mirrored(REFERENCE.position), velocity=mirrored(REFERENCE.velocity))
    measured = MEASURED._replace(
        position=mirrored(MEASURED.position),
        velocity=mirrored(MEASURED.velocity),
        attitude=from_yaw_pitch_roll(vector(-yaw, pitch, -roll)),
        rates=-1.0 * mirrored(MEASURED.rates),
    )
    model = load_preset("x500").model()
    usual, other = (
        Raptor.for_vehicle(model),
        Raptor.for_vehicle(model._replace(mixing=(*model.mixing[:3], -1.0 * model.mixing[3]))),
    )
    assert (usual.mirrored, other.mirrored) == (False, True)
    seen, in_mirror = usual.observation(MEASURED, REFERENCE, gains), other.observation(measured, reference, gains)
    np.testing.assert_allclose(list(in_mirror), list(seen), atol=1e-12)
    here, _ = usual.law(usual.start(MEASURED, gains), MEASURED, REFERENCE, gains, 0.0, 0.01)
    there, _ = other.law(other.start(measured, gains), measured, reference, gains, 0.0, 0.01)
    right_left = {usual.rotors[i]: usual.rotors[3 - i] for i in range(4)}
    np.testing.assert_allclose([there.speeds[right_left[i]] for i in range(4)], list(here.speeds), rtol=1e-12)


@pytest.mark.parametrize("vehicle", ["research-2.6kg", "crazyflie", "x500", "hummingbird"])
def test_its_motors_are_those_of_the_vehicles_quarters(vehicle):
    model = load_preset(vehicle).model()
    rotors, mirrored = quarters(model, "raptor")
    _, about_x, about_y, about_z = model.mixing
    assert [(about_y[i] < 0.0, about_x[i] > 0.0) for i in rotors] == [
        (True, False),
        (False, False),
        (False, True),
        (True, True),
    ]
    assert not mirrored
    assert about_z[rotors[0]] < 0.0  # the front right one turns counter-clockwise


def test_an_action_stands_for_a_share_of_the_rotors_range():
    law, gains = Raptor((2, 0, 3, 1)), plan().parameters.gains
    command, memory = law.law(law.start(MEASURED, gains), MEASURED, REFERENCE, gains, 0.0, 0.01)
    assert all(-1.0 <= one <= 1.0 for one in memory.action)
    for motor, rotor in enumerate((2, 0, 3, 1)):
        share = (command.speeds[rotor] - gains.slowest) / (gains.fastest - gains.slowest)
        assert 2.0 * share - 1.0 == pytest.approx(memory.action[motor])
    seen = Vector((*law.observation(MEASURED, REFERENCE, gains), *memory.action))
    action, neurons = act(gains.policy, seen, memory.neurons)
    _, after = law.law(memory, MEASURED, REFERENCE, gains, 0.01, 0.01)
    assert list(after.action) == [min(max(one, -1.0), 1.0) for one in action]
    assert list(after.neurons) == list(neurons) != list(memory.neurons)


def test_it_hovers_and_does_so_alike_on_floats_and_lanes():
    one = plan("crazyflie", simulation={"duration": 2.0}, start={"position": [0.2, -0.1, 2.0]})
    lanes = fly(one)
    assert lanes.outcome is Outcome.COMPLETED
    assert lanes.metrics()["position_rmse[m]"] < 0.2
    assert abs(lanes.column("x")[-1]) < 0.1
    short = plan("crazyflie", simulation={"duration": 0.1})
    np.testing.assert_array_equal(fly(short).rows, fly(short, engine="python").rows)


def test_a_vehicle_that_it_cannot_fly_is_one_line():
    with pytest.raises(UserError, match="flies four rotors, one in each quarter"):
        plan("paper")


def test_without_its_package_it_is_one_line(monkeypatch):
    published.cache_clear()
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UserError, match=re.escape('controller.type = "raptor" needs h5py; install it:')) as caught:
        plan()
    assert "\n" not in str(caught.value)
