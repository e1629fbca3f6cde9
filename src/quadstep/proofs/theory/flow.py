"""L of Theorem B along the flow: closed loops inside a region, and whether L_dot keeps to -s^T Q s + d . s there."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.control.backstepping import BacksteppingMemory, attitude_errors, position_loop
from quadstep.control.completed_backstepping import (
    CompletedBackstepping,
    CompletedGains,
    CompletedMemory,
    counter_rate,
    with_yaw,
)
from quadstep.control.filters import Filtered, command_filter
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import Number, Vector
from quadstep.proofs.theory.edge import Pushes, mission, setting_of
from quadstep.proofs.theory.region import NORMS, SIZE, Region, decay
from quadstep.vehicle.paper import State, Vehicle, acceleration, angular_acceleration, effective_inertia

STEP = 1e-6
"""Step of the finite difference for L_dot [s]."""


class LoopInstant(NamedTuple):
    """A closed loop at an instant, nets off."""

    state: State
    reference: Reference
    memory: CompletedMemory


class LyapunovSlope(NamedTuple):
    """One number per closed loop. rate: L_dot [W]. quadratic, linear: s^T Q s and d . s. level: L [J]."""

    rate: NDArray[np.float64]
    quadratic: NDArray[np.float64]
    linear: NDArray[np.float64]
    level: NDArray[np.float64]

    @property
    def worst(self) -> float:
        """Largest L_dot less its bound, relative to the terms of the bound."""
        return float(np.max((self.rate + self.quadratic - self.linear) / (np.abs(self.quadratic) + self.linear)))

    @property
    def used(self) -> float:
        """Largest share of d . s that L_dot + s^T Q s needs."""
        return float(np.max((self.rate + self.quadratic) / self.linear))


class Flow:
    """The completed law inside a region; with its default gains on the paper's vehicle, if no other plan is given."""

    def __init__(self, region: Region, force: float = 0.0, torque: float = 0.0, plan: FlightPlan | None = None) -> None:
        plan = plan or mission({}, False).plan()
        self.region, self.setting = region, setting_of(plan, Pushes(force, torque))
        self.gains: CompletedGains = plan.parameters.gains
        self.vehicle: Vehicle = plan.parameters.vehicle
        self.forms = decay(self.setting, region.shape, region.bounds)

    def errors(self, now: LoopInstant) -> list[Vector]:
        """r1, I1, e1, e2, r2, I2, a, b, a_c, b_c."""
        paper, memory, w = self.gains.paper, now.memory.paper, self.gains.paper.filter_frequency
        outer = position_loop(paper, memory, now.state, now.reference, 0.0)
        e2, r2 = attitude_errors(paper, memory.filtered, now.state, now.reference)
        tilt = Vector(now.state.attitude.entries[1:])
        raw = counter_rate(self.gains, outer.u_d, tilt, memory.filtered.value, outer.r1)
        found = [outer.r1, memory.integral_1, now.reference.position - now.state.position, e2]
        found += [r2 + with_yaw(0.0, now.memory.counter.value), memory.integral_2]
        for command, filtered in ((outer.tilt, memory.filtered), (raw, now.memory.counter)):
            b = filtered.rate * (1.0 / w)
            found += [command - filtered.value - b, b]
        return found

    def level(self, now: LoopInstant) -> Number:
        """L [J]."""
        r1, i1, e1, e2, r2, i2, *stages = self.errors(now)
        s, shape = self.setting, [float(number) for number in self.region.shape]
        j = effective_inertia(now.state.attitude, self.vehicle.inertia, Kinematics.STANDARD)
        twice = float(s.mass) * (r1 @ r1) + float(s.integral_1) * (i1 @ i1) + 2.0 * shape[0] * float(s.mass) * (r1 @ i1)
        twice = twice + float(s.coupling) * (e2 @ e2) + r2 @ (j @ r2) + float(s.integral_2) * (i2 @ i2)
        twice = twice + 2.0 * shape[1] * (r2 @ (j @ i2)) + shape[2] * (e1 @ e1)
        for weight, stage in zip(shape[3:], stages, strict=True):
            twice = twice + weight * (stage @ stage)
        return 0.5 * twice

    def at(self, errors: list[Vector], reference: Reference) -> LoopInstant:
        """The closed loop with these errors off a reference."""
        r1, i1, e1, e2, r2, i2, a, b, a_c, b_c = errors
        paper, w = self.gains.paper, self.gains.paper.filter_frequency
        zero = Vector((0.0, 0.0, 0.0))
        velocity = reference.velocity - (r1 - paper.slope_1 * e1)
        start = Filtered(Vector((0.0, 0.0)), Vector((0.0, 0.0)))
        memory = BacksteppingMemory(i1, i2, start, paper.weights_1, paper.weights_2)
        outer = position_loop(paper, memory, State(reference.position - e1, velocity, zero, zero), reference, 0.0)
        filtered = Filtered(outer.tilt - a - b, w * b)
        attitude = with_yaw(reference.yaw, filtered.value) - e2
        raw = counter_rate(self.gains, outer.u_d, Vector(attitude.entries[1:]), filtered.value, r1)
        counter = Filtered(raw - a_c - b_c, w * b_c)
        rates = with_yaw(reference.yaw_rate, filtered.rate) - (r2 - paper.slope_2 * e2 - with_yaw(0.0, counter.value))
        return LoopInstant(
            State(reference.position - e1, velocity, attitude, rates),
            reference,
            CompletedMemory(memory._replace(filtered=filtered), counter),
        )

    def moved(self, now: LoopInstant, h: float, force: Vector, torque: Vector) -> LoopInstant:
        """h [s] later along the flow, to second order; before, for a negative h."""
        paper, memory, state, wanted = self.gains.paper, now.memory.paper, now.state, now.reference
        command, _ = CompletedBackstepping().law(now.memory, state, wanted, self.gains, 0.0, STEP)
        xi_dd = acceleration(self.vehicle, state.attitude, command.thrust, force)
        eta_dd = angular_acceleration(self.vehicle, state.attitude, state.rates, command.torque + torque, Kinematics.STANDARD)
        outer = position_loop(paper, memory, state, wanted, 0.0)
        tilt = Vector(state.attitude.entries[1:])
        raw = counter_rate(self.gains, outer.u_d, tilt, memory.filtered.value, outer.r1)
        w = paper.filter_frequency
        return LoopInstant(
            State(
                state.position + h * state.velocity, state.velocity + h * xi_dd,
                state.attitude + h * state.rates, state.rates + h * eta_dd,
            ),
            wanted._replace(
                position=wanted.position + h * wanted.velocity, velocity=wanted.velocity + h * wanted.acceleration,
                acceleration=wanted.acceleration + h * wanted.jerk,
            ),
            CompletedMemory(
                memory._replace(
                    integral_1=memory.integral_1 + h * command.r1, integral_2=memory.integral_2 + h * command.r2,
                    filtered=command_filter(memory.filtered, outer.tilt, w, h),
                ),
                command_filter(now.memory.counter, raw, w, h),
            ),
        )  # fmt: skip

    def slopes(self, errors: list[Vector], reference: Reference, force: Vector, torque: Vector) -> LyapunovSlope:
        """L_dot of closed loops, and Theorem B's bound on it."""
        now = self.at(errors, reference)
        after, before = (self.level(self.moved(now, h, force, torque)) for h in (STEP, -STEP))
        rate = np.asarray((after - before) / (2.0 * STEP))
        s = np.array([np.broadcast_to(np.asarray(v.norm()), np.shape(rate)) for v in self.errors(now)])
        q, d = (np.array(form, dtype=float) for form in self.forms)
        return LyapunovSlope(rate, np.einsum("ik,ij,jk->k", s, q, s), d @ s, np.asarray(self.level(now)))


