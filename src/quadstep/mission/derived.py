"""A controller's table of a mission file, derived from what its gains declare; that of the two neural nets among them, with
the file of weights from an earlier flight.
"""

from collections.abc import Container, Iterable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol, Self

from pydantic import (
    BeforeValidator,
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    TypeAdapter,
    ValidationInfo,
    create_model,
    model_validator,
)

from quadstep.control.registry import BUILT_IN, controller
from quadstep.interfaces.controller import Condition, Controller
from quadstep.interfaces.gain import Gain, Undecided, cached_by_class
from quadstep.interfaces.learning import NEURONS, SEED, DeclaredNet, Learning
from quadstep.interfaces.plant import Model
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError, errors_in
from quadstep.mission.clock import PERIODS, STEP
from quadstep.mission.data_files import KEY, CompletedTable, check_order, completed, out_of_range_note
from quadstep.mission.fields import (
    MOST,
    Diagonal,
    Finite,
    NonNegative,
    NonNegativeDiagonal,
    Positive,
    PositiveDiagonal,
    Quantity,
    Section,
    as_tuple,
)
from quadstep.numbers import Matrix, Number, Vector, flatten


class NetsSection(Section):
    """The neural nets of a controller, which adds a learning rate and a damping of each: F1, kappa1, F2, kappa2."""

    enabled: Annotated[bool, Quantity("", "false: no nets")] = True
    start: Annotated[NonNegative, Quantity("s", "when they switch on")] = 0.0
    neurons: Annotated[int, Field(ge=1, le=64), Quantity("", "neurons of each net")] = NEURONS
    seed: Annotated[int, Field(ge=0, lt=2**63), Quantity("", "seed of the fixed input weights")] = SEED
    weights: Annotated[str | None, Quantity("", "weights.json of an earlier flight, for a warm start")] = None

    def learning(self, folder: Path | None) -> Learning:
        """What is said of the nets. folder: where the file with weights is looked up, None not to. Raises UserError."""
        file = None if folder is None or self.weights is None else folder / self.weights
        return Learning(
            enabled=self.enabled,
            start=self.start,
            neurons=self.neurons,
            seed=self.seed,
            rates=(getattr(self, "F1", None), getattr(self, "F2", None)),
            dampings=(getattr(self, "kappa1", None), getattr(self, "kappa2", None)),
            weights=None if file is None else self.saved_weights(file),
        )

    def saved_weights(self, path: Path) -> tuple[Matrix, Matrix]:
        """W_hat_1 and W_hat_2 as saved by an earlier flight. Raises UserError."""
        with errors_in("controller.nets.weights"):
            saved = read_weights(path)
        if (saved.neurons, saved.seed) != (self.neurons, self.seed):
            raise UserError(
                f"{path}: saved with neurons = {saved.neurons}, seed = {saved.seed}; "
                f"controller.nets asks for neurons = {self.neurons}, seed = {self.seed}"
            )
        return Matrix(map(Vector, saved.W1)), Matrix(map(Vector, saved.W2))


class SavedWeights(Section):
    """Trained weights, shape (neurons, 3) each, and the nets they belong to."""

    neurons: int
    seed: int
    W1: list[Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_tuple)]]
    W2: list[Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_tuple)]]


def read_weights(path: Path) -> SavedWeights:
    """Weights from the `weights.json` of an earlier flight. Raises UserError for anything else."""
    try:
        saved = TypeAdapter(SavedWeights).validate_python(read_json(path))
    except ValueError:
        saved = None
    if saved is None or not len(saved.W1) == len(saved.W2) == saved.neurons:
        raise UserError(f"{path}: not a weights.json written by `quadstep fly` (neurons, seed, W1 and W2 of neurons x 3)")
    return saved


class BuiltController(NamedTuple):
    """law and gains as in `quadstep.control`."""

    law: Controller
    gains: Any


class ModelledVehicle(Protocol):
    def model(self) -> Model: ...


