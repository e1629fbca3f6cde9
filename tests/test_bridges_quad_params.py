"""Vehicles as RotorPy's parameters."""

import numpy as np
import pytest

from quadstep.bridges.rotorpy import to_quad_params
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.vehicle.allocation import columns

PRESETS = ["crazyflie", "hummingbird", "x500", "research-2.6kg", "paper"]
NO_GYROSCOPE = {"effects": {"gyroscopic": False}}


def vehicle(preset, **changes):
    return AirframeSection.model_validate({"preset": preset, **NO_GYROSCOPE, **changes}).build()


def map_of(params):
    """RotorPy's map from rotor thrusts to thrust and moments, from its documentation: rows u, tau_x, tau_y, tau_z."""
    moments = [np.cross(place, (0, 0, 1)) for place in params["rotor_pos"].values()]
    turns = np.asarray(params["rotor_directions"]) * params["k_m"] / params["k_eta"]
    return np.array([[1.0, x, y, turn] for (x, y, _), turn in zip(moments, turns, strict=True)]).T


@pytest.mark.parametrize("preset", PRESETS)
def test_rotors_turn_the_body_the_same_way(preset):
    there = vehicle(preset)
    params, rotor = to_quad_params(there), there.airframe.rotor
    wanted = np.array([list(column) for column in columns(there.geometry, rotor.torque / rotor.thrust)]).T
    np.testing.assert_allclose(map_of(params), wanted, rtol=1e-12)


def test_without_the_effect_there_is_no_drag():
    params = to_quad_params(vehicle("hummingbird", effects={"gyroscopic": False, "drag": False}))
    assert [params[key] for key in ("c_Dx", "c_Dy", "c_Dz", "k_d", "k_z", "k_h", "k_flap")] == [0.0] * 7


@pytest.mark.parametrize(("changes", "said"), [
    ({"layout": "hexa-x", "arm": 0.2}, "four rotors"),
    ({"rotor": {"fall_time": 0.01}}, "rise_time and fall_time to the same value"),
    ({"gravity": 9.8}, "gravity of 9.81"),
    ({"effects": {"gyroscopic": True}}, "effects.gyroscopic = false"),
    ({"effects": {"gyroscopic": False, "battery": True}}, "effects.battery = false"),
    ({"effects": {"gyroscopic": False, "ground": True}, "ground": 0.0}, "effects.ground = false"),
])  # fmt: skip
def test_what_rotorpy_cannot_describe_is_refused(changes, said):
    with pytest.raises(UserError, match=said):
        to_quad_params(vehicle("hummingbird", **changes))


def test_leaning_rotors_are_refused():
    places = [(0.1, 0.1), (0.1, -0.1), (-0.1, -0.1), (-0.1, 0.1)]
    rotors = [
        {"position": (x, y, 0.0), "axis": (0.0, 0.0998334, 0.9950042), "spin": spin}
        for (x, y), spin in zip(places, ("cw", "ccw") * 2, strict=True)
    ]
    with pytest.raises(UserError, match="along body z"):
        to_quad_params(vehicle("hummingbird", rotors=rotors))


def test_a_rotor_that_does_not_weigh_anything_has_no_gyroscopic_torque_to_leave_out():
    to_quad_params(vehicle("hummingbird", effects={"gyroscopic": True}, rotor={"inertia": 0.0}))
