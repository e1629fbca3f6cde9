"""The tables of a vehicle's file: mounts, rotors, drag, battery, effects, commands, IMU, prediction, residual."""

from typing import Annotated, Literal

from pydantic import Field

from quadstep.mission.fields import (
    Coefficient,
    Finite,
    NonNegative,
    NonNegativeTriple,
    Pair,
    Positive,
    PositiveCoefficient,
    Quantity,
    Section,
    Several,
    Share,
    Triple,
)
from quadstep.numbers import Vector, matrix
from quadstep.vehicle.airframe_plant import INPUTS, OUTPUTS, Residual
from quadstep.vehicle.rigid_body import Mount
from quadstep.vehicle.rotor import RotorParameters


class MountSection(Section):
    """Position, thrust direction and spin of a rotor."""

    position: Annotated[Triple, Quantity("m", "position in body axes")]
    axis: Annotated[Triple, Quantity("", "unit vector of its thrust")] = (0.0, 0.0, 1.0)
    spin: Annotated[Literal["ccw", "cw"], Quantity("", "direction of spin, viewed against its axis")]

    def model_post_init(self, context: object) -> None:
        length = Vector(self.axis).norm()
        if abs(length - 1.0) > 1e-3:
            raise ValueError(f"axis must have length 1, not {length:g}")

    def build(self) -> Mount:
        """The mount as structure; its axis made exactly one long."""
        x, y, z = Vector(self.axis) / Vector(self.axis).norm()
        return Mount(self.position, (x, y, z), 1 if self.spin == "ccw" else -1)


class RotorSection(Section):
    """One rotor; all are alike."""

    thrust_coefficient: Annotated[PositiveCoefficient, Quantity("N s^2", "k_f, thrust over speed squared")]
    torque_coefficient: Annotated[Coefficient, Quantity("N m s^2", "k_m, torque over speed squared")]
    inertia: Annotated[Coefficient, Quantity("kg m^2", "J_r, inertia of rotor and motor bell about the axis")] = 0.0
    rise_time: Annotated[Positive, Quantity("s", "time constant of rising speed")]
    fall_time: Annotated[Positive, Quantity("s", "time constant of falling speed")]
    slowest: Annotated[NonNegative, Quantity("rad/s", "smallest speed")] = 0.0
    fastest: Annotated[Positive, Quantity("rad/s", "largest speed")]
    radius: Annotated[Positive, Quantity("m", "radius, from axis to blade tip")]

    def model_post_init(self, context: object) -> None:
        if self.fastest <= self.slowest:
            raise ValueError(f"fastest = {self.fastest:g} rad/s must be above slowest = {self.slowest:g} rad/s")

    def build(self) -> RotorParameters:
        thrust, torque = self.thrust_coefficient, self.torque_coefficient
        return self.as_numbers(RotorParameters, thrust=thrust, torque=torque, rise=self.rise_time, fall=self.fall_time)


class DragSection(Section):
    """Aerodynamic forces and moments on the vehicle, from its airspeed in body axes."""

    parasitic: Annotated[NonNegativeTriple, Quantity("N s^2/m^2", "body drag per airspeed squared")] = (0.0, 0.0, 0.0)
    rotor: Annotated[NonNegativeTriple, Quantity("N s^2/(m rad)", "rotor drag per rotor speed and airspeed")] = (0.0, 0.0, 0.0)
    flapping: Annotated[Coefficient, Quantity("N m s^2/(m rad)", "hub moment per rotor speed and airspeed")] = 0.0
    translational_lift: Annotated[Coefficient, Quantity("N s^2/m^2", "extra thrust per squared airspeed across the rotor")] = (
        0.0
    )

    def model_post_init(self, context: object) -> None:
        if self.rotor[0] != self.rotor[1]:
            raise ValueError(
                f"rotor: the first two entries, both in the disc, must be equal, not {self.rotor[0]:g} and {self.rotor[1]:g}"
            )


class BatterySection(Section):
    """The battery. It has no influence unless the effect `battery` is on."""

    full: Annotated[Positive, Quantity("V", "voltage when full")]
    empty: Annotated[Positive, Quantity("V", "voltage when empty")]
    capacity: Annotated[Positive, Quantity("C", "charge from full to empty")]
    resistance: Annotated[NonNegative, Quantity("ohm", "resistance of cells and wires")]
    efficiency: Annotated[Share, Quantity("", "efficiency of motors and speed controllers")]

    def model_post_init(self, context: object) -> None:
        if self.empty >= self.full:
            raise ValueError(f"empty = {self.empty:g} V must be below full = {self.full:g} V")
        if self.efficiency == 0.0:
            raise ValueError("efficiency must be greater than 0")


