"""Active disturbance rejection with linear extended-state observers: Gao, "Scaling and bandwidth-parameterization based
controller tuning" (2003).

Whatever moves the vehicle beside its rotors is one more state, and an observer with all its poles at -w_o finds it:

    p^_dot = v^ + 3 w_o e,    v^_dot = d^ + u + 3 w_o^2 e,    d^_dot = w_o^3 e,      e = p - p^
    W^_dot = d^ + J^-1 (tau - W x J W) + 2 w_o e,             d^_dot = w_o^2 e,      e = W - W^

The law subtracts d^ and drives what is left, a double integrator, with both poles at -w_c: k_p = w_c^2, k_d = 2 w_c.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import (
    ZERO,
    AchievedCommand,
    BelievedBody,
    Pull,
    Turn,
    accelerations,
    angular_of,
    at_rest,
    attitude_for,
    boxed,
    commanded,
    errors_to,
    force_for,
    lagged,
    pulled,
    push_against,
    torque_for,
    turned,
    up_axis,
)
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import gain, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector
from quadstep.numbers.rotations import rotation_matrix


class AdrcGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its bandwidths, of the attitude about body x, y, z."""

    body: BelievedBody
    bandwidth: Vector = gain(usual(2.57, 1), "1/s", "bandwidth of the position loop", symbol="w_c")
    turn_bandwidth: Vector = gain(usual((9.6, 9.6, 10.0), 1, "body"), "1/s", "bandwidth of the attitude loop", symbol="w_cR")
    observer: Number = gain(usual(11.4, 1), "1/s", "bandwidth of the position observer", symbol="w_o")
    turn_observer: Vector = gain(usual((10.2, 10.2, 11.4), 1, "body"), "1/s", "bandwidth of the rate observer", symbol="w_oR")
    bound: Number = gain(15.0, "m/s^2", "largest estimated disturbance along an axis", tunable=False)
    turn_bound: Number = gain(150.0, "rad/s^2", "largest estimated disturbance about an axis", tunable=False)


class AdrcMemory(NamedTuple):
    """What the observers say. position [m], velocity [m/s], disturbance [m/s^2]: world. rates [rad/s], turning [rad/s^2]: body
    axes, disturbance of the latter. made: by the rotors.
    """

    position: Vector
    velocity: Vector
    disturbance: Vector
    rates: Vector
    turning: Vector
    made: AchievedCommand


@dataclass(frozen=True)
class Adrc(Controller):
    """Observers and law at the attitude loop's rate."""

    name = "adrc"
    label = "ADRC (linear ESO)"
    source = "Gao 2003"
    Gains = AdrcGains

    def start(self, measured: Measured, gains: AdrcGains) -> AdrcMemory:
        """The observers where the vehicle is; no disturbance."""
        return AdrcMemory(measured.position, measured.velocity, ZERO, measured.rates, ZERO, at_rest(gains.body))

    def enter(self, measured: Measured, reference: Reference, gains: AdrcGains) -> AdrcMemory:
        """The observers where the vehicle is; the disturbance is what the present command makes up for."""
        body = gains.body
        return self.start(measured, gains)._replace(
            disturbance=boxed(-push_against(measured, reference, body), gains.bound),
            turning=boxed(-angular_of(measured.torque, measured, body), gains.turn_bound),
            made=commanded(measured),
        )

    def law(
        self, memory: AdrcMemory, measured: Measured, reference: Reference, gains: AdrcGains, t: Number, period: Number
    ) -> tuple[Command, AdrcMemory]:
        memory = self.observed(memory, measured, gains, t, period)
        body, w_c, w_r = gains.body, gains.bandwidth, gains.turn_bandwidth
        wanted = pulled(measured, reference, Pull(w_c * w_c, 2.0 * w_c))
        force = force_for(wanted - memory.disturbance, body)
        attitude = attitude_for(force, reference, body.mass)
        errors = errors_to(attitude, measured)
        angular = turned(errors, Turn(w_r * w_r, 2.0 * w_r)) - memory.turning
        thrust = force @ up_axis(rotation_matrix(measured.attitude))
        return Command(thrust, torque_for(angular, measured, body), attitude.angles), memory

    def observed(self, memory: AdrcMemory, measured: Measured, gains: AdrcGains, t: Number, period: Number) -> AdrcMemory:
        """The observers at time t [s], a period [s] later."""
        body, w, w_r = gains.body, gains.observer, gains.turn_observer
        made = lagged(memory.made, measured, body.lag, t, period)
        pushed, spun = accelerations(made, measured, body)
        off, off_r = measured.position - memory.position, measured.rates - memory.rates
        return AdrcMemory(
            position=memory.position + period * (memory.velocity + (3.0 * w) * off),
            velocity=memory.velocity + period * (memory.disturbance + pushed + (3.0 * w * w) * off),
            disturbance=boxed(memory.disturbance + (period * (w * w * w)) * off, gains.bound),
            rates=memory.rates + period * (memory.turning + spun + 2.0 * (w_r * off_r)),
            turning=boxed(memory.turning + period * (w_r * (w_r * off_r)), gains.turn_bound),
            made=made,
        )
