"""A data sheet: what is known of a vehicle before it has flown, and a campaign over what it leaves open."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from quadstep.mission.fields import Name, NonNegative, Positive, PositiveTriple, Quantity, Section, Several, as_tuple

Column = Annotated[Several[NonNegative], Field(max_length=1000)]
FEWEST_POINTS = 3

Diameter = Annotated[Positive, Field(ge=0.01, le=100.0)]
"""In metres: the numbers that follow from it are in range."""

LIKELY = {"voltage": (1.0, 1000.0, "V"), "current": (0.01, 10_000.0, "A"), "speed": (10.0, 1e5, "rad/s")}
"""Least and most of the largest number of a column of the stand, and its unit."""


IN_PROPORTION = (0.05, 2.0)
"""Least and largest diameter of a propeller over the wheelbase: beyond, one of them is not in its unit."""


class PropellerSection(Section):
    """The propeller, in metres or in inches."""

    diameter: Annotated[Diameter | None, Quantity("m", "diameter of the propeller")] = None
    pitch: Annotated[Positive | None, Quantity("m", "pitch of the propeller")] = None
    inches: Annotated[
        Annotated[tuple[Positive, Positive], BeforeValidator(as_tuple)] | None,
        Quantity("in", "[diameter, pitch] in inches instead"),
    ] = None
    mass: Annotated[Positive | None, Quantity("kg", "mass of one propeller")] = None

    def model_post_init(self, context: object) -> None:
        if (self.inches is None) == (self.diameter is None):
            raise ValueError("give either diameter (and perhaps pitch) in metres, or inches = [diameter, pitch]")
        if self.inches and not 0.4 <= self.inches[0] <= 4000.0:
            raise ValueError(f"inches: the diameter should be from 0.4 to 4000 in, not {self.inches[0]:g}")

    @property
    def size(self) -> float:
        """The diameter [m]."""
        return 0.0254 * self.inches[0] if self.inches else self.diameter or 0.0


class StandSection(Section):
    """Points of a thrust stand with one motor, columns of equal length."""

    throttle: Annotated[Column, Quantity("", "fraction of full throttle at each point")]
    thrust: Annotated[Column, Quantity("N", "thrust of one motor")]
    voltage: Annotated[Column, Quantity("V", "battery voltage")] = ()
    current: Annotated[Column, Quantity("A", "current of one motor")] = ()
    speed: Annotated[Column, Quantity("rad/s", "speed of the propeller")] = ()
    torque: Annotated[Column, Quantity("N m", "torque of one motor")] = ()

    def model_post_init(self, context: object) -> None:
        count = len(self.throttle)
        if count < FEWEST_POINTS:
            raise ValueError(f"throttle: {count} points; at least {FEWEST_POINTS} are needed")
        for name in ("thrust", "voltage", "current", "speed", "torque"):
            column = getattr(self, name)
            if (column or name == "thrust") and len(column) != count:
                raise ValueError(f"{name}: {len(column)} points, throttle has {count}")
        for name, (least, most, unit) in LIKELY.items():
            if getattr(self, name) and not least <= max(getattr(self, name)) <= most:
                raise ValueError(
                    f"{name}: its largest number should be from {least:g} to {most:g} {unit}, not {max(getattr(self, name)):g}"
                )
        if max(self.throttle) > 1.0:
            raise ValueError(
                f"throttle: {max(self.throttle):g} is above 1; it is a fraction of full throttle, not a percentage"
            )
        if max(self.thrust) <= 0.0:
            raise ValueError("thrust: every point is zero")
        if max(self.thrust) > 1000.0:
            raise ValueError(f"thrust: {max(self.thrust):g} N from one motor; is it in grams? 1 g is 0.00981 N")


class Datasheet(Section):
    """A data sheet: what is known of a vehicle before it has flown."""

    name: Annotated[Name, Quantity("", "name of the vehicle")] = "My vehicle"
    mass: Annotated[Positive, Quantity("kg", "total mass in flight")]
    wheelbase: Annotated[Positive, Field(ge=0.001, le=1000.0), Quantity("m", "distance between diagonally opposite motors")]
    layout: Annotated[
        Literal["x", "plus", "hexa-x", "hexa-plus", "octo-x", "octo-plus"], Quantity("", "arrangement of the rotors")
    ] = "x"
    kv: Annotated[Positive, Field(ge=1.0, le=1e5), Quantity("rpm/V", "speed constant of the motors")]
    cells: Annotated[int, Field(ge=1, le=24), Quantity("", "battery cells in series")]
    capacity: Annotated[Annotated[Positive, Field(ge=0.001, le=1e5)] | None, Quantity("A h", "capacity of the battery")] = None
    motor_mass: Annotated[Positive | None, Quantity("kg", "mass of one motor")] = None
    inertia: Annotated[PositiveTriple | None, Quantity("kg m^2", "moments of inertia, if measured")] = None
    rise_time: Annotated[Positive | None, Quantity("s", "rise time of a rotor's speed, if measured")] = None
    propeller: PropellerSection
    stand: StandSection | None = None

    def model_post_init(self, context: object) -> None:
        size, places = self.propeller.size, self.wheelbase
        if not IN_PROPORTION[0] * places <= size <= IN_PROPORTION[1] * places:
            raise ValueError(f"wheelbase: {places:g} m does not fit propellers of {size:.3g} m; is each in metres?")
