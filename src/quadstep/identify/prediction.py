"""Prediction of a logged flight by the laws that fly, from measured states and commands alone.

Up to its start a prediction follows the log: one step of the vehicle's laws, then a correction by the measurement, which also
estimates the torque and force that the laws do not explain. From the start on it sees commands and voltage, and setpoints if
allowed. This is the model in innovations form, whose gains are fitted with the vehicle's parameters (Ljung, "System
Identification", 1999, 7.2 and 7.4).

All predictions fly at once, each a flight of its own in the engine.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.engines.loop import runge_kutta_4
from quadstep.interfaces.closed_loop import Clock, Task
from quadstep.numbers import Number, Table, Vector, clip, either, exp, log, matrix, maximum, total, vector, where
from quadstep.numbers.functions import number, word
from quadstep.numbers.rotations import conjugate, from_rotation_vector, multiply, rotation_matrix, rotation_vector
from quadstep.vehicle.airframe_plant import Airframe, Observer, derivative
from quadstep.vehicle.rigid_body import AirframeState, Effects, Geometry, MassProperties, renormalised

STILL = vector(0.0, 0.0, 0.0)
STANDING = 1e-3
"""Smaller commands count as this share."""


class Curve(NamedTuple):
    """From command and voltage to rotor speed: w = speed c^exponent (V / nominal)^voltage_exponent.

    c: share of the full command. speed [rad/s] at the full command and the nominal voltage [V]. delay [s]: of the command.
    """

    speed: Number
    exponent: Number
    voltage_exponent: Number
    nominal: Number
    delay: Number

    def speeds(self, command: Number, voltage: Number, measured: bool) -> Number:
        """w [rad/s] of a command, or of a measured speed, which is a share of the full one and depends on no voltage [V]."""
        if measured:
            return self.speed * maximum(command, 0.0)
        shift = self.voltage_exponent * log(voltage / self.nominal)
        return self.speed * exp(self.exponent * log(maximum(command, STANDING)) + shift)


class LogTables(NamedTuple):
    """Rows of logs, one log after the other; each number a table.

    motors: commands. measured, guided: 1 where the state was measured, or there is a setpoint, else 0.
    """

    motors: tuple[Table, ...]
    voltage: Table
    position: tuple[Table, ...]
    velocity: tuple[Table, ...]
    attitude: tuple[Table, ...]
    rates: tuple[Table, ...]
    measured: Table
    setpoint: tuple[Table, ...]
    guided: Table


class PredictorParameters(NamedTuple):
    """Every number of a prediction.

    offset: centre of gravity in body axes [m]. tilt: turn about body x and y [rad] from the measured axes to those of the
    rotors. first: row that it begins at. history: rows from there to its start.
    """

    airframe: Airframe
    offset: Vector
    tilt: Vector
    curve: Curve
    observer: Observer
    rows: LogTables
    first: Number
    history: Number


class Unexplained(NamedTuple):
    """torque, trend: angular accelerations [rad/s^2]; force: acceleration [m/s^2]; body axes."""

    torque: Vector
    trend: Vector
    force: Vector


class Prediction(NamedTuple):
    """Result of a prediction: the state at each horizon (position, velocity, attitude, rates), and what was unexplained at
    its start.
    """

    states: tuple[Vector, ...]
    unexplained: Unexplained


class SpeedCommands(NamedTuple):
    """Commanded rotor speeds [rad/s] at the start of a step, in its middle and at its end; a parabola in between."""

    first: Vector
    middle: Vector
    last: Vector

    def at(self, share: Number) -> Vector:
        """The speeds after this share of the step."""
        bend = 2.0 * (self.first - 2.0 * self.middle + self.last)
        return self.first + share * (self.last - self.first - bend) + share * share * bend


class StepState(NamedTuple):
    """The state integrated over a step: the parts of an `AirframeState`, and the share of the step that has passed."""

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector
    speeds: Vector
    charge: Number
    passed: Number


class PredictionCycle(NamedTuple):
    """The cycle. wanted: for the next step. goal: setpoint in x and y [m], and whether there is one."""

    state: AirframeState
    unexplained: Unexplained
    wanted: SpeedCommands
    goal: Vector
    score: Prediction


@dataclass(frozen=True)
class Predictor:
    """A closed loop for the engines. horizons: samples after the start at which states are kept. speeds: whether the logs
    hold rotor speeds instead of commands.
    """

    geometry: Geometry
    effects: Effects
    horizons: tuple[int, ...]
    speeds: bool = False

    @property
    def columns(self) -> Mapping[str, str]:
        return {}

    @property
    def tasks(self) -> tuple[Task, ...]:
        return (Task("row", self.take_row),)

    def row(self, cycle: PredictionCycle, parameters: PredictorParameters, time: Number) -> list[Number]:
        return []

    def start(self, start: tuple[()], p: PredictorParameters) -> PredictionCycle:
        """The state of the first row; its rotors turn as commanded."""
        state, speeds = self.measured(p, p.first), self.commanded(p, p.first, 0.0)
        whole = AirframeState(*state, speeds=speeds, charge=0.0 * p.first)
        none = Unexplained(*[0.0 * p.first * vector(1.0, 1.0, 1.0)] * 3)
        kept = Vector([0.0 * p.first] * 13)
        still = SpeedCommands(speeds, speeds, speeds)
        return PredictionCycle(whole, none, still, self.goal(p, p.first), Prediction((kept,) * len(self.horizons), none))

    def measured(self, p: PredictorParameters, row: Number) -> tuple[Vector, Vector, Vector, Vector]:
        """Position, velocity, attitude and rates as measured in a row, in the rotors' axes."""
        rows = p.rows
        place, speed, attitude, rates = (
            Vector(one.at(row) for one in tables) for tables in (rows.position, rows.velocity, rows.attitude, rows.rates)
        )
        turn = from_rotation_vector(vector(p.tilt[0], p.tilt[1], 0.0))
        return place, speed, multiply(attitude, turn), rotation_matrix(turn).T @ rates

    def commanded(self, p: PredictorParameters, row: Number, ahead: Number) -> Vector:
        """Commanded rotor speeds [rad/s], `ahead` rows after a row.

        Between rows, commands are interpolated by a cubic (Catmull and Rom 1974): straight lines would flatten fast changes.
        """
        place = row + ahead
        low = number(word(maximum(place, 0.0)))
        s = place - low
        weights = (
            s * (-0.5 + s * (1.0 - 0.5 * s)),
            1.0 + s * s * (1.5 * s - 2.5),
            s * (0.5 + s * (2.0 - 1.5 * s)),
            s * s * (0.5 * s - 0.5),
        )
        voltage, found = p.rows.voltage.at(row), []
        for table in p.rows.motors:
            command = total(weight * table.at(low + step) for weight, step in zip(weights, (-1.0, 0.0, 1.0, 2.0), strict=True))
            found.append(p.curve.speeds(command, voltage, self.speeds))
        return Vector(found)

    def goal(self, p: PredictorParameters, row: Number) -> Vector:
        """The setpoint of a row in x and y [m], and whether there was one."""
        return vector(p.rows.setpoint[0].at(row), p.rows.setpoint[1].at(row), p.rows.guided.at(row))

    def take_row(self, cycle: PredictionCycle, p: PredictorParameters, clock: Clock) -> tuple[PredictionCycle, Number]:
        """Correct the state by a row, up to the start; store it at a horizon."""
        row = p.first + clock.tick
        known = where(clock.tick <= p.history, where(clock.tick > 0.0, p.rows.measured.at(row), 0.0), 0.0)
        state, unexplained = self.corrected(cycle, p, row, known, p.rows.measured.at(row - 1.0))
        since = clock.tick - p.history
        after = flat(self.shown(p, state))
        states = tuple(
            either(since == float(horizon), after, kept)
            for horizon, kept in zip(self.horizons, cycle.score.states, strict=True)
        )
        at_start = Unexplained(
            *(either(since == 0.0, now, kept) for now, kept in zip(unexplained, cycle.score.unexplained, strict=True))
        )
        late = (p.curve.delay + p.observer.delay) / clock.period
        wanted = SpeedCommands(*(self.commanded(p, row, share - late) for share in (0.0, 0.5, 1.0)))
        return PredictionCycle(state, unexplained, wanted, self.goal(p, row), Prediction(states, at_start)), 0.0

    def shown(self, p: PredictorParameters, state: AirframeState) -> tuple[Vector, Vector, Vector, Vector]:
        """Position, velocity, attitude and rates in the measured axes."""
        turn = from_rotation_vector(vector(p.tilt[0], p.tilt[1], 0.0))
        attitude = multiply(state.attitude, conjugate(turn))
        return state.position, state.velocity, attitude, rotation_matrix(turn) @ state.rates

    def corrected(
        self, cycle: PredictionCycle, p: PredictorParameters, row: Number, known: Number, before: Number
    ) -> tuple[AirframeState, Unexplained]:
        """State and unexplained forces after a row, where known is 1; as they are, where it is 0.

        before: whether the row before was measured. If it was not, the state is set to the measured one, and the difference
        from it, which has accumulated over several samples, is not used for forces.
        """
        state, told, gains = cycle.state, cycle.unexplained, p.observer
        position, velocity, attitude, rates = self.measured(p, row)
        turning, moving = rates - state.rates, velocity - state.velocity
        turned = rotation_vector(multiply(conjugate(state.attitude), attitude))
        felt = rotation_matrix(state.attitude).T @ moving

        def share(pair: Vector) -> Vector:
            return known * by_axis(Vector(where(before > 0.0, one, 1.0) for one in pair))

        learning = known * before
        state = state._replace(
            position=state.position + known * (position - state.position),
            velocity=state.velocity + share(gains.velocity) * moving,
            attitude=multiply(state.attitude, from_rotation_vector(share(gains.attitude) * turned)),
            rates=state.rates + share(gains.rates) * turning,
        )
        unexplained = Unexplained(
            told.torque + learning * (by_axis(gains.torque) * turning),
            told.trend + learning * (by_axis(gains.trend) * turning),
            told.force + learning * (by_axis(gains.force) * felt),
        )
        return state, unexplained

    def advance(self, cycle: PredictionCycle, p: PredictorParameters, clock: Clock) -> PredictionCycle:
        airframe, unexplained, gains = p.airframe, cycle.unexplained, p.observer
        x, y, z = airframe.inertia
        inertia = matrix((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))
        properties = MassProperties(airframe.mass, p.offset, inertia)
        shares = Vector([1.0] * len(self.geometry.mounts))
        push = unexplained.torque + unexplained.trend

        def rate(moving: StepState) -> StepState:
            state, wanted = AirframeState(*moving[:-1]), cycle.wanted.at(moving.passed)
            change = derivative(self.geometry, airframe, properties, shares, state, wanted, STILL, self.effects)
            rotation = rotation_matrix(state.attitude)
            up = rotation.T @ desired_thrust_axis(state, cycle.goal, gains, airframe.gravity)
            turning = (
                by_axis(gains.authority) * change.rates
                + push
                - by_axis(gains.leak) * state.rates
                + gains.spring * vector(-up[1], up[0], 0.0)
            )
            force: Vector = rotation @ unexplained.force
            changed = change._replace(rates=turning, velocity=change.velocity + force)
            return StepState(*changed, 1.0 / clock.period)

        moved = runge_kutta_4(rate, StepState(*cycle.state, passed=0.0), clock.period)
        state = renormalised(AirframeState(*moved[:-1]))
        torque_kept, force_kept = (fading(fade, clock.period) for fade in (gains.torque_fade, gains.force_fade))
        after = Unexplained(torque_kept * unexplained.torque, unexplained.trend, force_kept * unexplained.force)
        return cycle._replace(state=state, unexplained=after)


def desired_thrust_axis(state: AirframeState, goal: Vector, gains: Observer, gravity: Number) -> Vector:
    """World vector to which the vehicle's thrust returns: up, tilted towards the setpoint and against the velocity."""
    pulls = [
        goal[2] * clip(gains.path * (goal[axis] - state.position[axis]), -gains.reach, gains.reach)
        - gains.drift * state.velocity[axis]
        for axis in (0, 1)
    ]
    x, y = (clip(pull * (1.0 / gravity), -gains.steepest, gains.steepest) for pull in pulls)
    return vector(x, y, 1.0)


def by_axis(pair: Vector) -> Vector:
    """A pair, for x and y and for z, as one number per axis."""
    return vector(pair[0], pair[0], pair[1])


def fading(fade: Vector, period: Number) -> Vector:
    """The share of a disturbance that is left after a sample."""
    return by_axis(Vector(exp(-period * one) for one in fade))


def flat(parts: tuple[Vector, ...]) -> Vector:
    """The numbers of several vectors, one after the other."""
    return Vector(entry for part in parts for entry in part)
