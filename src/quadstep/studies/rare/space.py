"""The varying keys of a campaign as independent standard normal numbers, one for each key."""

from pathlib import Path
from typing import cast

import numpy as np
from scipy.special import ndtr

from quadstep.io.errors import UserError
from quadstep.mission.distributions import Grid, Sobol
from quadstep.studies.campaign.draws import Drawn, Values, from_shares
from quadstep.studies.campaign.schema import CampaignFile
from quadstep.studies.rare.points import Floats

LEAST, MOST = 2.0**-1000, 1.0 - 2.0**-53
"""Range of a share in which quantile functions are finite. The probability above it, at 8.2 deviations, is 1e-16."""


def check_space(file: CampaignFile, path: Path) -> None:
    """Refuses a campaign in which nothing is drawn, or not every key. Raises UserError."""
    grids = [name for name, one in file.vary.items() if isinstance(one, Grid)]
    if grids:
        raise UserError(f"{path}: vary.{grids[0]}: a grid has no probabilities; use a choice or a distribution")
    if not file.keys:
        raise UserError(f"{path}: vary: empty; --rare needs keys with distributions, --until does not")


def values(file: CampaignFile, latent: Floats) -> dict[str, Drawn]:
    """The values of all keys. latent: shape (flights, keys)."""
    shares = np.clip(ndtr(latent), LEAST, MOST)
    shared = dict(zip(file.keys, shares.T, strict=True))
    drawn = from_shares(file, shared)
    drawn |= {
        name: Drawn(cast(Values, one.quantile(shared[name]))) for name, one in file.vary.items() if isinstance(one, Sobol)
    }
    return {name: drawn[name] for name in file.keys}
