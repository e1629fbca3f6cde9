"""What a flight of a real vehicle takes beside its errors, summed while it flies: `metrics = ["energy", "saturation"]`.

They read the columns of the log, so a flight with a log and one without give the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Generic, NamedTuple, Self, TypeVar

from quadstep.interfaces.log import Metric
from quadstep.metrics.quantities import as_it_turns
from quadstep.numbers import Number, Vector, absolute, maximum, sqrt, total, where
from quadstep.vehicle.airframe_plant import Airframe

B = TypeVar("B", float, Vector)

SHORTFALL = 1e-3
"""What the rotors could not make counts as saturation from this share of the weight on; a tenth of it at 1 m for torques."""


class OverTime(NamedTuple, Generic[B]):
    """first, last: times of samples [s]. before: what was there at the last of them. sum: so far."""

    first: Number
    last: Number
    before: B
    sum: Number


def thrusts(sample: Mapping[str, Number], rotors: int) -> list[Number]:
    """Of each rotor [N], as it turns: what a fault takes from its thrust it takes from the battery none the less."""
    return [sample[as_it_turns(f"f{place}", sample)] for place in range(1, rotors + 1)]


@dataclass(frozen=True)
class EffortMetric(Metric):
    """A metric of vehicles with rotors of their own. rotors: how many. weight [N]. power: of a rotor, over thrust to 3/2."""

    rotors: int = 0
    weight: float = 1.0
    power: float = 1.0

    def of_vehicle(self, airframe: Airframe, rotors: int) -> Self:
        """The metric of a vehicle's flights."""
        rotor = airframe.rotor
        power = rotor.torque / (rotor.thrust * sqrt(rotor.thrust)) / airframe.battery.efficiency
        return type(self)(rotors, float(airframe.mass * airframe.gravity), float(power))


@dataclass(frozen=True)
class Energy(EffortMetric):
    """What the rotors take from the battery [J]: integral of sum k_m w^3 over the efficiency, w from the rotors' thrusts."""

    name: ClassVar[str] = "energy"
    unit: ClassVar[str] = "J"

    def start(self) -> OverTime[Number]:
        return OverTime(-1.0, 0.0, 0.0, 0.0)

    def add(self, sums: OverTime[Number], sample: Mapping[str, Number]) -> OverTime[Number]:
        """The trapezium since the last sample."""
        power = self.power * total(one * sqrt(maximum(one, 0.0)) for one in thrusts(sample, self.rotors))
        new = sums.first < 0.0
        more = 0.5 * (power + sums.before) * (sample["t"] - sums.last)
        return OverTime(where(new, sample["t"], sums.first), sample["t"], power, sums.sum + where(new, 0.0, more))

    def value(self, sums: OverTime[Number]) -> Number:
        return sums.sum


@dataclass(frozen=True)
class RotorActivity(EffortMetric):
    """The total absolute change of all rotors' thrusts per second [N/s]."""

    name: ClassVar[str] = "rotor_activity"
    unit: ClassVar[str] = "N/s"

    def start(self) -> OverTime[Vector]:
        return OverTime(-1.0, 0.0, Vector([0.0] * self.rotors), 0.0)

    def add(self, sums: OverTime[Vector], sample: Mapping[str, Number]) -> OverTime[Vector]:
        """The changes since the last sample."""
        now = thrusts(sample, self.rotors)
        new = sums.first < 0.0
        more = total(absolute(one - before) for one, before in zip(now, sums.before, strict=True))
        return OverTime(where(new, sample["t"], sums.first), sample["t"], Vector(now), sums.sum + where(new, 0.0, more))

    def value(self, sums: OverTime[Vector]) -> Number:
        """A second; 0 of a single sample."""
        time = sums.last - sums.first
        return sums.sum / where(time > 0.0, time, 1.0)


class SampleCounts(NamedTuple):
    """Samples, and those of them that count."""

    samples: Number
    counting: Number


@dataclass(frozen=True)
class Saturation(EffortMetric):
    """The share of samples at which the rotors' limits left less than was asked for [-]."""

    name: ClassVar[str] = "saturation"

    def start(self) -> SampleCounts:
        return SampleCounts(0.0, 0.0)

    def add(self, sums: SampleCounts, sample: Mapping[str, Number]) -> SampleCounts:
        missing = absolute(sample["u"] - sample["u_a"])
        for axis in ("tau_x", "tau_y", "tau_z"):
            missing = maximum(missing, 10.0 * absolute(sample[axis] - sample[f"{axis}_a"]))
        limited = missing > SHORTFALL * self.weight
        return SampleCounts(sums.samples + 1.0, sums.counting + where(limited, 1.0, 0.0))

    def value(self, sums: SampleCounts) -> Number:
        return sums.counting / maximum(sums.samples, 1.0)


EFFORT: dict[str, type[EffortMetric]] = {one.name: one for one in (Energy, RotorActivity, Saturation)}
"""By the name that a mission's `metrics` give."""