class EffectsSection(Section):
    """Optional effects to simulate."""

    battery: Annotated[bool, Quantity("", "voltage sag and discharge")] = False
    ground: Annotated[bool, Quantity("", "ground effect: extra lift near the ground")] = False
    gyroscopic: Annotated[bool, Quantity("", "gyroscopic and spin-up torque of the rotors")] = True
    drag: Annotated[bool, Quantity("", "all effects in the table `drag`")] = True
    residual: Annotated[bool, Quantity("", "the learned residual, if the vehicle has one")] = False


MOST_LATE = 250
"""Commands on their way to the rotors."""


class CommandSection(Section):
    """How a logged motor command c (fraction of full) maps to rotor speed: after `delay`, the rotor is commanded to
    speed c^exponent (V / nominal_voltage)^voltage_exponent. A simulated flight uses only the delay.
    """

    speed: Annotated[Positive, Quantity("rad/s", "rotor speed at full command and nominal voltage")]
    exponent: Annotated[Positive, Quantity("", "exponent of the command")] = 1.0
    voltage_exponent: Annotated[NonNegative, Quantity("", "exponent of the voltage")] = 1.0
    nominal_voltage: Annotated[Positive, Quantity("V", "voltage at which `speed` is reached")] = 1.0
    delay: Annotated[NonNegative, Quantity("s", "delay from a command to the rotors")] = 0.0


class ImuSection(Section):
    """Orientation of a log's axes relative to the rotors'."""

    tilt: Annotated[Pair, Quantity("rad", "rotation about x and y from the measured axes to the rotor axes")] = (0.0, 0.0)


class PredictionSection(Section):
    """How a prediction starts from a log and continues without it (`quadstep replay`); pairs are [x and y, z]."""

    rates: Annotated[Pair, Quantity("", "correction gain on the difference in rates")]
    attitude: Annotated[Pair, Quantity("", "correction gain on the difference in attitude")]
    velocity: Annotated[Pair, Quantity("", "correction gain on the difference in velocity")]
    torque: Annotated[Pair, Quantity("1/s", "gain of the decaying angular acceleration")]
    torque_fade: Annotated[Pair, Quantity("1/s", "decay rate of the angular acceleration")]
    trend: Annotated[Pair, Quantity("1/s", "gain of the constant angular acceleration")]
    force: Annotated[Pair, Quantity("1/s", "gain of the decaying acceleration")]
    force_fade: Annotated[Pair, Quantity("1/s", "decay rate of the acceleration")]
    authority: Annotated[Pair, Quantity("", "share of the commanded torque that is trusted")] = (1.0, 1.0)
    leak: Annotated[Pair, Quantity("1/s", "feedback of the rates to zero")] = (0.0, 0.0)
    spring: Annotated[Finite, Quantity("1/s^2", "feedback of the difference between tilt and setpoint tilt")] = 0.0
    path: Annotated[Finite, Quantity("1/s^2", "acceleration per metre of distance from the setpoint")] = 0.0
    drift: Annotated[Finite, Quantity("1/s", "acceleration against the velocity")] = 0.0
    delay: Annotated[NonNegative, Quantity("s", "delay of the commands, in addition to the rotor lag")] = 0.0
    reach: Annotated[Positive, Quantity("m/s^2", "largest acceleration towards the setpoint")] = 1e3
    steepest: Annotated[Positive, Quantity("", "tangent of the largest tilt for the setpoint")] = 0.5


class ResidualSection(Section):
    """Weights of a small network for accelerations that the laws do not explain (`quadstep.vehicle.airframe_plant`).

    Shapes: (hidden, 7), (hidden), (6, hidden), (6).
    """

    inputs: Annotated[Several[Several[Finite]], Quantity("", "input weights, one row per neuron")]
    biases: Annotated[Several[Finite], Field(min_length=1, max_length=64), Quantity("", "biases of the neurons")]
    outputs: Annotated[Several[Several[Finite]], Quantity("", "output weights, one row per output")]
    offsets: Annotated[Several[Finite], Quantity("", "offsets of the outputs")]

    def model_post_init(self, context: object) -> None:
        hidden = len(self.biases)
        for name, rows, count, width in (
            ("inputs", self.inputs, hidden, INPUTS),
            ("outputs", self.outputs, OUTPUTS, hidden),
            ("offsets", (self.offsets,), 1, OUTPUTS),
        ):
            if len(rows) != count or any(len(row) != width for row in rows):
                raise ValueError(f"{name}: should have {count} rows of {width} numbers, as biases has {hidden}")

    def build(self) -> Residual:
        return Residual(matrix(*self.inputs), Vector(self.biases), matrix(*self.outputs), Vector(self.offsets))
