"""The rate loop that every controller shares which commands body rates: PI, with the gyroscopic torque fed forward."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

from quadstep.control.vectoring import angular_of, project, torque_for
from quadstep.interfaces.controller import BodyRates, Command, Condition, Controller, Measured
from quadstep.interfaces.gain import believed, cached_by_class, gain, usual
from quadstep.interfaces.plant import Model, Reference
from quadstep.io.errors import UserError
from quadstep.numbers import Number, Vector, vector


class RateGains(NamedTuple):
    """Of the rate loop, about body x, y, z."""

    inertia: Vector = believed("inertia")
    proportional: Vector = gain(usual((23.3, 23.3, 20.0), 1, "rate"), "1/s", "P gain of the rate loop", key="rate_p")
    integral: Vector = gain(usual((3.8, 3.8, 3.8), 2, "body"), "1/s^2", "I gain of the rate loop", key="rate_i", zero=True)
    bound: Number = gain(20.0, "rad/s^2", "largest angular acceleration from the rate loop's integral", key="rate_i_bound")


class RateFollowingGains(NamedTuple):
    """law: of the controller that commands body rates. rate_loop: of the loop that follows them."""

    law: object
    rate_loop: RateGains


class RateFollowingMemory(NamedTuple):
    """law: of the controller. integral: what I adds [rad/s^2]."""

    law: object
    integral: Vector


def rate_loop(
    gains: RateGains, integral: Vector, asked: BodyRates, measured: Measured, period: Number
) -> tuple[Command, Vector]:
    """Thrust and torque that follow body rates, and the integral one period [s] later."""
    error = asked.rates - measured.rates
    angular = gains.proportional * error + integral
    torque = torque_for(angular, measured, gains)
    command = Command(asked.thrust, torque, asked.desired_attitude)
    return command, project(integral + period * (gains.integral * error), gains.bound)


@dataclass(frozen=True)
class RateFollowing(Controller[RateFollowingMemory, Measured, RateFollowingGains, Command]):
    """A controller that commands body rates, with the rate loop at the rate of its `law`."""

    commander: Controller

    Commander: ClassVar[type[Controller]]

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:
        return cls(cls.Commander.for_vehicle(model))

    @classmethod
    def loops(cls) -> tuple[str, ...]:
        return cls.Commander.loops()

    def start(self, measured: Measured, gains: RateFollowingGains) -> RateFollowingMemory:
        return RateFollowingMemory(self.commander.start(measured, gains.law), vector(0.0, 0.0, 0.0))

    def enter(self, measured: Measured, reference: Reference, gains: RateFollowingGains) -> RateFollowingMemory:
        loop = gains.rate_loop
        turning = angular_of(measured.torque, measured, loop) + loop.proportional * measured.rates
        return RateFollowingMemory(self.commander.enter(measured, reference, gains.law), project(turning, loop.bound))

    def slower(
        self, loop: str, memory: RateFollowingMemory, measured: Measured, reference: Reference, gains: RateFollowingGains,
        t: Number, period: Number,
    ) -> RateFollowingMemory:  # fmt: skip
        return memory._replace(law=self.commander.slower(loop, memory.law, measured, reference, gains.law, t, period))

    def law(
        self, memory: RateFollowingMemory, measured: Measured, reference: Reference, gains: RateFollowingGains,
        t: Number, period: Number,
    ) -> tuple[Command, RateFollowingMemory]:  # fmt: skip
        """The controller's body rates, and the torque that follows them. Raises UserError for a controller that gives none."""
        answer: object = self.commander.law(memory.law, measured, reference, gains.law, t, period)
        if not isinstance(answer, tuple) or len(answer) != 2 or not isinstance(answer[0], BodyRates):
            raise UserError("law: should return a BodyRates and the memory")
        asked, remembered = answer
        command, integral = rate_loop(gains.rate_loop, memory.integral, asked, measured, period)
        return command, RateFollowingMemory(remembered, integral)

    def prepare(self, gains: RateFollowingGains, model: Model) -> RateFollowingGains:
        return RateFollowingGains(self.commander.prepare(gains.law, model), gains.rate_loop)

    def conditions(self, gains: RateFollowingGains, model: Model) -> Sequence[Condition]:
        return self.commander.conditions(gains.law, model)


@cached_by_class
def following_rates(controller: type[Controller]) -> type[Controller]:
    """A controller as it flies: one that commands body rates with the rate loop, any other as it is."""
    if controller.commands is not BodyRates:
        return controller
    gains: object = NamedTuple(f"{controller.__name__}Gains", [("law", controller.Gains), ("rate_loop", RateGains)])  # type: ignore[misc]
    return type(
        controller.__name__,
        (RateFollowing,),
        {
            "__doc__": controller.__doc__,
            "__module__": controller.__module__,
            "Commander": controller,
            "Gains": gains,
            **{name: getattr(controller, name) for name in TAKEN},
            "defaults": {f"law.{name}": value for name, value in controller.defaults.items()},
        },
    )


TAKEN = "name", "label", "source", "measures", "also_measures", "preview", "rates"
"""What is known of a controller whether it has the rate loop or not."""
