"""The table of a mission about the two neural nets, and the file with weights from an earlier flight."""

from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field, TypeAdapter

from quadstep.interfaces.learning import NEURONS, SEED, Learning
from quadstep.io.documents import read_json
from quadstep.io.errors import UserError
from quadstep.mission.fields import Finite, NonNegative, Quantity, Section, as_tuple
from quadstep.numbers import Matrix, Vector


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
        try:
            saved = read_weights(path)
        except UserError as error:
            raise UserError(f"controller.nets.weights: {error}") from None
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
