"""Logged setpoints flown by a simulated vehicle under a controller, compared with the real flight."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan, fly_all
from quadstep.identify.averages import blocks, rotor_speeds
from quadstep.identify.logs.flight import FlightRecord, Floats, stretches
from quadstep.identify.parameters import numbers_of
from quadstep.identify.starts import setpoint_of
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.fields import plain
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Table, Vector
from quadstep.vehicle.rigid_body import AirframeState
from quadstep.world.paths import SetpointParameters, Setpoints

SETTLING = 1.0
"""Time at the start that is not compared [s]."""

LONGEST_LAG = 1.2
INTEGRAL = 4.0 / 3.0
"""I gain of the body rates over their P gain [1/s]: PX4's defaults (0.2 over 0.15); ArduPilot's are 1, the Crazyflie's 2."""
PARTS = 3
"""Of a flight, of each of which the thrust is judged: a battery that sags shows."""
NEAR, QUICKER = 2.0, 1.5
"""Ratio of the RMS error, and of the mean rate, beyond which, or below its inverse, simulated flights are unlike real ones."""
WRONG = 0.05
"""Share of the thrust needed from which on that modelled is called wrong."""


class Tracking(NamedTuple):
    """How a flight follows its setpoints. rmse [m]: of the position. lag [s]: of the position behind the
    setpoint. tilt [rad]: the 99 % quantile. rate [rad/s]: mean magnitude.
    """

    rmse: float
    lag: float
    tilt: float
    rate: float


class FlightComparison(NamedTuple):
    """A real flight and the simulated one. time [s], setpoint, real, flown (n, 3) [m]."""

    name: str
    real: Tracking
    simulated: Tracking
    time: Floats
    setpoint: Floats
    real_position: Floats
    flown_position: Floats
    lost: str

    @property
    def apart(self) -> float:
        """How far the simulated position is from the real one, once it has settled, RMS [m]."""
        away = (self.flown_position - self.real_position)[self.time >= SETTLING]
        return float(np.sqrt((away**2).sum(axis=1).mean())) if len(away) else math.nan


def stretch(flight: FlightRecord) -> slice:
    """The longest part of a flight in the air with setpoints and without a gap. Raises UserError if it is too short."""
    given = (setpoint_of(flight)[:, 3] > 0.5) & flight.flying & flight.measured
    given[1:] &= flight.follows[1:] | ~given[:-1]
    first, past = max(stretches(given), key=lambda one: one[1] - one[0], default=(0, 0))
    if (past - first) * flight.period < 4.0:
        raise UserError(f"{flight.name}: less than four seconds of uninterrupted flight with setpoints; nothing to simulate")
    return slice(first, past)


def tracking(position: Floats, attitude: Floats, rates: Floats, setpoint: Floats, period: float) -> Tracking:
    """The quantities compared of a flight, after it has settled."""
    first, most = round(SETTLING / period), round(LONGEST_LAG / period)
    errors = [
        np.sqrt(((setpoint[: len(setpoint) - late] - position[late:]) ** 2).sum(axis=1)[first:].mean())
        for late in range(min(most, len(position) - first - 2))
    ]
    up = 1.0 - 2.0 * (attitude[first:, 1] ** 2 + attitude[first:, 2] ** 2)
    return Tracking(
        rmse=float(errors[0]),
        lag=int(np.argmin(errors)) * period,
        tilt=float(np.percentile(np.arccos(np.clip(up, -1.0, 1.0)), 99)),
        rate=float(np.linalg.norm(rates[first:], axis=1).mean()),
    )


def as_flown(vehicle: AirframeSection) -> dict[str, object]:
    """Gains of the cascaded PID for flying like the real vehicle.

    The rate loop is as fast as the rotors allow; its integral takes over the torques of flapping and of the centre of gravity.
    The others and their limits are identified from the flights (`guided_prediction`): there the acceleration for the setpoint
    acts after rotors and attitude, here before them, so the position loop makes up for it.
    """
    late = vehicle.rotor.rise_time + (vehicle.command.delay if vehicle.command else 0.0)
    rate = 1.5 / late
    gains: dict[str, object] = {
        "rate": [rate, rate, 0.4 * rate],
        "rate_derivative": [0.5 * rate * vehicle.rotor.rise_time] * 2 + [0.0],
        "rate_filter": 200.0,
        "rate_integral": [INTEGRAL * rate, INTEGRAL * rate, INTEGRAL * 0.4 * rate],
        "attitude": [0.3 * rate, 0.3 * rate, 0.15 * rate],
    }
    seen = vehicle.guided_prediction
    if seen is not None and seen.path > 0.0 and seen.drift > 0.0:
        if seen.spring > 0.0 and seen.leak[0] > 0.0:
            attitude = min(seen.spring / seen.leak[0], 0.3 * rate)
            gains["attitude"] = [attitude, attitude, 0.15 * rate]
        answer = seen.drift / seen.path
        gains["position"] = 1.0 / max(answer - 2.0 * late, 0.25 * answer)
        gains["axis_speed"] = seen.reach / seen.drift
        gains["most_tilt"] = math.atan(seen.steepest)
        gains["velocity"] = seen.drift
        gains["velocity_integral"] = [0.05 * seen.drift, 0.05 * seen.drift, 0.5 * seen.drift]
    return gains


