"""A mission for a plant that declares itself: its tables follow from what the plant says of its numbers."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, create_model

from quadstep.control.registry import controller, names
from quadstep.interfaces.gain import cached_by_class
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.plant import Model
from quadstep.io.doors import PLANTS as PLANTS_OF_OTHERS
from quadstep.io.doors import registered
from quadstep.io.errors import UserError, errors_in
from quadstep.io.places import place
from quadstep.io.user_code import load
from quadstep.metrics.registry import Metrics, flight_metrics
from quadstep.mission.air import AnyWind, WindSection
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import section_of
from quadstep.mission.fields import Name, Positive, Quantity
from quadstep.mission.own_controller import any_controller
from quadstep.mission.own_thing import NumbersSection, OwnMetrics, numbers_section, own_class, the_only, unknown_type
from quadstep.mission.paths import AnyPath, BuiltPath
from quadstep.mission.schema import Built, MarginsSection, Mission
from quadstep.mission.tune import TuneSection
from quadstep.numbers.noise import key
from quadstep.vehicle.declared import DeclaredPlant, PlantParameters
from quadstep.vehicle.planar import Planar

PLANTS = {Planar.name: Planar}
"""Those of the package, by their `type` in [vehicle]."""


class OwnVehicleSection(NumbersSection):
    """The vehicle of a plant that declares itself."""

    plant: ClassVar[DeclaredPlant]
    type: str

    def model(self) -> Model:
        return self.plant.model(self.numbers())

    def warnings(self) -> list[str]:
        return []


class DeclaredSimulation(ClockSection):
    """Clock of the flight: the sampling periods of the controller's law and of its slower loop, if it has one."""

    control_period: Annotated[Positive, Quantity("s", "sampling period of the controller's law")] = 0.002
    guidance_period: Annotated[Positive, Quantity("s", "sampling period of the controller's slower loop, if any")] = 0.01


class WindySimulation(DeclaredSimulation):
    """The same, and of air that moves."""

    air_period: Annotated[Positive, Quantity("s", "sampling period of the turbulence")] = 0.01


class DeclaredMission(Mission):
    """A mission file for a plant that declares itself; a subclass for each."""

    simulation: DeclaredSimulation
    if TYPE_CHECKING:  # keys of its subclasses
        vehicle: OwnVehicleSection
        limits: NumbersSection

    @property
    def plant(self) -> DeclaredPlant:
        return self.vehicle.plant

    def plant_metrics(self, log: FlightLog) -> tuple[Metrics, list[str]]:
        return flight_metrics(log, efforts=self.plant.efforts), []

    def build(self, path: BuiltPath) -> Built:
        numbers = self.vehicle.numbers()
        return Built(
            numbers=partial(PlantParameters, vehicle=numbers, limits=self.limits.numbers()),
            start=partial(self.plant.begin, numbers),
            guided=True,
            own_plant="" if self.vehicle.type in PLANTS else self.vehicle.type,
        )


class WindyMission(DeclaredMission):
    """A mission file for a plant that declares itself, and that air acts on."""

    simulation: WindySimulation
    if TYPE_CHECKING:
        seed: int
        wind: WindSection

    @property
    def random(self) -> list[str]:
        return ["the turbulence"] * self.wind.air.stirs

    def build(self, path: BuiltPath) -> Built:
        built = super().build(path)
        try:
            self.wind.check(self.simulation.duration or path.length)
        except ValueError as error:
            raise UserError(str(error)) from None
        return built._replace(
            numbers=partial(built.numbers, wind=self.wind.build(), key=key(self.seed, 0)),
            air=self.wind.air,
            periods={"air": self.simulation.air_period},
            warnings=lambda _: self.wind.warnings(),
        )


def check_plant(plant: type[DeclaredPlant]) -> None:
    """Refuses declarations that contradict each other. Raises TypeError."""
    lacking = [name for name in ("Numbers", "Limits", "measures", "columns", "axes", "efforts") if not hasattr(plant, name)]
    if lacking:
        raise TypeError(f"has no {' and no '.join(f'`{name}`' for name in lacking)}")
    if not isinstance(plant.axes, tuple) or not plant.axes or set(plant.axes) - {*"xyz"}:
        raise TypeError(f"axes: should be a tuple of x, y, z or some of them, not {plant.axes!r:.60}")
    needed = ["t", *plant.axes, *(f"{axis}_d" for axis in plant.axes), *plant.efforts]
    missing = [name for name in needed if name not in plant.columns]
    if missing:
        raise TypeError(
            f"columns: {', '.join(missing)} missing: t, axes, the desired position along them (_d) and efforts are needed"
        )


@cached_by_class
def mission_of(plant: type[DeclaredPlant], kind: str) -> type[Mission]:
    """The mission of a plant, whose vehicle's `type` is `kind`, made when first asked for.

    Raises TypeError or ValueError for declarations that cannot be read.
    """
    name, known = plant.__name__, names(plant.measures)
    vehicle = numbers_section(f"{name}Vehicle", plant.Numbers, OwnVehicleSection, type=(Literal[kind], ...))
    vehicle.plant = the_only(plant)
    limits = numbers_section(f"{name}Limits", plant.Limits)
    first = controller(plant.measures, known[0]) if known else None
    usual: Any = section_of(first)(type=known[0]) if first else ...
    called: Any = Annotated[Name, Quantity("", "name of the flight, shown in its results; default: the file's name")]
    simulation = WindySimulation if plant.windy else DeclaredSimulation
    seed: object = Annotated[int, Field(ge=0, lt=2**63), Quantity("", "seed of all turbulence")]
    air: dict[str, object] = {"seed": (seed, 1), "wind": (AnyWind, WindSection())} if plant.windy else {}
    create: Any = create_model
    made = create(
        f"{name}Mission",
        __base__=WindyMission if plant.windy else DeclaredMission,
        __module__=__name__,
        name=(called, "Flight"),
        vehicle=(vehicle, ...),
        path=(AnyPath, ...),
        controller=(any_controller(plant.measures), usual),
        simulation=(simulation, simulation()),
        limits=(limits, limits()),
        metrics=(OwnMetrics, ()),
        margins=(MarginsSection, MarginsSection()),
        tune=(TuneSection | None, None),
        **air,
    )
    made.measures = plant.measures
    return made


def is_plant(name: str, folder: Path) -> bool:
    """Whether a plant that declares itself has this name, and no preset. Raises UserError for a file that cannot be read."""
    if name in PLANTS or name in registered(PLANTS_OF_OTHERS):
        return True
    found = place(name)
    thing = load(found, folder) if found else None
    return isinstance(thing, type) and issubclass(thing, DeclaredPlant)


def declared_kind(kind: str, folder: Path) -> type[Mission]:
    """The mission of the plant that [vehicle] names by its `type`. Raises UserError."""
    if kind in PLANTS:
        return mission_of(PLANTS[kind], kind)
    with errors_in("vehicle.type"):
        plant = own_class(kind, DeclaredPlant, PLANTS_OF_OTHERS, folder)
    if plant is None:
        raise UserError(f"vehicle.type: {unknown_type(kind, PLANTS, PLANTS_OF_OTHERS)}")
    try:
        check_plant(plant)
        return mission_of(plant, kind)
    except (TypeError, ValueError) as error:
        raise UserError(f"vehicle.type: {kind}: {error}") from error
