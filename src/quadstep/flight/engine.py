"""The names of the engines, apart from the engines themselves, so that the command line loads fast."""

from enum import StrEnum


class Engine(StrEnum):
    """What flies: lanes, compiled vector code, the default; python, the same laws on Python floats, no compiler; c, lanes
    whose controller is the C code of `quadstep export`, compiled by the C compiler of this machine.

    All give the same bits. Functions that take an engine also accept its name.

    >>> from quadstep import Engine
    >>> Engine("python") is Engine.PYTHON, list(map(str, Engine))
    (True, ['lanes', 'python', 'c'])
    """

    LANES = "lanes"
    PYTHON = "python"
    C = "c"