def planned(flight: FlightRecord, vehicle: AirframeSection, controller: dict[str, object]) -> tuple[FlightPlan, slice]:
    """The flight's setpoints as a plan, from the measured state on. Raises UserError."""
    part = stretch(flight)
    count = part.stop - part.start
    duration = (count - 1) * flight.period
    goal = flight.channel("setpoint")[part]
    yaw = np.nan_to_num(flight.channel("setpoint_yaw")[part, 0])
    content = vehicle.model_dump(exclude_none=True, exclude={"preset", "file"})
    content.pop("layout" if vehicle.rotors else "rotors", None)
    gains = controller
    if controller.get("type") == "pid":
        gains = {**as_flown(vehicle), **controller}
    mission = MultirotorMission.model_validate(
        {
            "vehicle": plain(content),
            "path": {"type": "step", "end": [0.0, 0.0, 1.0], "duration": duration},
            "controller": gains,
            "simulation": {"duration": duration, "log_period": 0.01},
        }
    )
    plan = mission.plan(warn=False)
    tables = tuple(Table(column) for column in goal.T)
    path = SetpointParameters((tables[0], tables[1], tables[2]), Table(yaw), flight.period)
    begin: AirframeState = plan.start
    state = begin._replace(
        position=Vector(flight.channel("position")[part.start].tolist()),
        velocity=Vector(flight.channel("velocity")[part.start].tolist()),
        attitude=Vector(flight.channel("attitude")[part.start].tolist()),
        rates=Vector(flight.channel("rates")[part.start].tolist()),
    )
    loop = replace(plan.loop, path=Setpoints())
    return plan._replace(loop=loop, parameters=plan.parameters._replace(path=path), start=state), part


def fly_again(flights: list[FlightRecord], vehicle: AirframeSection, controller: dict[str, object]) -> list[FlightComparison]:
    """Every flight's setpoints flown, and how both follow them. Raises UserError."""
    plans = [planned(flight, vehicle, controller) for flight in flights]
    logs = fly_all([plan for plan, _ in plans])
    return [compare_flights(flight, part, log) for flight, (_, part), log in zip(flights, plans, logs, strict=True)]


def compare_flights(flight: FlightRecord, part: slice, log: FlightLog) -> FlightComparison:
    """A real flight and its simulation, at the rows of the real one."""
    time = np.arange(part.stop - part.start) * flight.period
    goal, place = flight.channel("setpoint")[part], flight.channel("position")[part]
    kept = time <= log.ended + 1e-9
    moments = log.column("t")

    def at(*names: str) -> Floats:
        return np.stack([np.interp(time[kept], moments, log.column(name)) for name in names], axis=1)

    flown = at("x", "y", "z")
    lost = "" if log.outcome is Outcome.COMPLETED else f"{log.outcome.name.lower().replace('_', ' ')} after {log.ended:.1f} s"
    real = tracking(place, flight.channel("attitude")[part], flight.channel("rates")[part], goal, flight.period)
    if kept.sum() * flight.period < SETTLING + 1.0:
        simulated = Tracking(np.nan, np.nan, np.nan, np.nan)
    else:
        simulated = tracking(flown, at("q_w", "q_x", "q_y", "q_z"), at("p", "q", "r"), goal[kept], flight.period)
    return FlightComparison(flight.name, real, simulated, time[kept], goal[kept], place[kept], flown, lost)


def ratios(comparisons: Sequence[FlightComparison], name: str) -> list[float]:
    """What the simulated flights that were not lost have of something, over what the real ones have, in order."""
    return sorted(getattr(one.simulated, name) / getattr(one.real, name) for one in comparisons if not one.lost)


def span_of_thrust(flights: Sequence[FlightRecord], vehicle: AirframeSection) -> tuple[float, float] | None:
    """Least and most of the median thrust ratios of the thirds of flights; None for too little flight. Predictions hardly show
    them, since they learn from the log what force is missing; a simulated flight has the whole error.
    """
    several = [np.array_split(found, PARTS) for flight in flights if len(found := thrust_ratios(flight, vehicle)) >= PARTS]
    medians = [float(np.median(part)) for parts in several for part in parts]
    return (min(medians), max(medians)) if medians else None


def is_wrong(span: tuple[float, float] | None) -> bool:
    """Whether a first sentence has to say what the thrust is."""
    return span is not None and max(1.0 - span[0], span[1] - 1.0) > WRONG


def of_thrust(span: tuple[float, float]) -> str:
    """Least and most of the thrust, as words."""
    return f"The modelled thrust is {' to '.join(dict.fromkeys(f'{one:.2f}' for one in span))} times the thrust needed"


def of_wrong_thrust(span: tuple[float, float] | None) -> list[str]:
    """The same if it is wrong, with what follows from that."""
    if span is None or not is_wrong(span):
        return []
    return [f"{of_thrust(span)}. Predictions learn this error from the log and correct it; simulated flights cannot."]


def thrust_ratios(flight: FlightRecord, vehicle: AirframeSection) -> Floats:
    """(n,): thrust from the logged commands along the vehicle's own axis over the thrust needed, means of half seconds."""
    p = numbers_of(vehicle, [flight])
    block = blocks([flight], float(p.curve.delay), float(p.airframe.rotor.rise), float(p.airframe.gravity))
    if block is None:
        return np.empty(0)
    speeds = rotor_speeds(block.commands, block.volts, p.curve, flight.speeds)
    lift = (p.airframe.rotor.thrust * speeds**2).sum(axis=2) / p.airframe.mass
    made = (lift[..., None] * block.axes[..., 2]).mean(axis=1)
    return (made * block.gain).sum(axis=1) / (block.gain**2).sum(axis=1)
