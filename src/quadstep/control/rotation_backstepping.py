"""Adaptive neural backstepping for a real vehicle: the paper's law (Eqs 11-54) completed, on the rotation group.

What is the paper's: the filtered errors r1 and r2 (Eqs 12 and 28), the wanted force (Eq. 24) and torque (Eq. 35), the nets
(Eqs 23, 34) and their tuning (Eq. 54). What is not, and why:

- The attitude error is the turn from the vehicle to the wanted attitude, so any yaw and tilt will do (paper: Euler angles).
- The rigid-body torque of the wanted motion and a term P e2 are added, as in the completed law (docs/theory.md): only the
  unknown is left to the second net.
- Everything is per mass and per inertia, so one set of gains serves vehicles of all sizes.
- The nets see what their targets depend on: drag turns on velocity, thrust axis and wanted force; the aerodynamic torque on
  body airspeed and rates. The paper's chi_1 lacks the velocity and its chi_2 the wanted motion.
- What rotors could not make is taken off the errors that are learnt from (hedging), weights and integrals are bounded by
  projection, and nothing is learnt before take-off.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.filters import FilteredAttitude, attitude_filter
from quadstep.control.vectoring import (
    angular_of,
    integral_for,
    project,
    project_weights,
    push_against,
    turning_attitude,
    up_axis,
    within,
)
from quadstep.interfaces.controller import Command, Condition, Controller, Measured
from quadstep.interfaces.gain import AXES, NETS, believed, gain, given, usual
from quadstep.interfaces.learning import Net, basis, net, nets_start, output, weight_rate, weights
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Matrix, Number, Vector, absolute, maximum, outer, vector, where
from quadstep.numbers.rotations import conjugate, cross, multiply, rotation_matrix, rotation_vector, yaw_pitch_roll

FORCE_INPUTS = 9
"""chi_1: velocity, thrust axis, wanted acceleration."""

TORQUE_INPUTS = 9
"""chi_2: velocity in body axes, body rates, wanted angular acceleration."""

SPEED, RATE, GRAVITY, TURN = 5.0, 5.0, 10.0, 50.0
"""What the nets' inputs are divided by: m/s, rad/s, m/s^2, rad/s^2."""

AIRBORNE = 0.8
"""Share of the weight that the rotors must have carried for the vehicle to count as flying."""


class RotationGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains over mass in x, y, z, over inertia about body x, y, z.

    most_thrust: that the position loop may ask for [N]. force_net, torque_net: for accelerations [m/s^2] and [rad/s^2].
    learning_start [s]; infinite for never. weights_1 [m/s^2], weights_2 [rad/s^2]: at the start, (N, 3).
    """

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    slope_1: Vector = gain(usual(0.92, 1), "1/s", "decay rate of position errors (Eq. 12)", key="Lambda1")
    gain_1: Vector = gain(usual(4.9, 1), "1/s", "gain of r1, over mass; the theorem requires K_r1 > Lambda1", key="K_r1")
    integral_1: Vector = gain(usual(0.19, 2), "1/s^2", "gain of the integral of r1, over mass", key="K_i1", zero=True)
    slope_2: Vector = gain(usual((2.3, 2.3, 2.3), 1, "body"), "1/s", "decay rate of attitude errors (Eq. 28)", key="Lambda2")
    gain_2: Vector = gain(usual((19.5, 19.5, 14.0), 1, "rate"), "1/s", "gain of r2, over inertia", key="K_r2")
    integral_2: Vector = gain(
        usual((28.0, 28.0, 28.0), 2, "body"), "1/s^2", "gain of the integral of r2, over inertia", key="K_i2", zero=True
    )
    coupling: Vector = gain(
        usual((31.0, 31.0, 31.0), 2, "body"), "1/s^2", "gain of the attitude error, over inertia (of the completion)", key="P"
    )
    filter_frequency: Vector = gain(usual((17.5, 17.5, 15.5), 1, "body"), "rad/s", "bandwidth of the attitude command filter")
    force_net: Net = net(1, FORCE_INPUTS, rate=usual(2.5, 2), damping=0.06)
    torque_net: Net = net(2, TORQUE_INPUTS, rate=usual(6.0, 2), damping=0.06)
    learning_start: Number = nets_start()
    weight_bounds: Vector = gain((30.0, 100.0), "-", "bounds on |W_1| and |W_2|", parts=("W1", "W2"), group=NETS)
    integral_bounds: Vector = gain((20.0, 5.0), "m, rad", "bounds on the integrals of r1 and r2", parts=("r1", "r2"))
    weights_1: Matrix = weights(1)
    weights_2: Matrix = weights(2)


class RotationMemory(NamedTuple):
    """integral_1 [m], integral_2 [rad]: integrals of r1 and r2. weights_1 [m/s^2], weights_2 [rad/s^2]: W_hat_1, W_hat_2,
    (N, 3). filtered: command filter of the attitude. flying: whether it has taken off (0 or 1).

    From the position loop to the attitude loop: force [N], wanted (unit quaternion) and turn [rad/s] of that
    attitude about its thrust axis, r1 [m/s]. Asked in the last sample:
    asked_thrust [N], asked_torque [N m].
    """

    integral_1: Vector
    integral_2: Vector
    weights_1: Matrix
    weights_2: Matrix
    filtered: FilteredAttitude
    flying: Number
    force: Vector
    wanted: Vector
    turn: Number
    r1: Vector
    asked_thrust: Number
    asked_torque: Vector


@dataclass(frozen=True)
class RotationBackstepping(Controller):
    """Adaptive backstepping on the rotation group: `guide` is the position loop, `law` the attitude loop."""

    name = "rotation-backstepping"
    label = "adaptive backstepping on the rotation group"
    source = "docs/theory.md"
    Gains = RotationGains

    def start(self, measured: Measured, gains: RotationGains) -> RotationMemory:
        """Nothing integrated, the filter at the measured attitude."""
        zero = vector(0.0, 0.0, 0.0)
        return RotationMemory(
            integral_1=zero,
            integral_2=zero,
            weights_1=gains.weights_1,
            weights_2=gains.weights_2,
            filtered=FilteredAttitude(measured.attitude, measured.rates, zero),
            flying=0.0,
            force=vector(0.0, 0.0, gains.mass * gains.gravity),
            wanted=measured.attitude,
            turn=0.0,
            r1=zero,
            asked_thrust=measured.thrust,
            asked_torque=measured.torque,
        )

    def enter(self, measured: Measured, reference: Reference, gains: RotationGains) -> RotationMemory:
        """The integrals are what the present command is for beyond the present motion; the net has the rest of the force."""
        push, axis = push_against(measured, reference, gains), up_axis(rotation_matrix(measured.attitude))
        integral = integral_for(push, gains.integral_1, gains.integral_bounds[0])
        turning = angular_of(measured.torque, measured, gains)
        mu = force_basis(gains, measured, axis, measured.thrust * axis)
        rest = push - gains.integral_1 * integral - output(gains.weights_1, mu)
        learnt = gains.weights_1 + outer((1.0 / (mu @ mu)) * mu, rest)
        return self.start(measured, gains)._replace(
            integral_1=integral,
            integral_2=integral_for(turning, gains.integral_2, gains.integral_bounds[1]),
            weights_1=project_weights(learnt, gains.weight_bounds[0]),
            flying=1.0,
            force=measured.thrust * axis,
        )

    def guide(
        self, memory: RotationMemory, measured: Measured, reference: Reference, gains: RotationGains, t: Number,
        period: Number,
    ) -> RotationMemory:  # fmt: skip
        """Position loop (Eqs 11-24), learning (Eq. 54)."""
        return self.pull(memory, measured, reference, gains, t, period)[1]

    def pull(
        self, memory: RotationMemory, measured: Measured, reference: Reference, gains: RotationGains, t: Number,
        period: Number,
    ) -> tuple[Vector, RotationMemory]:  # fmt: skip
        """Errors, net, wanted force and attitude (Eqs 11-24), learning (Eq. 54); and the acceleration that is wanted before
        the force is limited [m/s^2].
        """
        flying = where(measured.thrust > AIRBORNE * gains.mass * gains.gravity, 1.0, memory.flying)
        on = flying * where(t >= gains.learning_start, 1.0, 0.0)
        e1 = reference.position - measured.position  # Eq. 11
        e1_dot = reference.velocity - measured.velocity
        r1 = e1_dot + gains.slope_1 * e1  # Eq. 12
        axis = up_axis(rotation_matrix(measured.attitude))
        mu_1 = force_basis(gains, measured, axis, memory.force)
        estimate = on * output(memory.weights_1, mu_1)  # Eq. 23
        feedback = gains.gain_1 * r1 + gains.integral_1 * memory.integral_1
        wanted = reference.acceleration - gains.slope_1 * gains.slope_1 * e1 + feedback + estimate
        force = within(gains.mass * (wanted + vector(0.0, 0.0, gains.gravity)), gains.most_thrust)  # Eq. 24

        made = share_made(absolute(memory.asked_thrust - measured.thrust), absolute(memory.asked_thrust))
        learning = on * made * period  # Eq. 54 is linear in the error: its rate times this is what the weights change by
        change = weight_rate(gains.force_net, memory.weights_1, mu_1, learning * r1, learning * r1.norm())
        attitude, turn = turning_attitude(force, reference)
        return wanted, memory._replace(
            flying=flying,
            integral_1=project(memory.integral_1 + (flying * made * period) * r1, gains.integral_bounds[0]),
            weights_1=project_weights(memory.weights_1 + change, gains.weight_bounds[0]),
            force=force,
            wanted=attitude,
            turn=turn,
            r1=r1,
        )

    def law(
        self, memory: RotationMemory, measured: Measured, reference: Reference, gains: RotationGains, t: Number,
        period: Number,
    ) -> tuple[Command, RotationMemory]:  # fmt: skip
        """Attitude loop: command filter, then `follow`."""
        over = Vector(1.0 / entry for entry in gains.inertia)
        missing = memory.asked_torque - measured.torque
        short, made = over * missing, share_made(missing.norm(), memory.asked_torque.norm())
        lead, frequency = vector(0.0, 0.0, memory.turn), gains.filter_frequency
        filtered = attitude_filter(memory.filtered, memory.wanted, lead, frequency, short, period)
        return self.follow(memory, measured, filtered, made, gains, t, period)

    def follow(
        self, memory: RotationMemory, measured: Measured, filtered: FilteredAttitude, made: Number,
        gains: RotationGains, t: Number, period: Number,
    ) -> tuple[Command, RotationMemory]:  # fmt: skip
        """Errors to the filtered attitude, net, torque (Eqs 27-35), learning (Eq. 54). made: share of the last torque."""
        on = memory.flying * where(t >= gains.learning_start, 1.0, 0.0)
        between = multiply(conjugate(measured.attitude), filtered.attitude)
        e2 = rotation_vector(between)  # Eq. 27, on the group
        into_body = rotation_matrix(between)
        wanted_rates = into_body @ filtered.rates
        e2_dot = wanted_rates - measured.rates
        r2 = e2_dot + gains.slope_2 * e2  # Eq. 28
        rotation = rotation_matrix(measured.attitude)
        airspeed = rotation.T @ measured.velocity
        angular = into_body @ filtered.acceleration - cross(measured.rates, wanted_rates)
        inputs = (*(airspeed * (1.0 / SPEED)), *(measured.rates * (1.0 / RATE)), *(angular * (1.0 / TURN)))
        mu_2 = basis(gains.torque_net, inputs)
        estimate = on * output(memory.weights_2, mu_2)  # Eq. 34
        feedback = gains.gain_2 * r2 + gains.integral_2 * memory.integral_2 + gains.coupling * e2
        rigid = angular + gains.slope_2 * e2_dot
        torque = gains.inertia * (rigid + feedback + estimate) + cross(measured.rates, gains.inertia * measured.rates)
        thrust = maximum(memory.force @ up_axis(rotation), 0.0)

        learning = on * made * period
        change = weight_rate(gains.torque_net, memory.weights_2, mu_2, learning * r2, learning * r2.norm())
        command = Command(
            thrust=thrust,
            torque=torque,
            desired_attitude=yaw_pitch_roll(memory.wanted),
            r1=memory.r1,
            r2=r2,
            weight_norms=vector(memory.weights_1.norm(), memory.weights_2.norm()),
        )
        following = memory._replace(
            integral_2=project(memory.integral_2 + (memory.flying * made * period) * r2, gains.integral_bounds[1]),
            weights_2=project_weights(memory.weights_2 + change, gains.weight_bounds[1]),
            filtered=filtered,
            asked_thrust=thrust,
            asked_torque=torque,
        )
        return command, following

    def conditions(self, gains: RotationGains, model: Model) -> Sequence[Condition]:
        """The condition of Theorem 5.1 that is left when the rigid-body torque is fed forward: K_r1 > m Lambda_1."""
        pairs = zip(AXES, gains.gain_1, gains.slope_1, strict=True)
        return [Condition(f"K_r1 ({axis}) > Lambda1", k, slope, "Theorem 5.1, per unit mass") for axis, k, slope in pairs]


def force_basis(gains: RotationGains, measured: Measured, axis: Vector, force: Vector) -> Vector:
    """mu_1. force: that was last wanted [N]."""
    before = force * (1.0 / (gains.mass * GRAVITY))
    return basis(gains.force_net, (*(measured.velocity * (1.0 / SPEED)), *axis, *before))


def share_made(missing: Number, asked: Number) -> Number:
    """1 while the rotors make what they were asked for, falling to 0 where a tenth of it is missing; both of them lengths."""
    return maximum(1.0 - 10.0 * missing / maximum(asked, 1e-6), 0.0)
