"""The manifest of a campaign: what was flown, by which version and machine, and which files hold the flights."""

import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from quadstep.engines.kernel import host
from quadstep.io import __version__
from quadstep.io.parts import OTHER_CODE, changed_files, code_digest
from quadstep.studies.campaign import LARGEST_CHUNK, MOST_CHUNKS, MOST_FLIGHTS, draws
from quadstep.studies.campaign.schema import Campaign

MANIFEST = "campaign.json"
FLIGHTS = "flights"
"""The folder of the Parquet files."""

PACKAGES = ("numpy", "llvmlite", "pyarrow")


class FlightFile(BaseModel):
    file: Annotated[str, Field(pattern=rf"^{FLIGHTS}/[0-9]{{5,9}}\.parquet$")]
    first: Annotated[int, Field(ge=0, lt=MOST_FLIGHTS)]
    past: Annotated[int, Field(ge=1, le=MOST_FLIGHTS)]
    sha256: str


class CampaignManifest(BaseModel):
    """What a manifest must hold for its campaign to be resumed."""

    model_config = ConfigDict(strict=True)
    name: str
    fingerprint: str
    named: dict[str, str] = {}
    draws: int = 1
    flights: Annotated[int, Field(ge=1, le=MOST_FLIGHTS)]
    chunk: Annotated[int, Field(ge=1, le=LARGEST_CHUNK)]
    chunks: Annotated[list[FlightFile], Field(max_length=MOST_CHUNKS)]
    machines: list[dict[str, object]]
    files: list[str] = []
    metrics: list[str] = []


def new_manifest(campaign: Campaign, flights: int, engine: str) -> dict[str, Any]:
    """The manifest of a campaign before its first flight."""
    return {
        "name": campaign.file.name,
        "version": __version__,
        **identity(campaign),
        "named": campaign.named,
        "draws": draws.VERSION,
        "seed": campaign.file.seed,
        "flights": flights,
        "chunk": campaign.file.chunk,
        "precision": campaign.file.precision,
        "failure": campaign.file.failure,
        "metrics": list(campaign.metrics),
        "engine": engine,
        "campaign": campaign.text,
        "mission": campaign.defaults,
        "packages": {name: version(name) for name in PACKAGES},
        "machines": [machine()],
        "complete": False,
        "chunks": [],
    }


def machine() -> dict[str, str]:
    """Facts about the machine on which results may depend."""
    processor = host().name
    return {"processor": processor, "system": platform.system(), "python": platform.python_version()}


def other_draws(manifest: Mapping[str, object]) -> str:
    """How a campaign's draws differ from this package's; empty where they are the same."""
    version = manifest.get("draws", 1)
    if version == draws.VERSION:
        return ""
    return (
        f"its values were drawn by quadstep {manifest.get('version')} (draws version {version}), and this is quadstep "
        f"{__version__} (draws version {draws.VERSION})"
    )


def identity(campaign: Campaign) -> dict[str, str]:
    """What decides the flights of a campaign."""
    return {"fingerprint": campaign.fingerprint, "code": code_digest()}


def differences(manifest: Mapping[str, object], campaign: Campaign) -> list[str]:
    """Why flights may differ from those of a manifest."""
    other = changed_files(manifest.get("named"), campaign.named) or "the campaign, its mission or a file it names has changed"
    why = {"fingerprint": other, "code": OTHER_CODE}
    return [why[entry] for entry, mine in identity(campaign).items() if manifest.get(entry) != mine]


def cannot_continue(manifest: Mapping[str, object], campaign: Campaign) -> list[str]:
    """Reasons not to add flights to those of a manifest."""
    version = manifest.get("version")
    other = f"it was flown by quadstep {version}, this is {__version__}" if version != __version__ else ""
    return [*filter(None, (other_draws(manifest), other)), *differences(manifest, campaign)]
