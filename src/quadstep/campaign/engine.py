"""The names of a campaign's engines, apart from the engines themselves, so that the command line loads fast."""

from enum import StrEnum


class CampaignEngine(StrEnum):
    """lanes: all cores of this machine. gpu: an NVIDIA graphics processor. ray: a cluster."""

    LANES = "lanes"
    GPU = "gpu"
    RAY = "ray"
