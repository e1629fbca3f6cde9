"""A data sheet: what is known of a vehicle before it has flown."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from quadstep.documents import read_toml
from quadstep.mission.check import check
from quadstep.mission.fields import Name, NonNegative, Positive, PositiveTriple, Section, as_tuple

Column = Annotated[tuple[NonNegative, ...], BeforeValidator(as_tuple), Field(max_length=1000)]
FEWEST_POINTS = 3


class PropellerSection(Section):
    """diameter, pitch [m], or `inches = [diameter, pitch]`. mass of one [kg]."""

    diameter: Positive | None = None
    pitch: Positive | None = None
    inches: Annotated[tuple[Positive, Positive], BeforeValidator(as_tuple)] | None = None
    mass: Positive | None = None

    @model_validator(mode="after")
    def _sized(self) -> "PropellerSection":
        if (self.inches is None) == (self.diameter is None):
            raise ValueError("give either diameter (and perhaps pitch) in metres, or inches = [diameter, pitch]")
        return self

    @property
    def size(self) -> float:
        """The diameter [m]."""
        return 0.0254 * self.inches[0] if self.inches else self.diameter or 0.0


class StandSection(Section):
    """Points of a thrust stand with one motor, columns of equal length.

    throttle: share of the full one. voltage [V], thrust [N], current [A], speed [rad/s], torque [N m].
    """

    throttle: Column
    thrust: Column
    voltage: Column = ()
    current: Column = ()
    speed: Column = ()
    torque: Column = ()

    @model_validator(mode="after")
    def _even(self) -> "StandSection":
        count = len(self.throttle)
        if count < FEWEST_POINTS:
            raise ValueError(f"throttle: {count} points; at least {FEWEST_POINTS} are needed")
        for name in ("thrust", "voltage", "current", "speed", "torque"):
            column = getattr(self, name)
            if (column or name == "thrust") and len(column) != count:
                raise ValueError(f"{name}: {len(column)} points, throttle has {count}")
        if max(self.throttle) > 1.0:
            raise ValueError(f"throttle: {max(self.throttle):g} is above 1; it is a share of the full one, not per cent")
        if max(self.thrust) <= 0.0:
            raise ValueError("thrust: no point has any")
        if max(self.thrust) > 1000.0:
            raise ValueError(f"thrust: {max(self.thrust):g} N of one motor; is it in grams? 1 g is 0.00981 N")
        return self


class Datasheet(Section):
    """mass [kg], with all that flies. wheelbase: from motor to motor across [m]. kv: of the motors [rpm/V]. cells: in series.

    capacity [Ah]. motor_mass: of one motor [kg]. inertia [kg m^2], rise_time [s]: where they were measured.
    """

    name: Name = "My vehicle"
    mass: Positive
    wheelbase: Positive
    layout: Literal["x", "plus", "hexa-x", "hexa-plus", "octo-x", "octo-plus"] = "x"
    kv: Positive
    cells: Annotated[int, Field(ge=1, le=24)]
    capacity: Positive | None = None
    motor_mass: Positive | None = None
    inertia: PositiveTriple | None = None
    rise_time: Positive | None = None
    propeller: PropellerSection
    stand: StandSection | None = None


def read_datasheet(path: Path) -> Datasheet:
    """A data sheet. Raises UserError."""
    return check(Datasheet, read_toml(path), str(path), path.parent)
