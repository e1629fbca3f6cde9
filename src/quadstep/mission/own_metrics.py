"""Metrics that a mission names: of effort, `metrics = ["energy"]`, or of the user's own, `["my_metrics.py:Overshoot"]`."""

import re
from collections.abc import Container, Sequence
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from quadstep.interfaces.metric import Metric
from quadstep.io.errors import UserError
from quadstep.io.user_code.installed import METRICS
from quadstep.metrics.effort import EFFORT
from quadstep.mission.fields import Quantity, as_tuple
from quadstep.mission.own_thing import own_class, the_only, unknown_type

TAKEN = (
    "flight",
    "outcome",
    "ended",
    "time_of_failure",
    "success",
    "name",
    "version",
    "engine",
    "warnings",
    "mission",
    "requirements",
)
"""What else is in results."""

NAMED = re.compile(r"[A-Za-z_]\w{0,59}")
UNIT = re.compile(r"[^\[\],\"]{0,20}")


def own_metrics(named: Sequence[str], folder: Path) -> tuple[Metric, ...]:
    """The metrics that a mission names. folder: the mission's. Raises UserError."""
    return tuple(own_metric(one, folder) for one in named)


def own_metric(kind: str, folder: Path) -> Metric:
    if kind in EFFORT:
        return EFFORT[kind]()
    thing: type[Metric] | None = own_class(kind, Metric, METRICS, folder)
    if thing is None:
        raise unknown_type(kind, EFFORT, METRICS)
    name, unit = getattr(thing, "name", None), thing.unit
    if not (isinstance(name, str) and NAMED.fullmatch(name)):
        raise UserError(f"{kind}: its `name` should be letters, digits and _, at most 60, not {name!r:.60}")
    if name in TAKEN:
        raise UserError(f"{kind}: its `name` is {name}, which already has another meaning in results")
    if not (isinstance(unit, str) and unit.isprintable() and UNIT.fullmatch(unit)):
        raise UserError(f"{kind}: its `unit` should be a few printable characters without brackets, not {unit!r:.60}")
    found: Metric = the_only(thing)
    return found


def check_names(named: Sequence[Metric], scores: Container[str], with_rotors: bool) -> None:
    """Refuses metrics that the flights of a mission have anyway, or cannot have. Raises ValueError.

    scores: names of those that all its flights have. with_rotors: whether its vehicle has rotors of its own.
    """
    for one in named:
        if one.name in EFFORT and not with_rotors:
            raise ValueError(f"metrics: {one.name}: only for real vehicles; name one in [vehicle]")
        if one.name in scores:
            raise ValueError(f"metrics: {one.name}: every flight already has a metric of this name")


def checked_metrics(named: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
    """Refuses a name of nothing, and a metric named twice."""
    try:
        names = [one.name for one in own_metrics(named, (info.context or {}).get("folder", Path()))]
    except UserError as error:
        raise ValueError(str(error)) from error
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"two metrics share the name {twice[0]}")
    return named


OwnMetrics = Annotated[
    tuple[str, ...],
    BeforeValidator(as_tuple),
    Field(max_length=32),
    AfterValidator(checked_metrics),
    Quantity("", f"further metrics: {', '.join(EFFORT)}, or FILE.py:NAME of your own"),
]
"""The key `metrics`."""