class ControllerSection(Section):
    """A controller in a mission file: its `type`, a key for each declared gain, and a table `nets` if it has any."""

    controller: ClassVar[type[Controller]]
    own: ClassVar[bool] = False
    """Whether it is the user's own."""

    type: str
    _saved: CompletedTable = PrivateAttr(CompletedTable({}))
    """What a file of parameters became."""

    @property
    def left(self) -> tuple[str, ...]:
        """The parameters of its file that the law does without."""
        return self._saved.left

    @property
    def table(self) -> NetsSection | None:
        """What is said of the nets; None of a controller that has none."""
        return getattr(self, "nets", None)

    def gains(self, model: Model, folder: Path | None = None) -> Undecided:
        """The gains as declared, what is left out following from the vehicle.

        folder: where files are looked up that a key names; None for gains whose weights are not wanted. Raises UserError.
        """
        values = {key: attrgetter(key)(self) for key in self.controller.by_key()}
        return self.controller.undecided(model, values, self.table.learning(folder) if self.table else None)

    def build(self, vehicle: ModelledVehicle, folder: Path) -> BuiltController:
        """The law and its gains. folder: where files are looked up that a key names. Raises UserError."""
        model = vehicle.model()
        law, gains = self.controller.for_vehicle(model), self.gains(model, folder).decided()
        left_out = {key: name for key, (name, _) in self.controller.by_key().items() if attrgetter(key)(self) is None}
        check_followed({key: flatten(attrgetter(name)(gains)) for key, name in left_out.items()})
        try:
            return BuiltController(law, law.prepare(gains, model))
        except ValueError as error:
            if self.own:
                raise
            raise UserError(f"controller: {self.type} has no law for these gains: {error}") from error

    def conditions(self, model: Model) -> list[Condition]:
        """What theory asks of these gains, as far as a mission is warned of it."""
        found: object = self.controller.for_vehicle(model).conditions(self.gains(model), model)
        if not isinstance(found, Sequence) or not all(isinstance(one, Condition) for one in found):
            raise UserError(f"controller: {self.type}: conditions: should return a list of Condition, not {found!r:.60}")
        return [one for one in found if one.warned]

    def warnings(self, vehicle: ModelledVehicle) -> list[str]:
        """What a file of parameters has that is not flown, values beyond the autopilot's own ranges, and the conditions that
        these gains break, a line each.
        """
        said = [*self._saved.notes, *(out_of_range_note(self.controller, self) if self.controller.parameter_file else ())]
        if self.controller.conditions is Controller.conditions:  # none: the vehicle's model costs more than the rest
            return said
        return [*said, *(one.warning() for one in self.conditions(vehicle.model()) if not one.holds)]


class SectionWithFile(ControllerSection):
    """The section of a law whose gains may stand in a file of an autopilot's parameters."""

    @model_validator(mode="wrap")
    @classmethod
    def _with_file(cls, value: object, check: ModelWrapValidatorHandler[Self], info: ValidationInfo) -> Self:
        if not isinstance(value, Mapping):
            return check(value)
        saved = completed(cls.controller, value, (info.context or {}).get("folder", Path()))
        section = check(saved.table)
        check_order(cls.controller, section)
        section._saved = saved
        return section


def check_followed(gains: Mapping[str, Iterable[Number]]) -> None:
    """Refuses gains that follow from a vehicle of no use. Raises UserError."""
    for key, values in gains.items():
        for value in values:
            if isinstance(value, float) and not value <= MOST:
                raise UserError(f"controller.{key}: its default for this vehicle is {value:g}; allowed: at most {MOST:.0f}")


def usual_step(law: type[Controller]) -> float:
    """The integrator's step where a mission says none [s]."""
    return min(STEP, *law.rates.values())


def with_usual_rates(simulation: object, law: type[Controller], keys: Container[str]) -> object:
    """The table [simulation] with the controller's own sample times where it says none. keys: that the table can have."""
    own: dict[str, object] = {}
    further: dict[str, float] = {}
    usual = {**Controller.rates, **law.rates}
    for method, period in usual.items():
        if (key := PERIODS.get(method, "")) in keys:
            own |= {key: period} if period != Controller.rates[method] else {}
        elif method in law.loops():
            further[method] = period
    if not (own or further) or not isinstance(simulation, Mapping):
        return simulation
    if "step" in keys and usual_step(law) < STEP:
        own["step"] = usual_step(law)
    said = simulation.get("loop_periods", {})
    if further and isinstance(said, Mapping):
        simulation = {**simulation, "loop_periods": {**further, **said}}
    return {**own, **simulation}


