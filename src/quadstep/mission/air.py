"""The air of a mission: steady and swinging wind, a gust, turbulence."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, SerializeAsAny, WrapValidator

from quadstep.io.doors import WINDS
from quadstep.mission.fields import Duration, NonNegative, Positive, Quantity, Section, Triple
from quadstep.mission.own_thing import OwnSection, own_or
from quadstep.numbers import Vector
from quadstep.report.units import listed
from quadstep.world.air import DeclaredWind, Dryden, MovingAir, Wind

KNOT = 1852.0 / 3600.0

INTENSITIES = {"light": 15.0 * KNOT, "moderate": 30.0 * KNOT, "severe": 45.0 * KNOT}
"""Wind speed at 20 ft [m/s] for each intensity of low-altitude turbulence (MIL-F-8785C)."""

STILL = (0.0, 0.0, 0.0)


class GustSection(Section):
    """A 1-cosine gust."""

    velocity: Annotated[Triple, Quantity("m/s", "velocity at the peak of the gust")]
    start: Annotated[NonNegative, Quantity("s", "start of the gust")]
    length: Annotated[Duration, Quantity("s", "duration of the gust")]


class TurbulenceSection(Section):
    """Dryden turbulence at low altitude (MIL-F-8785C), seeded by the flight's noise.

    Its strength is either `wind_20` or `intensity`. airspeed is how fast the frozen field of gusts passes the vehicle. In
    still air that is zero: the field stands, and one gust blows all the time.
    """

    wind_20: Annotated[NonNegative | None, Quantity("m/s", "wind speed at 20 ft, which sets the strength")] = None
    intensity: Annotated[Literal["light", "moderate", "severe"] | None, Quantity("", "the strength in words instead")] = None
    height: Annotated[
        float,
        Field(ge=3.0, le=305.0, allow_inf_nan=False),
        Quantity("m", "height above ground; sets the length scale of the gusts"),
    ] = 6.096
    airspeed: Annotated[Positive | None, Quantity("m/s", "speed at which the gusts pass; default: the mean wind")] = None

    def model_post_init(self, context: object) -> None:
        if (self.wind_20 is None) == (self.intensity is None):
            raise ValueError(f"give either wind_20 [m/s] or intensity ({', '.join(INTENSITIES)})")

    @property
    def strength(self) -> float:
        """Wind speed at 20 ft [m/s]."""
        return INTENSITIES[self.intensity] if self.intensity else 0.0 if self.wind_20 is None else self.wind_20


class WindSection(Section):
    """Wind in world axes: mean + swing * sin(swing_frequency t), a gust, turbulence."""

    mean: Annotated[Triple, Quantity("m/s", "mean wind")] = STILL
    swing: Annotated[Triple, Quantity("m/s", "amplitude of a sinusoidal wind")] = STILL
    swing_frequency: Annotated[NonNegative, Quantity("rad/s", "frequency of the sinusoidal wind")] = 0.0
    gust: GustSection | None = None
    turbulence: TurbulenceSection | None = None

    def model_post_init(self, context: object) -> None:
        if any(self.swing) and not self.swing_frequency:
            raise ValueError("swing needs a swing_frequency [rad/s] above 0")

    def warnings(self) -> list[str]:
        """What is to be said against this air."""
        turbulence = self.turbulence
        if turbulence and turbulence.strength and turbulence.airspeed is None and not any(self.mean):
            return [
                "wind.turbulence: without a mean wind the gusts stand still, so that a single one blows all the time; "
                "airspeed [m/s] sets how fast they pass"
            ]
        return []

    def check(self, duration: float) -> None:
        """Raises ValueError for a gust that comes after a flight of `duration` [s]."""
        if self.gust and self.gust.start >= duration:
            raise ValueError(f"wind.gust.start: {self.gust.start:g} s is not before the flight's end at {duration:g} s")

    @property
    def air(self) -> MovingAir:
        """Its law, which stirs where there is turbulence to be computed."""
        return MovingAir(self.turbulence is not None)

    def build(self) -> Wind:
        gust = self.gust or GustSection(velocity=STILL, start=0.0, length=1.0)
        dryden = Dryden(0.0, 6.096, 1.0)
        if self.turbulence:
            dryden = Dryden(self.turbulence.strength, self.turbulence.height, self.turbulence.airspeed or 0.0)
        shape = {"gust": Vector(gust.velocity), "gust_start": gust.start, "gust_length": gust.length}
        return self.as_numbers(Wind, **shape, turbulence=dryden)


class OwnWindSection(OwnSection):
    """A wind of the user's own: its `type`, and a key for each of its numbers."""

    thing: ClassVar[DeclaredWind]

    def warnings(self) -> list[str]:
        return []

    def check(self, duration: float) -> None:
        """Any duration suits."""

    @property
    def air(self) -> DeclaredWind:
        return self.thing

    def build(self) -> object:
        return self.numbers()


if TYPE_CHECKING:
    AnyWind = WindSection | OwnWindSection
else:
    AnyWind = Annotated[SerializeAsAny[WindSection], WrapValidator(own_or(DeclaredWind, OwnWindSection, WINDS))]


def in_words(wind: Mapping[str, object]) -> str:
    """A [wind] as a file has it, such as "5 m/s with a gust of 2 m/s and turbulence as for 6 m/s at 20 ft"."""
    tables = [one if isinstance(one := wind.get(key), dict) else {} for key in ("gust", "turbulence")]
    strength = INTENSITIES.get(str(tables[1].get("intensity")), tables[1].get("wind_20"))
    mean, swing, gust, at_20 = map(speed, (wind.get("mean"), wind.get("swing"), tables[0].get("velocity"), [strength]))
    if "type" in wind:
        return f"“{wind['type']}”"
    changes = [f"a swing of {swing}"] * bool(swing) + [f"a gust of {gust}"] * bool(gust)
    changes += [f"turbulence as for {at_20} at 20\u00a0ft"] * bool(at_20)
    return (f"{mean} with " if mean else "no mean wind; ") + listed(changes) if changes else mean or "none"


def speed(velocity: object) -> str:
    """The length of a velocity in words; empty for none."""
    numbers = [one for one in velocity if isinstance(one, int | float)] if isinstance(velocity, list) else []
    return f"{math.hypot(*numbers):.3g}\u00a0m/s" if any(numbers) else ""
