"""A table of a mission whose `type` may name a thing of the user's own: the package's kinds stay as they are."""

from collections.abc import Callable, Mapping
from pathlib import Path

from pydantic import BaseModel, ValidationError, ValidationInfo
from pydantic_core import PydanticCustomError

from quadstep.io.errors import UserError
from quadstep.mission.check import INSIDE


def or_own(
    is_own: Callable[[type], bool],
    table: Callable[[str, Path], type[BaseModel] | None],
    otherwise: Callable[[object], object] | None = None,
) -> Callable[[object, Callable[[object], object], ValidationInfo], object]:
    """A validator around that of the package's tables: takes one of the user's own too.

    is_own: of the class of a checked table. table: what a `type` names, files looked up from the mission's folder; None where
    it is no thing of the user's; raises UserError. otherwise: what takes other tables than these instead of pydantic's own
    validator. An error in a table names its key.
    """

    def validated(value: object, known: Callable[[object], object], info: ValidationInfo) -> object:
        if is_own(type(value)):
            return value
        kind = value.get("type") if isinstance(value, Mapping) else None
        try:
            model = table(kind, (info.context or {}).get("folder", Path())) if isinstance(kind, str) else None
        except UserError as error:
            raise ValueError(f"type: {error}") from error
        if model is None:
            return (otherwise or known)(value)
        try:
            return model.model_validate(value, context=info.context)
        except ValidationError as error:
            problem = error.errors(include_url=False)[0]
            raise PydanticCustomError(INSIDE, "inside", {"model": model, "problem": problem}) from None

    return validated
