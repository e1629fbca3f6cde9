"""Searches for a folder of results that makes a run touch a file outside it, and for a changed file that is believed."""

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from random import Random

from quadstep.io.errors import UserError
from quadstep.io.parts import SEAL, parts_in, read_sealed, sealed
from quadstep.report.publish import publishing
from tests.challenge.search import Attempt, Search

NAMES = ["flight.csv", "report.html", "figures/a.svg", "figures/b.svg"]


def fly(out: Path, random: Random) -> None:
    """A run that replaces what it finds, or keeps parts before it does."""
    with parts_in(out) as parts, publishing(out, "one", overwrite=random.random() < 0.5) as draft:
        parts.add("gains", "a", b"1")
        parts.publish(draft, [("gains", "a")])
        (draft / "figures").mkdir()
        for name in random.sample(NAMES, random.randint(0, 4)):
            (draft / name).write_text("new")
        (draft / "metrics.json").write_text("{}")


def hostile(out: Path, victim: Path, random: Random) -> str:
    """Links in a folder, and what its manifest lists; returns what was done."""
    inside = [path.relative_to(out).as_posix() for path in sorted(out.rglob("*"))]
    done = []
    for _ in range(random.randint(1, 3)):
        name = random.choice([*inside, "zz", "zz/y", ".writing-kept", ".writing-kept/gains", ".writing-0123456789abcdef"])
        place, target = out / name, random.choice([victim, victim / "figures", victim / "thesis.txt", victim / "new"])
        if place.parent.is_dir() and not any(one.is_symlink() for one in (*place.parents, place)):
            shutil.rmtree(place) if place.is_dir() else place.unlink(missing_ok=True)
            place.symlink_to(target if random.random() < 0.5 else os.path.relpath(target, place.parent))
            done.append(f"{name} -> {target.name}")
    files = ["thesis.txt", "figures/a.svg", "metrics.json", str(victim / "thesis.txt"), "../victim/thesis.txt"]
    listed = [f"{random.choice(['', 'zz/', 'figures/', 'zz/../', './', '//'])}{random.choice(files)}" for _ in range(6)]
    if not (out / "metrics.json").is_symlink():
        (out / "metrics.json").write_text(json.dumps({"fingerprint": "one", "files": [*NAMES, *listed]}))
    return f"{done}, files {listed}"


def outside(victim: Path) -> dict[str, object]:
    """What nobody may change."""
    return {
        str(path): (path.lstat().st_mtime_ns, path.lstat().st_ino, path.is_file() and path.read_bytes())
        for path in sorted([victim, *victim.rglob("*")])
    }


def safe(seed: int) -> Iterator[Attempt]:
    """Folders with random links and lists."""
    for number in range(10**9):
        random = Random(f"{seed} {number}")
        with tempfile.TemporaryDirectory() as place:
            out, victim = Path(place, "out"), Path(place, "victim")
            for path, text in ((victim / "thesis.txt", "precious"), (victim / "figures" / "a.svg", "too")):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            try:
                fly(out, random)
                case = hostile(out, victim, random)
                before = outside(victim)
                fly(out, random)
            except UserError:
                pass
            yield Attempt(0.0 if outside(victim) == before else 2.0, case)


def believed(seed: int) -> Iterator[Attempt]:
    """Manifests and parts with random bits flipped, or numbers changed."""
    content = {"name": "a", "chunks": [{"file": "flights/00000.parquet", "first": 0, "past": 16}], "probability": 6.05e-5}
    for number in range(10**9):
        random = Random(f"{seed} {number}")
        with tempfile.TemporaryDirectory() as place:
            path = Path(place, "campaign.json")
            whole = sealed(content) if random.random() < 0.5 else random.randbytes(200)
            spoilt = bytearray(whole)
            for _ in range(random.randint(1, 3)):
                spoilt[random.randrange(len(spoilt))] ^= 1 << random.randrange(8)
            if whole[:1] == b"{" and random.random() < 0.5:
                other = {**content, "probability": random.random()}
                spoilt = bytearray(sealed(other)[:-80] + whole[-80:])
            path.write_bytes(spoilt)
            try:
                with parts_in(Path(place, "out")) as parts:
                    parts.add("gains", "a", whole)
                    (kept,) = Path(place, "out").glob(".writing-kept/gains/*")
                    kept.write_bytes(spoilt)
                    found = parts.read("gains", "a")
                used = found != whole
            except UserError:
                used = False
            with contextlib.suppress(UserError):
                used = used or (SEAL in read_sealed(path) and spoilt != whole)
            yield Attempt(2.0 if used else 0.0, f"attempt {number} of seed {seed}")


SEARCHES = [
    Search("folders of results", "a run touches nothing outside its folder of results, whatever the folder holds", safe),
    Search("changed results", "no stored byte is used that is not what was written", believed),
]
