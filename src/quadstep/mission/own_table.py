"""A table of a mission whose `type` may name a thing of the user's own: the package's kinds stay as they are."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pydantic import BaseModel, ValidationError, ValidationInfo
from pydantic_core import PydanticCustomError

from quadstep.io.errors import UserError
from quadstep.io.user_code.installed import allowed
from quadstep.mission.check import INSIDE, shorten


def or_own(
    is_own: Callable[[type], bool],
    table: Callable[[object, Path], type[BaseModel] | None],
    otherwise: Callable[[object], object] | None = None,
) -> Callable[[object, Callable[[object], object], ValidationInfo], object]:
    """A validator around that of the package's tables: takes one of the user's own too.

    is_own: of the class of a checked table. table: what a `type`, None if missing, names, files looked up from the mission's
    folder; None where that is the package's; raises UserError. otherwise: what takes all but tables instead of pydantic's own
    validator. An error in a table names its key.
    """

    def validated(value: object, known: Callable[[object], object], info: ValidationInfo) -> object:
        if is_own(type(value)):
            return value
        if not isinstance(value, Mapping):
            return (otherwise or known)(value)
        try:
            model = table(value.get("type"), (info.context or {}).get("folder", Path()))
        except UserError as error:
            wrong = {"type": "value_error", "loc": ("type",), "msg": str(error), "input": value}
            raise PydanticCustomError(INSIDE, "inside", {"model": BaseModel, "problem": wrong}) from error
        if model is None:
            return known(value)
        try:
            return model.model_validate(value, context=info.context)
        except ValidationError as error:
            problem = error.errors(include_url=False)[0]
            raise PydanticCustomError(INSIDE, "inside", {"model": model, "problem": problem}) from None

    return validated


def unknown_type(kind: object, own: Iterable[str], group: str) -> UserError:
    """What is said of a `type`, None if missing, that names nothing: own are the package's, group those of entry points."""
    wrong = "missing" if kind is None else f"{shorten(kind)} is not known"
    return UserError(f"{wrong}; allowed: {allowed(own, group)}")
