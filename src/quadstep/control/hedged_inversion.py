"""Neural dynamic inversion with pseudo-control hedging: the paper's references [16, 17].

Calise, Kim, Leitner, Prasad (1994); Johnson and Kannan, "Adaptive trajectory control for autonomous helicopters", Journal of
Guidance, Control, and Dynamics 28 (2005). Both loops are the same thing twice, outer for the place, inner for the attitude:

- a reference model, a second-order system that follows the command from where the vehicle is;
- an inversion of the believed vehicle, which turns the wanted acceleration (the pseudo-control) into a force or a torque;
- a net that learns what the inversion gets wrong from e, the motion of the reference model less the vehicle's:
  W_dot = F mu r^T - kappa |e| F W with r = B^T P e, where P solves A^T P + P A = -Q for the dynamics A of e;
- the hedge: what of the pseudo-control the believed actuators do not make is taken off the reference model. It then moves as
  the vehicle can, e is free of limits and lags, and none of them are learnt. To the outer loop the attitude, to both the
  rotors are such actuators.

The gains of a reference model and of the feedback of its error are the same, as in the paper, so with no net the place obeys
the command's error alone. The nets are linear in their weights as those of [16]; [17] adapts the input weights too.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.filters import FilteredAttitude, LedAttitude, led_acceleration, led_by, led_filter
from quadstep.control.rotation_backstepping import AIRBORNE, FORCE_INPUTS, GRAVITY, RATE, SPEED, TORQUE_INPUTS, TURN
from quadstep.control.vectoring import attitude_for, project_weights, up_axis, within
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import NETS, believed, gain, given, usual
from quadstep.interfaces.learning import Net, basis, net, nets_start, output, weight_rate, weights
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, exp, maximum, vector, where
from quadstep.numbers.functions import length
from quadstep.numbers.rotations import conjugate, cross, multiply, rotation_matrix, rotation_vector, yaw_pitch_roll


class HedgedInversionGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains in x, y, z; of attitude about body x, y, z.

    most_thrust: that the outer loop may ask for [N]. lag: of the rotors [s]. force_net, torque_net: for accelerations
    [m/s^2] and [rad/s^2]. learning_start [s]; infinite for never. weights_1 [m/s^2], weights_2 [rad/s^2]: at the
    start, (N, 3).
    """

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    lag: Number = given(lambda model: model.lag)
    stiffness_1: Vector = gain(usual(17.8, 2), "1/s^2", "R_p: stiffness of outer loop and model", key="R_p")
    damping_1: Vector = gain(usual((6.35, 6.35, 7.4), 1), "1/s", "R_d: damping of outer loop and model", key="R_d")
    stiffness_2: Vector = gain(
        usual((172.0, 172.0, 70.0), 2, "body"), "1/s^2", "K_p: stiffness of inner loop and model", key="K_p"
    )
    damping_2: Vector = gain(usual((32.0, 32.0, 17.0), 1, "rate"), "1/s", "K_d: damping of inner loop and model", key="K_d")
    force_net: Net = net(1, FORCE_INPUTS, rate=usual(5.9, 2), damping=0.06)
    torque_net: Net = net(2, TORQUE_INPUTS, rate=usual(11.0, 2), damping=0.06)
    learning_start: Number = nets_start()
    weight_bounds: Vector = gain((30.0, 100.0), "-", "bounds on |W_1| and |W_2|", parts=("W1", "W2"), group=NETS)
    weights_1: Matrix = weights(1)
    weights_2: Matrix = weights(2)


class HedgedInversionMemory(NamedTuple):
    """The reference models: place [m], speed [m/s]; model, of the attitude. weights_1 [m/s^2], weights_2 [rad/s^2]:
    W_hat_1, W_hat_2, (N, 3). flying: whether it has taken off (0 or 1).

    From the outer loop to the inner: asked, the pseudo-control [m/s^2]; force [N]; wanted; r1 [m/s]. thrust [N], torque
    [N m]: what the rotors are believed to make. Of the last sample: asked_torque [N m]; asked_turn, the pseudo-control
    [rad/s^2].
    """

    place: Vector
    speed: Vector
    model: FilteredAttitude
    weights_1: Matrix
    weights_2: Matrix
    flying: Number
    asked: Vector
    force: Vector
    wanted: LedAttitude
    r1: Vector
    thrust: Number
    torque: Vector
    asked_torque: Vector
    asked_turn: Vector


def learnt_from(damping: Vector, e: Vector, e_dot: Vector) -> Vector:
    """r = B^T P e for e_dd = -stiffness e - damping e_dot + what is to be learnt, Q = diag(damping stiffness, damping)."""
    return e_dot + 0.5 * (damping * e)


