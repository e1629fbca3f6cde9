"""The names of the engines, apart from the engines themselves, so that the command line loads fast."""

from enum import StrEnum


class Engine(StrEnum):
    """lanes: compiled vector code, the default. python: the same laws on Python floats, no compiler."""

    LANES = "lanes"
    PYTHON = "python"
