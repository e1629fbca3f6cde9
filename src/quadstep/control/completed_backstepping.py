"""The paper's controller completed, so that its theorem holds: see docs/theory.md.

The proof of Theorem 5.1 drops the force that is missing while the attitude is not yet the wanted one. Three terms are added to
the paper's law, none is taken away: a counter-rate that cancels that force in the Lyapunov function, with the attitude error's
own place there; the rigid-body torque of the wanted motion, which the paper leaves to its second net; and bounds on weights
and integrals by projection.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

from quadstep.control.backstepping import (
    BacksteppingGains,
    BacksteppingMemory,
    attitude_errors,
    command_of,
    desired_torque,
    following_memory,
    position_loop,
    start_memory,
    theorem_conditions,
    torque_basis,
)
from quadstep.control.filters import Filtered, command_filter
from quadstep.control.vectoring import project, project_weights
from quadstep.interfaces.controller import Command, Condition, Controller
from quadstep.interfaces.gain import ANGLES, NETS, believed, from_gains, gain
from quadstep.interfaces.learning import output
from quadstep.interfaces.plant import Kinematics, Model, Reference
from quadstep.numbers import Number, Vector, cos, sin, vector, where
from quadstep.numbers.functions import sinc
from quadstep.vehicle.paper import State, coriolis, effective_inertia


class CompletedGains(NamedTuple):
    """paper: the gains of the paper's law. coupling: P, diagonal. inertia: the Sigma that the controller believes."""

    paper: BacksteppingGains
    coupling: Vector = gain(
        from_gains(lambda gains, _: 4.0 * gains.inertia),
        "N m/rad",
        "weight of the attitude error in the Lyapunov function; default: 4 s^-2 times the inertia",
        key="P",
        parts=ANGLES,
    )
    inertia: Vector = believed("inertia")
    weight_bounds: Vector = gain((20.0, 50.0), "-", "bounds on |W_hat_1| and |W_hat_2|", parts=("W1", "W2"), group=NETS)
    integral_bounds: Vector = gain((50.0, 50.0), "m, rad", "bounds on the integrals of r1 and r2", parts=("r1", "r2"))


class CompletedMemory(NamedTuple):
    """paper: the memory of the paper's law. counter: the counter-rate of (theta, phi) and its rate, filtered."""

    paper: BacksteppingMemory
    counter: Filtered


def half_sine_ratio(x: Number) -> Number:
    """sin(x/2) / (x/2), in [-0.22, 1]."""
    return sinc(0.5 * x)


def coupling_columns(tilt: Vector, wanted: Vector) -> tuple[Vector, Vector]:
    """Columns (b_theta, b_phi) of B, each of length at most 1, for tilt = (theta, phi) and the wanted one [rad].

    Exactly, n(wanted) - n(tilt) = b_theta (theta_w - theta) + b_phi (phi_w - phi), n the thrust direction of Eq. 7.
    """
    (theta, phi), (theta_w, phi_w) = tilt, wanted
    theta_mean, phi_mean = 0.5 * (theta_w + theta), 0.5 * (phi_w + phi)
    by_theta, by_phi = half_sine_ratio(theta_w - theta), cos(theta_w) * half_sine_ratio(phi_w - phi)
    b_theta = -by_theta * vector(cos(theta_mean), sin(phi) * sin(theta_mean), cos(phi) * sin(theta_mean))
    return b_theta, vector(0.0, by_phi * cos(phi_mean), -by_phi * sin(phi_mean))


def counter_rate(gains: CompletedGains, u_d: Number, tilt: Vector, wanted: Vector, r1: Vector) -> Vector:
    """P^-1 u_d B^T r1 of (theta, phi) [rad/s]: turning so, the attitude error's part of L cancels r1^T u_d B e2."""
    b_theta, b_phi = coupling_columns(tilt, wanted)
    return vector(u_d * (b_theta @ r1) / gains.coupling[1], u_d * (b_phi @ r1) / gains.coupling[2])


