"""Our vehicle against RotorPy's: the same rotor speeds commanded, the same effects switched on."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import pytest

from quadstep.bridges.rotorpy import airframe_state, to_quad_params
from quadstep.engines.fly import FlightPlan, fly
from quadstep.engines.loop import runge_kutta_4
from quadstep.interfaces.closed_loop import Task, Ticks
from quadstep.mission.airframe import AirframeSection
from quadstep.numbers import Table, Vector
from quadstep.vehicle.airframe_plant import Events, derivative, mass_properties
from quadstep.vehicle.rigid_body import AirframeState, Effects, Geometry, renormalised
from tests.flights import column
from tests.needs import package

Multirotor = package("rotorpy.vehicles.multirotor").Multirotor

HOLD, STEPS = 0.01, 32
"""How long a command holds [s], and in how many steps ours flies that."""

EXACT = {"method": "RK45", "rtol": 1e-6, "atol": 1e-8}
CALM = (0.0, 0.0, 0.0)
WIND = (3.0, -2.0, 0.5)
PARTS = {"position": slice(3), "attitude": slice(3, 7), "rates": slice(7, 10), "speeds": slice(10, 14)}


# Ours: rotors told what to do, and the vehicle, compiled


class Told(NamedTuple):
    """speeds: a table for each rotor, one entry a command."""

    airframe: Any
    wind: Vector
    speeds: tuple[Table, ...]


class Cycle(NamedTuple):
    state: AirframeState
    wanted: Vector


@dataclass(frozen=True)
class OpenLoop:
    geometry: Geometry
    effects: Effects

    @property
    def columns(self):
        names = ["x", "y", "z", "q_w", "q_x", "q_y", "q_z", "p", "q", "r", "w1", "w2", "w3", "w4"]
        return dict.fromkeys(names, "")

    @property
    def tasks(self):
        return (Task("told", self.tell),)

    def start(self, start, parameters):
        return Cycle(start, start.speeds)

    def tell(self, cycle, parameters, clock):
        return cycle._replace(wanted=Vector(table.at(clock.tick / STEPS) for table in parameters.speeds)), 0.0

    def advance(self, cycle, parameters, clock):
        def rate(state):
            properties = mass_properties(parameters.airframe, Events(), 0.0)
            numbers = (parameters.airframe, properties, column([1] * 4), state, cycle.wanted, parameters.wind)
            return derivative(self.geometry, *numbers, self.effects)

        return cycle._replace(state=renormalised(runge_kutta_4(rate, cycle.state, clock.period)))

    def row(self, cycle, parameters, time):
        state = cycle.state
        return [*state.position, *state.attitude, *state.rates, *state.speeds]


def ours(vehicle, state, wanted, wind):
    """A row after each command."""
    tables = tuple(Table([*speeds, speeds[-1]]) for speeds in wanted.T)
    parameters = Told(vehicle.airframe, column(wind), tables)
    ticks = Ticks(HOLD / STEPS, (STEPS,), STEPS, STEPS * len(wanted))
    return fly(FlightPlan(OpenLoop(vehicle.geometry, vehicle.effects), parameters, airframe_state(state), ticks)).rows[1:]


# Theirs


def theirs(params, state, wanted):
    """The same of RotorPy's vehicle."""
    vehicle = Multirotor(params, control_abstraction="cmd_motor_speeds", integrator_kwargs=EXACT)
    flown = []
    for speeds in wanted:
        state = vehicle.step(state, {"cmd_motor_speeds": speeds}, HOLD)
        flown.append([*state["x"], *np.roll(state["q"], 1), *state["w"], *state["rotor_speeds"]])
    return np.array(flown)


# Both


def hummingbird(**changes):
    """Our preset without what RotorPy has not."""
    return AirframeSection.model_validate({"preset": "hummingbird", "effects": {"gyroscopic": False}, **changes}).build()


def hover_speed(vehicle):
    airframe = vehicle.airframe
    return np.sqrt(airframe.mass * airframe.gravity / (4 * airframe.rotor.thrust))


def commands(vehicle, seconds):
    """Around hover: a sinusoid of its own for each rotor, and steps on one, two and all of them, two beyond the limits."""
    times = HOLD * np.arange(round(seconds / HOLD))[:, None]
    sway = np.sin(2 * np.pi * np.array([0.7, 1.1, 1.7, 2.3]) * times + np.array([0.0, 1.0, 2.0, 3.0]))
    wanted = hover_speed(vehicle) * (1 + 0.03 * sway)
    wanted[20:30, 0] *= 1.1
    wanted[40:44, 3] = 1.1 * vehicle.airframe.rotor.fastest
    wanted[60:70, 1] *= 1.15
    wanted[80:82, 2] = -10.0
    wanted[90:130, ::2] *= 1.2  # yaw
    wanted[150:170] *= 1.15
    wanted[350:360, 1] *= 0.7
    return wanted


