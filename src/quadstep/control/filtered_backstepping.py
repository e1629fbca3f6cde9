"""Adaptive backstepping with function approximation and command filters: the paper's reference [18].

Farrell, Sharma, Polycarpou, "Backstepping-based flight control with adaptive function approximation", Journal of Guidance,
Control, and Dynamics 28 (2005), for a rigid body with one thrust: place, speed, attitude, body rates, in this order.

Each stage asks the next for its state. What is asked for is filtered, so that its rate is known, and what the filter, the
rotors' limits and the next stage make of it is compensated: with x~ = x - x_c the tracking error and xi the compensation,

    xi_i' = -k_i xi_i + (x_(i+1),c - what was asked for) + the next stage's xi

the compensated error x~ - xi has dynamics in which neither filters nor limits appear. Only from it is learnt. The next
stage's xi stands in xi_i' as in the authors' later form (IEEE Transactions on Automatic Control 54, 2009); [18] takes it off
what is asked for, where it is differentiated: with the lag of rotors that is unstable.

What is learnt are unknown accelerations, as local basis functions: for the place of the speed along each axis; for the body
of the sideways airspeed that twists about an axis, about its third of the yaw rate.

What a path is known to do (velocity, acceleration, the turn of its wanted attitude) is not filtered, only the feedback is.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.filters import (
    Filtered,
    FilteredAttitude,
    LedAttitude,
    command_filter,
    led_acceleration,
    led_by,
    led_filter,
)  # fmt: skip
from quadstep.control.rotation_backstepping import AIRBORNE
from quadstep.control.vectoring import attitude_for, project_weights, up_axis, within
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import NETS, believed, gain, given, usual
from quadstep.interfaces.learning import NODES, growth, hats, values
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, maximum, vector, where
from quadstep.numbers.rotations import conjugate, cross, multiply, rotation_matrix, rotation_vector, yaw_pitch_roll

UP = vector(0.0, 0.0, 1.0)


class FilteredBacksteppingGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains in x, y, z; of attitude and rates about body x, y, z.

    most_thrust: that the position loop may ask for [N].
    """

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    place: Vector = gain(usual(1.47, 1), "1/s", "gain of the position", key="k_1")
    speed: Vector = gain(usual(3.96, 1), "1/s", "gain of the velocity", key="k_2")
    turn: Vector = gain(usual((3.1, 3.1, 4.0), 1, "body"), "1/s", "gain of the attitude", key="k_3")
    spin: Vector = gain(usual((15.3, 15.3, 14.0), 1, "rate"), "1/s", "gain of the body rates", key="k_4")
    coupling_1: Number = gain(usual(0.65, 2), "1/s^2", "weight of position against velocity", key="c_1")
    coupling_2: Number = gain(usual(0.036, 4), "1/m^2", "weight of velocity against body rates", key="c_2")
    coupling_3: Vector = gain(
        usual((20.0, 20.0, 20.0), 2, "body"), "1/s^2", "weight of attitude against body rates", key="c_3"
    )
    speed_filter: Number = gain(usual(14.4, 1), "rad/s", "bandwidth of the velocity command filter")
    turn_filter: Vector = gain(usual((13.9, 13.9, 15.5), 1, "body"), "rad/s", "bandwidth of the attitude command filter")
    spin_filter: Number = gain(usual(45.0, 1), "rad/s", "bandwidth of the body-rate command filter")
    learning_1: Number = gain(usual(6.7, 2), "1/s^2", "learning rate of the velocity functions", zero=True, group=NETS)
    learning_2: Number = gain(usual(19.5, 2), "1/s^2", "learning rate of the body-rate functions", zero=True, group=NETS)
    spacing: Vector = gain(
        (3.0, 1.0), "m/s, rad/s", "spacing of the nodes in speed and yaw rate", parts=("speed", "rate"), group=NETS
    )
    weight_bounds: Vector = gain(
        (30.0, 100.0), "m/s^2, rad/s^2", "bounds on the norms of the weights", parts=("speed", "rate"), group=NETS
    )


class FilteredBacksteppingMemory(NamedTuple):
    """The command filters: speed_fed and spin_fed, of the feedback in what is asked of speed and body rates; attitude.

    The compensations: xi_1 [m], xi_2 [m/s], xi_3 [rad], xi_4 [rad/s]. weights_1 [m/s^2], weights_2 [rad/s^2]: of the
    functions, shape (NODES, 3). flying: whether it has taken off (0 or 1). From `guide` to `law`: asked [m/s^2], force [N],
    wanted; compensated, the speed's error [m/s]. asked_torque: of the last sample [N m].
    """

    speed_fed: Filtered
    spin_fed: Filtered
    attitude: FilteredAttitude
    xi_1: Vector
    xi_2: Vector
    xi_3: Vector
    xi_4: Vector
    weights_1: Matrix
    weights_2: Matrix
    flying: Number
    asked: Vector
    force: Vector
    wanted: LedAttitude
    compensated: Vector
    asked_torque: Vector