@dataclass(frozen=True)
class HedgedInversion(Controller):
    """`guide` is the outer loop, `law` the inner."""

    name = "hedged-inversion"
    label = "neural inversion with hedging [16, 17]"
    source = "Calise, Kim, Leitner, Prasad 1994; Johnson and Kannan 2005"
    Gains = HedgedInversionGains

    def start(self, measured: Measured, gains: HedgedInversionGains) -> HedgedInversionMemory:
        """The reference models where the vehicle is."""
        zero = vector(0.0, 0.0, 0.0)
        return HedgedInversionMemory(
            place=measured.position,
            speed=measured.velocity,
            model=FilteredAttitude(measured.attitude, measured.rates, zero),
            weights_1=gains.weights_1,
            weights_2=gains.weights_2,
            flying=0.0,
            asked=zero,
            force=vector(0.0, 0.0, gains.mass * gains.gravity),
            wanted=LedAttitude(measured.attitude, zero, zero),
            r1=zero,
            thrust=measured.thrust,
            torque=measured.torque,
            asked_torque=measured.torque,
            asked_turn=zero,
        )

    def guide(
        self, memory: HedgedInversionMemory, measured: Measured, reference: Reference,
        gains: HedgedInversionGains, t: Number, period: Number,
    ) -> HedgedInversionMemory:  # fmt: skip
        """Outer loop: pseudo-control a_des = a_r + a_pd + a_ad, the force and attitude that make it, hedge, learning."""
        flying = where(measured.thrust > AIRBORNE * gains.mass * gains.gravity, 1.0, memory.flying)
        on = flying * where(t >= gains.learning_start, 1.0, 0.0)
        axis, down = up_axis(rotation_matrix(measured.attitude)), vector(0.0, 0.0, gains.gravity)
        place = flying * memory.place + (1.0 - flying) * measured.position  # on the ground the model stays where it is
        speed = flying * memory.speed + (1.0 - flying) * measured.velocity
        e, e_dot = place - measured.position, speed - measured.velocity
        r = learnt_from(gains.damping_1, e, e_dot)
        model = gains.stiffness_1 * (reference.position - place) + gains.damping_1 * (reference.velocity - speed)
        a_r = reference.acceleration + model
        inputs = (*(measured.velocity * (1.0 / SPEED)), *axis, *(memory.asked * (1.0 / GRAVITY)))
        mu = basis(gains.force_net, inputs)
        a_ad = on * output(memory.weights_1, mu)
        asked = a_r + gains.stiffness_1 * e + gains.damping_1 * e_dot + a_ad
        force = within(gains.mass * (asked + down), gains.most_thrust)
        wanted = attitude_for(force, reference, gains.mass)

        made = (memory.thrust / gains.mass) * axis - down
        hedge = memory.asked - made
        model_speed = speed + (flying * period) * (a_r - hedge)
        change = weight_rate(gains.force_net, memory.weights_1, mu, on * period * r, on * period * size(e, e_dot))
        return memory._replace(
            place=place + period * model_speed,
            speed=model_speed,
            weights_1=project_weights(memory.weights_1 + change, gains.weight_bounds[0]),
            flying=flying,
            asked=asked,
            force=force,
            wanted=led_by(wanted),
            r1=r,
        )

    def law(
        self, memory: HedgedInversionMemory, measured: Measured, reference: Reference,
        gains: HedgedInversionGains, t: Number, period: Number,
    ) -> tuple[Command, HedgedInversionMemory]:  # fmt: skip
        """Inner loop: pseudo-control of the body rates, the torque that makes it, hedge, learning."""
        on = memory.flying * where(t >= gains.learning_start, 1.0, 0.0)
        rates, rotation = measured.rates, rotation_matrix(measured.attitude)
        share = where(memory.flying > 0.5, 1.0 - exp(-(period / maximum(gains.lag, 1e-6))), 1.0)
        thrust = memory.thrust + share * (measured.thrust - memory.thrust)
        torque = memory.torque + share * (measured.torque - memory.torque)
        over = Vector(1.0 / entry for entry in gains.inertia)

        turn_r = led_acceleration(memory.model, memory.wanted, gains.stiffness_2, gains.damping_2)
        between = multiply(conjugate(measured.attitude), memory.model.attitude)  # from the reference model's into the body's
        into_body = rotation_matrix(between)
        model_rates = into_body @ memory.model.rates
        e, e_dot = rotation_vector(between), model_rates - rates
        r = learnt_from(gains.damping_2, e, e_dot)
        inputs = (
            *((rotation.T @ measured.velocity) * (1.0 / SPEED)),
            *(rates * (1.0 / RATE)),
            *(memory.asked_turn * (1.0 / TURN)),
        )
        mu = basis(gains.torque_net, inputs)
        learnt = on * output(memory.weights_2, mu)
        seen = into_body @ turn_r - cross(rates, model_rates)
        asked = seen + gains.stiffness_2 * e + gains.damping_2 * e_dot + learnt
        asked_torque = gains.inertia * asked + cross(rates, gains.inertia * rates)

        hedge = into_body.T @ (over * (memory.asked_torque - torque))
        change = weight_rate(gains.torque_net, memory.weights_2, mu, on * period * r, on * period * size(e, e_dot))
        command = Command(
            thrust=maximum(memory.force @ up_axis(rotation), 0.0),
            torque=asked_torque,
            desired_attitude=yaw_pitch_roll(memory.wanted.attitude),
            r1=memory.r1,
            r2=r,
            weight_norms=vector(memory.weights_1.norm(), memory.weights_2.norm()),
        )
        return command, memory._replace(
            model=led_filter(memory.model, turn_r, hedge, period),
            weights_2=project_weights(memory.weights_2 + change, gains.weight_bounds[1]),
            thrust=thrust,
            torque=torque,
            asked_torque=asked_torque,
            asked_turn=asked,
        )


def size(e: Vector, e_dot: Vector) -> Number:
    """|(e, e_dot)|."""
    return length(e @ e + e_dot @ e_dot, (*e, *e_dot))
