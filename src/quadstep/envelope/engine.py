"""The names of the engines of a map, apart from the engines themselves, so that the command line loads fast."""

from enum import StrEnum


class EnvelopeEngine(StrEnum):
    """lanes: all cores of this machine. gpu: an NVIDIA graphics processor."""

    LANES = "lanes"
    GPU = "gpu"
