"""The engines, and one table of what does what on which: names only, so that nothing is loaded before it flies."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any

from quadstep.io.doors import Door
from quadstep.io.errors import UserError, unknown_name


class Engine(StrEnum):
    """What flies: lanes, compiled vector code on all cores, the default; python, the same laws on Python floats, no compiler;
    c, lanes whose controller is the C code of `quadstep export`, compiled by the C compiler of this machine; gpu, an NVIDIA
    graphics processor; ray, a cluster.

    Lanes, python, c and ray give the same bits. Functions that take an engine also accept its name; which engines a
    function takes is in `FLOWN_BY`.

    >>> from quadstep import Engine
    >>> Engine("python") is Engine.PYTHON, list(map(str, Engine))
    (True, ['lanes', 'python', 'c', 'gpu', 'ray'])
    """

    LANES = "lanes"
    PYTHON = "python"
    C = "c"
    GPU = "gpu"
    RAY = "ray"

    @classmethod
    def _missing_(cls, value: object) -> "Engine | None":
        if not any(value in door for door in FLOWN_BY.values()):
            return None
        one = str.__new__(cls, value)
        one._name_, one._value_ = str(value), str(value)
        return one


WORDS = {
    Engine.LANES: "compiled vector code on all cores",
    Engine.PYTHON: "the same laws without a compiler, slower",
    Engine.C: "the controller as exported C",
    Engine.GPU: "an NVIDIA graphics processor",
    Engine.RAY: "a cluster",
}
"""Each engine for a person."""

FLIGHTS, CAMPAIGNS, JOBS = "flights", "campaigns", "jobs"

FLOWN_BY: Mapping[str, Door] = {
    FLIGHTS: Door("quadstep.engines.flights", {
        Engine.LANES: "quadstep.engines.fly:on_lanes",
        Engine.PYTHON: "quadstep.engines.fly:on_floats",
        Engine.C: "quadstep.export.c.compiled:on_c",
    }),
    CAMPAIGNS: Door("quadstep.engines.campaigns", {
        Engine.LANES: "quadstep.studies.campaign.flyer:on_lanes",
        Engine.GPU: "quadstep.studies.campaign.flyer:on_gpu",
        Engine.RAY: "quadstep.studies.campaign.cluster:on_cluster",
    }),
    JOBS: Door("quadstep.engines.jobs", {
        Engine.LANES: "quadstep.studies.comparison.jobs:on_cores",
        Engine.RAY: "quadstep.studies.comparison.jobs:on_cluster",
    }),
}  # fmt: skip
"""What does the work on each engine: a door for each kind of work.

flights: a function of plans; campaigns: a function of a `Campaign`. Either refuses with UserError what it cannot fly, and
returns a function that flies: the plans, given a progress callback, to their logs; or the spans that it is given, with a
progress callback, to pairs of a span and its table. jobs: a function that works jobs off, of a study, and yields each with
its result.
"""


def engine_for(work: str, name: str) -> Engine:
    """The engine of this name, if it does this kind of work. Raises UserError."""
    if name not in FLOWN_BY[work]:
        raise UserError(unknown_name("engine", name, FLOWN_BY[work].names))
    return Engine(name)


def loaded(work: str, engine: Engine) -> Any:
    """What does this kind of work on an engine."""
    return FLOWN_BY[work].load(engine)
