"""Certificates of the planar plant, which are quickly made: a tube and a set."""

import json

from quadstep.io.parts import sealed
from tests.commands import quadstep, write

TUBE = """\
vehicle = { type = "planar" }
path = { type = "minimum-jerk", start = [0.0, 0.0, 5.0], end = [0.5, 0.0, 5.5], duration = 2.0 }
simulation = { duration = 0.2 }
controller = { type = "planar-pd" }
"""
SET = """\
vehicle = { type = "planar" }
path = { type = "step", start = [0.0, 0.0, 5.0], end = [0.0, 0.0, 5.0], duration = 3.0 }
simulation = { guidance_period = 0.002 }
controller = { type = "planar-pd" }
"""


def proved(folder, text, *options):
    """The content of a mission's certificate."""
    run = quadstep("prove", write(folder, text), *options, "--out", folder / "proof.json")
    assert (run.code, run.err) == (0, "")
    return json.loads((folder / "proof.json").read_text())


def forged(content):
    """A certificate's file with its digest computed again, as whoever tampers with it would; what is no JSON is left so."""
    try:
        return sealed(json.loads(content) if isinstance(content, str) else content)
    except ValueError:
        return (content if isinstance(content, str) else json.dumps(content)).encode()


def checked(folder, content):
    """The check of this content, its digest computed again."""
    (folder / "tampered.json").write_bytes(forged(content))
    return quadstep("prove", "--check", folder / "tampered.json")