@dataclass(frozen=True)
class FilteredBackstepping(Controller):
    """`guide` is the position and velocity loop, `law` the attitude and rate loop."""

    name = "filtered-backstepping"
    label = "command-filtered backstepping [18]"
    source = "Farrell, Sharma, Polycarpou 2005"
    Gains = FilteredBacksteppingGains

    def start(self, measured: Measured, gains: FilteredBacksteppingGains) -> FilteredBacksteppingMemory:
        """Nothing compensated, nothing learnt, the attitude's filter at the measured attitude."""
        zero = vector(0.0, 0.0, 0.0)
        nothing = Matrix(zero for _ in range(NODES))
        return FilteredBacksteppingMemory(
            speed_fed=Filtered(zero, zero),
            spin_fed=Filtered(zero, zero),
            attitude=FilteredAttitude(measured.attitude, measured.rates, zero),
            xi_1=zero,
            xi_2=zero,
            xi_3=zero,
            xi_4=zero,
            weights_1=nothing,
            weights_2=nothing,
            flying=0.0,
            asked=zero,
            force=vector(0.0, 0.0, gains.mass * gains.gravity),
            wanted=LedAttitude(measured.attitude, zero, zero),
            compensated=zero,
            asked_torque=measured.torque,
        )

    def guide(
        self, memory: FilteredBacksteppingMemory, measured: Measured, reference: Reference,
        gains: FilteredBacksteppingGains, t: Number, period: Number,
    ) -> FilteredBacksteppingMemory:  # fmt: skip
        """Stages of place and speed: the acceleration asked for, and the force and attitude that make it."""
        flying = where(measured.thrust > AIRBORNE * gains.mass * gains.gravity, 1.0, memory.flying)
        down = gains.gravity * UP
        speed = reference.velocity + memory.speed_fed.value
        speed_rate = reference.acceleration + memory.speed_fed.rate
        place_error, speed_error = measured.position - reference.position, measured.velocity - speed
        place_left, speed_left = place_error - memory.xi_1, speed_error - memory.xi_2

        feedback = -(gains.place * place_error)
        regressors = tuple(hats(one, gains.spacing[0]) for one in measured.velocity)
        unknown = values(memory.weights_1, regressors)
        asked = speed_rate - gains.speed * speed_error - gains.coupling_1 * place_left - unknown
        force = within(gains.mass * (asked + down), gains.most_thrust)
        wanted = attitude_for(force, reference, gains.mass)

        made = measured.thrust / gains.mass
        turned = rotation_matrix(measured.attitude) @ cross(memory.xi_3, UP)  # what xi_3 does to the thrust's axis
        could = made * up_axis(rotation_matrix(memory.attitude.attitude)) - down
        rate_1 = -(gains.place * memory.xi_1) + (memory.speed_fed.value - feedback) + memory.xi_2
        rate_2 = -(gains.speed * memory.xi_2) + (could - memory.asked) + made * turned
        change = (flying * period * gains.learning_1) * growth(regressors, speed_left)
        return memory._replace(
            speed_fed=command_filter(memory.speed_fed, feedback, gains.speed_filter, period),
            xi_1=memory.xi_1 + (flying * period) * rate_1,
            xi_2=memory.xi_2 + (flying * period) * rate_2,
            weights_1=project_weights(memory.weights_1 + change, gains.weight_bounds[0]),
            flying=flying,
            asked=asked,
            force=force,
            wanted=led_by(wanted),
            compensated=speed_left,
        )

    def law(
        self, memory: FilteredBacksteppingMemory, measured: Measured, reference: Reference,
        gains: FilteredBacksteppingGains, t: Number, period: Number,
    ) -> tuple[Command, FilteredBacksteppingMemory]:  # fmt: skip
        """Stages of attitude and body rates: the torque asked for."""
        rates, rotation = measured.rates, rotation_matrix(measured.attitude)
        frequency = gains.turn_filter
        turning = led_acceleration(memory.attitude, memory.wanted, frequency * frequency, 2.0 * frequency)
        between = multiply(conjugate(measured.attitude), memory.attitude.attitude)
        into_body = rotation_matrix(between)
        led = into_body @ memory.attitude.rates
        spin = led + memory.spin_fed.value
        spin_rate = into_body @ turning - cross(rates, led) + memory.spin_fed.rate
        turn_error, spin_error = -rotation_vector(between), rates - spin
        turn_left, spin_left = turn_error - memory.xi_3, spin_error - memory.xi_4

        made = measured.thrust / gains.mass
        leaning = cross(UP, rotation.T @ memory.compensated)
        pull = (gains.coupling_2 * made) * leaning / gains.coupling_3
        feedback = -(gains.turn * turn_error) - pull
        airspeed = rotation.T @ measured.velocity
        sideways, yawing = gains.spacing
        regressors = (hats(airspeed[1], sideways), hats(airspeed[0], sideways), hats(rates[2], yawing))
        unknown = values(memory.weights_2, regressors)
        asked = spin_rate - gains.spin * spin_error - gains.coupling_3 * turn_left - unknown
        torque = gains.inertia * asked + cross(rates, gains.inertia * rates)

        short = (measured.torque - memory.asked_torque) / gains.inertia
        rate_3 = -(gains.turn * memory.xi_3) + (memory.spin_fed.value - feedback) + memory.xi_4
        rate_4 = -(gains.spin * memory.xi_4) + short
        flown = memory.flying * period
        change = (flown * gains.learning_2) * growth(regressors, spin_left)
        command = Command(
            thrust=maximum(memory.force @ up_axis(rotation), 0.0),
            torque=torque,
            desired_attitude=yaw_pitch_roll(memory.wanted.attitude),
            r1=-memory.compensated,
            r2=-spin_left,
            weight_norms=vector(memory.weights_1.norm(), memory.weights_2.norm()),
        )
        return command, memory._replace(
            spin_fed=command_filter(memory.spin_fed, feedback, gains.spin_filter, period),
            attitude=led_filter(memory.attitude, turning, vector(0.0, 0.0, 0.0), period),
            xi_3=memory.xi_3 + flown * rate_3,
            xi_4=memory.xi_4 + flown * rate_4,
            weights_2=project_weights(memory.weights_2 + change, gains.weight_bounds[1]),
            asked_torque=torque,
        )
