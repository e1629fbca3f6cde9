"""The colours of `colours.css`, which the live page has too: for figures, and for a report in the light and in the dark."""

import re
from importlib.resources import files

SOURCE = files("quadstep.report").joinpath("colours.css").read_text(encoding="utf-8")
ON_PAPER, _, IN_THE_DARK = SOURCE.partition(':root[data-theme="dark"]')
STYLE = f"{ON_PAPER}@media screen and (prefers-color-scheme: dark) {{ :root{IN_THE_DARK} }}\n"
"""For a page that follows its reader's system."""

COLOURS: dict[str, str] = dict(re.findall(r"--(\w+): (#\w{6});", ON_PAPER))
"""By name, on paper."""

NAMES = {value: name for name, value in COLOURS.items() if name != "raised"}

CURVES = tuple(COLOURS[name] for name in ("blue", "orange", "green", "pink"))

DRAWN = re.compile(r'(?<=: |=")#([0-9a-f]{6})\b')


def themed(svg: str) -> str:
    """A drawing in the colours of the page it stands on: greys are between its ink and its ground; others stay as they are."""

    def themed_colour(match: re.Match[str]) -> str:
        colour, value = match[0], match[1]
        if colour in NAMES:
            return f"var(--{NAMES[colour]})"
        if value != 3 * value[:2]:
            return colour
        ink = round(100.0 * (1.0 - int(value[:2], 16) / 255.0))
        return f"color-mix(in srgb, var(--ink) {ink}%, var(--raised))"

    return DRAWN.sub(themed_colour, svg)