def towards(generator: np.random.Generator, length: NDArray[np.float64], size: int = 3) -> Vector:
    way = generator.normal(size=(size, np.size(length)))
    return Vector(length * entry for entry in way / np.linalg.norm(way, axis=0))


def entries(norm: int) -> int:
    """How many numbers the error with this place in s has: attitude and position three, a stage of a filter two."""
    return 3 if norm < 6 else 2


def draw(flow: Flow, seed: int, count: int) -> LyapunovSlope:
    """L_dot on random closed loops inside the region, with unknown force and torque at their bounds and the path's largest
    acceleration and jerk.
    """
    generator, setting = np.random.default_rng(seed), flow.setting
    shares = generator.uniform(0.0, 1.0, (SIZE, count)) ** 4  # some norms alone, others together
    shares *= generator.uniform(0.0, 0.5, count) / np.linalg.norm(shares, axis=0)
    largest = flow.region.bounds.largest
    errors = [
        towards(generator, share * float(most), entries(i))
        for i, (share, most) in enumerate(zip(shares, largest, strict=True))
    ]
    one = np.ones(count)
    wanted = Reference(
        Vector((0.0, 0.0, 0.0)), towards(generator, one),
        towards(generator, generator.uniform(0.0, float(setting.acceleration), count)),
        0.0, 0.0, jerk=towards(generator, float(setting.jerk) * one),
    )  # fmt: skip
    force, torque = (towards(generator, float(most) * one) for most in (setting.force, setting.torque))
    return flow.slopes(errors, wanted, force, torque)


def shares_of_lines(flow: Flow, seed: int, count: int) -> dict[tuple[str, str], float]:
    """For each pair of norms that Q couples: the largest share of its coefficient used where there is no other error."""
    generator, zero = np.random.default_rng(seed), Vector((0.0, 0.0, 0.0))
    still = Reference(zero, zero, zero, 0.0, 0.0)
    q, largest = np.array(flow.forms[0], dtype=float), [float(most) for most in flow.region.bounds.largest]
    found = {}
    for i in range(SIZE):
        for k in range(i + 1, SIZE):
            if q[i, k] < -1e-9:
                share = generator.uniform(0.0, 1.0, count)
                lengths = [0.3 * largest[n] * {i: share, k: 1.0 - share}.get(n, 0.0 * share) for n in range(SIZE)]
                errors = [towards(generator, length, entries(n)) for n, length in enumerate(lengths)]
                slope = flow.slopes(errors, still, zero, zero)
                product = -2.0 * q[i, k] * lengths[i] * lengths[k]
                found[NORMS[i], NORMS[k]] = 1.0 + float(np.max((slope.rate + slope.quadratic) / product))
    return found