def checked_kind(gain: Gain) -> Any:
    """The type of a gain's key in a mission."""
    number, three = (NonNegative, NonNegativeDiagonal) if gain.zero else (Positive, PositiveDiagonal)
    if gain.signed:
        number, three = Finite, Diagonal
    if gain.only and not gain.parts:
        whole = 1.0 if gain.only == "whole" else None
        return Annotated[number, Field(ge=gain.low, le=gain.high, multiple_of=whole)]
    if not gain.parts:
        return number
    if gain.stands_for_three:
        return three
    entries: Any = tuple[(number,) * len(gain.parts)]  # type: ignore[misc]  # a value, not a type to the checker
    return Annotated[entries, BeforeValidator(as_tuple)]


def key_field(gain: Gain) -> tuple[Any, Any]:
    """A gain's key and its default: None where that follows from the vehicle."""
    kind = checked_kind(gain)
    return Annotated[kind if gain.fixed is not None else kind | None, Quantity(gain.unit, gain.meaning)], gain.fixed


@cached_by_class
def section_of(law: type[Controller], kind: str = "") -> type[ControllerSection]:
    """The table of one controller, made when first asked for. kind: its `type` in missions, where it is the user's own."""
    name = f"{law.__name__}Section"
    fields: dict[str, Any] = {"type": (Literal[kind or law.name], ...)}
    if law.parameter_file:
        note = Quantity("", "file of the autopilot's own parameters; keys given here take precedence")
        fields[KEY] = (Annotated[str | None, note], None)
    nets = [one for one in law.declarations().values() if isinstance(one, DeclaredNet)]
    for key, gain in fields_in_order(law).items():
        table, _, inner = key.rpartition(".")
        if hasattr(ControllerSection, table or key):
            raise TypeError(f"{law.__name__}: a gain cannot have the key {key}; give it another by key=...")
        field = key_field(gain) if isinstance(gain, Gain) else nets_field(nets, name)
        if table:
            fields.setdefault(table, {})[inner] = field
        else:
            fields[key] = field
    fields = {key: table_field(one, f"{name}{key}") if isinstance(one, dict) else one for key, one in fields.items()}
    base: type[ControllerSection] = SectionWithFile if law.parameter_file else ControllerSection
    made: Any = create_model(name, __base__=base, __module__=__name__, __doc__=law.__doc__, **fields)
    made.controller, made.own = law, bool(kind)
    return made


def fields_in_order(law: type[Controller]) -> Mapping[str, object]:
    """Keys as declared; the nets stand where the first of them does."""
    found: dict[str, object] = {}
    for one in law.declarations().values():
        if isinstance(one, Gain):
            found[one.key] = one
        elif isinstance(one, DeclaredNet):
            found.setdefault("nets", one)
    return found


def table_field(fields: dict[str, Any], name: str, base: type[Section] = Section) -> tuple[type[Section], Section]:
    """A table within a controller's, and its defaults. name: of its class."""
    made = create_model(name, __base__=base, __module__=__name__, __doc__=base.__doc__, **fields)
    return made, made()


def nets_field(nets: list[DeclaredNet], name: str) -> tuple[type[Section], Section]:
    """The table of the nets, with the controller's own numbers where they are the same for every vehicle."""
    fields: dict[str, Any] = {}
    for net in nets:
        rate = float(net.rate) if isinstance(net.rate, float | int) else None
        kind: Any = NonNegative if rate is not None else NonNegative | None
        fields[f"F{net.number}"] = (Annotated[kind, Quantity("-", "learning rate of Eq. 54")], rate)
    for net in nets:
        note = Quantity("-", "damping of the weights in Eq. 54")
        fields[f"kappa{net.number}"] = (Annotated[NonNegative, note], net.damping)
    return table_field(fields, f"{name}Nets", NetsSection)


def __getattr__(name: str) -> object:
    """A table of the package's controllers by its name, or one within it: so that missions can be pickled."""
    of_law, section, table = name.partition("Section")
    for measures, places in BUILT_IN.items():
        for kind, place in places.items() if section else ():
            law = controller(measures, kind) if place.endswith(f".{of_law}") else None
            if law and not table:
                return section_of(law)
            for field in section_of(law).model_fields.values() if law else ():
                if getattr(field.annotation, "__name__", "") == name:
                    return field.annotation
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
