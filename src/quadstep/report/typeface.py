"""The typeface of pages, reports and figures, Inter, and of formulas, STIX Two Math; `fonts/` has them and their licences."""

import base64
from functools import cache
from importlib.resources import files
from pathlib import Path

FONTS = Path(str(files("quadstep.report").joinpath("fonts")))
TEXT, FORMULAS = "Inter", "STIX Two Math"
FOR_FIGURES = FONTS / "inter.ttf"
"""What Matplotlib measures and draws: regular, of all signs of the others."""

WEIGHTS = {TEXT: "400 700", FORMULAS: "400"}
FILES = {TEXT: "inter.woff2", FORMULAS: "math.woff2"}


@cache
def face(name: str) -> str:
    """A typeface as CSS that holds it."""
    data = base64.b64encode((FONTS / FILES[name]).read_bytes()).decode()
    return (
        f'@font-face {{ font-family: "{name}"; font-weight: {WEIGHTS[name]}; '
        f'src: url("data:font/woff2;base64,{data}") format("woff2"); }}\n'
    )


def faces(text: str) -> str:
    """What a page of this text needs."""
    return face(TEXT) + (face(FORMULAS) if "<math" in text else "")