def first_state(vehicle, wind):
    """As RotorPy keeps it; q is i, j, k, w."""
    speeds, q = np.full(4, hover_speed(vehicle)), (0.1, -0.2, 0.3, np.sqrt(0.86))
    parts = {"x": (0, 0, 10), "v": (1, -1, 0.5), "q": q, "w": (0.3, -0.2, 0.5), "wind": wind, "rotor_speeds": speeds}
    return {key: np.array(part, dtype=float) for key, part in parts.items()}


def apart(vehicle, params, seconds, wind=CALM):
    """The largest difference in each of `PARTS` (m, rad/s), and our flight."""
    start, wanted = first_state(vehicle, wind), commands(vehicle, seconds)
    mine, other = (one_sided(rows) for rows in (ours(vehicle, start, wanted, wind), theirs(params, start, wanted)))
    gaps = np.abs(mine - other)
    return {name: gaps[:, part].max() for name, part in PARTS.items()}, mine


def one_sided(rows):
    """Of the two quaternions of every attitude the one with w >= 0."""
    rows = rows.copy()
    rows[:, 3:7] *= np.where(rows[:, 3:4] < 0, -1, 1)
    return rows


def test_the_hummingbird_flies_as_rotorpys_to_a_millimetre_over_5_seconds_in_wind():
    vehicle, params = hummingbird(), import_module("rotorpy.vehicles.hummingbird_params").quad_params
    gaps, flown = apart(vehicle, {**params, "rotor_speed_max": 838.0}, 5.0, WIND)
    assert gaps["position"] < 1e-3
    assert max(gaps[name] for name in ("attitude", "rates")) < 1e-5
    assert gaps["speeds"] < 1e-3
    assert np.ptp(flown[:, :3], axis=0).min() > 5.0  # it went far, and rolled, pitched and yawed
    assert np.abs(flown[:, 4:7]).max(axis=0).min() > 0.3
    assert np.abs(flown[:, 7:10]).max(axis=0).min() > 0.5


def assert_alike(vehicle, params, seconds=0.7):
    gaps, _ = apart(vehicle, params, seconds, WIND)
    assert max(gaps["position"], gaps["attitude"], gaps["rates"]) < 1e-5
    assert gaps["speeds"] < 1e-3


@pytest.mark.parametrize("drag", [True, False], ids=["drag", "no drag"])
def test_with_and_without_drag(drag):
    vehicle = hummingbird(effects={"gyroscopic": False, "drag": drag})
    assert_alike(vehicle, to_quad_params(vehicle))


def test_flapping_has_the_opposite_sign_there():
    vehicle = hummingbird(drag={"flapping": 2e-5})
    params = to_quad_params(vehicle)
    assert params["k_flap"] == -2e-5
    assert_alike(vehicle, params)
    assert apart(vehicle, {**params, "k_flap": 2e-5}, 0.7, WIND)[0]["position"] > 0.01


@pytest.mark.parametrize("name", ["crazyflie", "x500", "research-2.6kg", "paper"])
def test_the_other_presets_fly_alike_in_both(name):
    vehicle = AirframeSection.model_validate({"preset": name, "effects": {"gyroscopic": False}}).build()
    assert_alike(vehicle, to_quad_params(vehicle))


def from_theirs(name):
    """A vehicle of RotorPy's as the table [vehicle] of a mission."""
    params = import_module(f"rotorpy.vehicles.{name}_params").quad_params
    spins = ["cw" if direction > 0 else "ccw" for direction in params["rotor_directions"]]
    across = params.get("k_d", 0.0)
    return params, {
        "mass": params["mass"],
        "inertia": [params[key] for key in ("Ixx", "Iyy", "Izz")],
        "rotors": [{"position": list(at), "spin": spin} for at, spin in zip(params["rotor_pos"].values(), spins, strict=True)],
        "rotor": {
            **{"thrust_coefficient": params["k_eta"], "torque_coefficient": params["k_m"], "radius": 0.01},
            **{"rise_time": params["tau_m"], "fall_time": params["tau_m"]},
            **{"slowest": params["rotor_speed_min"], "fastest": params["rotor_speed_max"]},
        },
        "drag": {
            "parasitic": [params.get(key, 0.0) for key in ("c_Dx", "c_Dy", "c_Dz")],
            "rotor": [across, across, params.get("k_z", 0.0)],
            **{"flapping": -params.get("k_flap", 0.0), "translational_lift": params.get("k_h", 0.0)},
        },
        "effects": {"gyroscopic": False},
    }  # fmt: skip


@pytest.mark.parametrize("name", ["crazyfliebrushless", "px4_sihsim_quadx"])
def test_rotorpys_other_vehicles_fly_alike_in_both(name):
    params, vehicle = from_theirs(name)
    assert_alike(AirframeSection.model_validate(vehicle).build(), params)


def test_the_inertia_of_rotorpys_crazyflie_is_that_of_no_rigid_body():
    with pytest.raises(ValueError, match="no rigid body has it"):
        AirframeSection.model_validate(from_theirs("crazyflie")[1])
