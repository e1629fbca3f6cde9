"""A controller of your own for a real vehicle, compiled with the rest: `python examples/own_airframe_controller.py`."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from quadstep import flight_metrics, fly, read_mission
from quadstep.own import Command, Controller, Vector, believed, desired_attitude, rotation_matrix, up_axis, vector, vee_error


class Gains(NamedTuple):
    """What the controller assumes about the vehicle."""

    mass: float = believed("mass")
    inertia: Vector = believed("inertia")


@dataclass(frozen=True)
class ProportionalDerivative(Controller):
    """Force from the position error, torque from the attitude error."""

    name = "proportional-derivative"
    Gains = Gains

    def start(self, measured, gains):
        return ()

    def law(self, memory, measured, reference, gains, t, period):
        zero, rotation = vector(0.0, 0.0, 0.0), rotation_matrix(measured.attitude)
        pull = 6.0 * (reference.position - measured.position) + 4.0 * (reference.velocity - measured.velocity)
        force = gains.mass * (reference.acceleration + pull + vector(0.0, 0.0, 9.81))
        desired = desired_attitude(force, zero, zero, reference.yaw, 0.0).rotation
        torque = gains.inertia * (-120.0 * vee_error(desired, rotation) - 18.0 * measured.rates)
        return Command(thrust=force @ up_axis(rotation), torque=torque), memory


if __name__ == "__main__":
    mission = read_mission(Path(__file__).parent / "wind_tunnel.toml")
    plan = mission.plan()
    gains = ProportionalDerivative.gains(mission.vehicle.model())
    log = fly(plan.with_controller(ProportionalDerivative(), gains))
    print(log.outcome.name, flight_metrics(log, mission.score_from)["position_rmse[m]"])
