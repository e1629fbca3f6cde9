"""The names of the engines, apart from the engines themselves, so that the command line loads fast."""

from enum import StrEnum


class Engine(StrEnum):
    """What flies: lanes, compiled vector code, the default; python, the same laws on Python floats, no compiler.

    Both give the same bits. Where a function takes an engine, its name will do.

    >>> from quadstep import Engine
    >>> Engine("python") is Engine.PYTHON, list(map(str, Engine))
    (True, ['lanes', 'python'])
    """

    LANES = "lanes"
    PYTHON = "python"
