"""A controller of your own, compiled with the rest: `python examples/own_controller.py`.

A cascaded PD on the path of Case 1 in 10 s, beside the paper's controller. The law is written once, over numbers: no `if` on
a number, no `math`, but `where`, `sin`, ... from `quadstep.own`.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.vectoring import invert_force
from quadstep.own import Command, Controller, Model, Number, Reference, State, believed, gain, given, vector


class Gains(NamedTuple):
    """The gains, each with its default, its unit and what it is."""

    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    k_p: Number = gain(2.0, "1/s^2", "position")
    k_v: Number = gain(3.0, "1/s", "velocity")
    k_r: Number = gain(4000.0, "N m", "attitude")
    k_w: Number = gain(300.0, "N m s", "angular rates")


class Memory(NamedTuple):
    """Nothing to remember."""


@dataclass(frozen=True)
class CascadedPD(Controller):
    """Force from the position error, attitude from the force, torque from the attitude error."""

    name = "cascaded-pd"
    label = "cascaded PD"
    Gains = Gains
    measures = State

    def start(self, measured: State, gains: Gains) -> Memory:
        """The memory before the first sample."""
        return Memory()

    def law(
        self, memory: Memory, measured: State, reference: Reference, gains: Gains, t: Number, period: Number
    ) -> tuple[Command, Memory]:
        """One sample."""
        offset, drift = reference.position - measured.position, reference.velocity - measured.velocity
        acceleration = reference.acceleration + gains.k_p * offset + gains.k_v * drift + vector(0.0, 0.0, gains.gravity)
        thrust, theta_d, phi_d = invert_force(gains.mass * acceleration)
        desired = vector(reference.yaw, theta_d, phi_d)
        torque = gains.k_r * (desired - measured.attitude) - gains.k_w * measured.rates
        return Command(thrust, torque, desired), memory


if __name__ == "__main__":
    from quadstep import Mission, flight_metrics, fly

    path = {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 10.0}
    paper = Mission.model_validate({"path": path}).plan()
    own = paper.with_controller(CascadedPD(), CascadedPD.gains(Model(mass=1.0, inertia=vector(5.0, 5.0, 5.0), gravity=9.81)))
    for name, plan in (("the paper's", paper), ("my own", own)):
        print(f"{name}: position RMSE {1e3 * flight_metrics(fly(plan))['position_rmse[m]']:.3g} mm")
