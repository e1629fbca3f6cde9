"""The names of the engines of a comparison, apart from the rest, so that the command line loads fast."""

from enum import StrEnum


class CompareEngine(StrEnum):
    """lanes: all cores of this machine. ray: a cluster."""

    LANES = "lanes"
    RAY = "ray"