def confine(gains: CompletedGains, memory: BacksteppingMemory) -> BacksteppingMemory:
    """Weights and integrals within their bounds."""
    return memory._replace(
        integral_1=project(memory.integral_1, gains.integral_bounds[0]),
        integral_2=project(memory.integral_2, gains.integral_bounds[1]),
        weights_1=project_weights(memory.weights_1, gains.weight_bounds[0]),
        weights_2=project_weights(memory.weights_2, gains.weight_bounds[1]),
    )


def with_yaw(yaw: Number, tilt: Vector) -> Vector:
    """(psi, theta, phi) from yaw and (theta, phi)."""
    return Vector((yaw, *tilt))


@dataclass(frozen=True)
class CompletedBackstepping(Controller):
    """The completed controller; c in r2 = e2_dot + Lambda_2 e2 + c is the filtered counter-rate.

    tau = Eq. 35 + P e2 + J (eta_d_dd - Lambda_2^2 e2 - Lambda_2 c + c_dot) + C (eta_d_dot + Lambda_2 e2 + c).
    """

    name = "completed-backstepping"
    label = "completed backstepping"
    source = "docs/theory.md"
    Gains = CompletedGains
    measures = State

    kinematics: Kinematics = Kinematics.STANDARD

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        return cls(model.kinematics)

    def start(self, measured: State, gains: CompletedGains) -> CompletedMemory:
        return CompletedMemory(start_memory(measured, gains.paper), Filtered(vector(0.0, 0.0), vector(0.0, 0.0)))

    def countering(self, gains: CompletedGains, u_d: Number, tilt: Vector, wanted: Vector, r1: Vector) -> Vector:
        """The counter-rate before its filter; a study takes it away to see what it is good for."""
        return counter_rate(gains, u_d, tilt, wanted, r1)

    def law(
        self, memory: CompletedMemory, measured: State, reference: Reference, gains: CompletedGains, t: Number,
        period: Number,
    ) -> tuple[Command, CompletedMemory]:  # fmt: skip
        """One sample, in the paper's order."""
        paper, before = gains.paper, memory.paper
        on = where(t >= paper.learning_start, 1.0, 0.0)
        outer = position_loop(paper, before, measured, reference, on)
        tilt = Vector(measured.attitude.entries[1:])
        wanted = self.countering(gains, outer.u_d, tilt, before.filtered.value, outer.r1)
        counter = command_filter(memory.counter, wanted, paper.filter_frequency, period)

        e2, r2 = attitude_errors(paper, before.filtered, measured, reference)
        c = with_yaw(0.0, memory.counter.value)
        r2 = r2 + c
        mu_2 = torque_basis(paper, measured, outer.r1, r2)
        estimate_2 = on * output(before.weights_2, mu_2)
        following = following_memory(paper, before, outer, mu_2, r2, period, on)

        # of tilt and counter the mean rates over the sample: what the held torque has to make
        acceleration = with_yaw(reference.yaw_acceleration, (following.filtered.rate - before.filtered.rate) / period)
        c_dot = with_yaw(0.0, (counter.value - memory.counter.value) / period)
        rates = with_yaw(reference.yaw_rate, before.filtered.rate) + paper.slope_2 * e2 + c
        j = effective_inertia(measured.attitude, gains.inertia, self.kinematics)
        coupling = coriolis(measured.attitude, measured.rates, gains.inertia, self.kinematics)
        rigid = j @ (acceleration - paper.slope_2 * (paper.slope_2 * e2 + c) + c_dot) + coupling @ rates
        torque = desired_torque(paper, r2, before.integral_2, estimate_2) + gains.coupling * e2 + rigid
        command = command_of(paper, before, outer, reference, torque, r2)
        return command, CompletedMemory(confine(gains, following), counter)

    def conditions(self, gains: CompletedGains, model: Model) -> Sequence[Condition]:
        """Theorem 5.1's; the coupling of both loops is cancelled."""
        return theorem_conditions(gains.paper, model)
