"""What figures are drawn on: file formats, width, style and signals, as a user asks for them."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar, cast

from quadstep.io.errors import UserError, unknown_name
from quadstep.io.files import FileKind, read_text

FORMATS = ("png", "svg", "pdf")
USUAL, ON_SCREEN = "png,svg", "svg"
"""Of what is kept or made a report of, and of a single flight, which is to be there at once."""

SCREEN, PAPER = "screen", "paper"
NARROWEST, WIDEST = 40.0, 1000.0
"""Widths [mm] at which labels still have room."""

COLUMN = 8.0
"""Width of a report's column [in]: what is no wider has text of 7 pt and more when the report is printed on A4."""

PHONE = 4.19
"""Width [in] of what a phone of 360 pixels shows whole with words of 9 pixels: of figures that are one column of axes, and the
most of a part of a figure that it shows below the others.
"""

OURS = frozenset((
    "backend", "backend_fallback", "interactive", "toolbar", "docstring.hardcopy", "figure.hooks", "figure.autolayout",
    "figure.constrained_layout.use", "text.usetex", "text.parse_math",
))  # fmt: skip
"""Settings that a style file cannot change: they are no looks, run programs, or are what our layout and text rest on."""

STYLE_FILE = FileKind("a style file", 100_000)

IN_PRINT = {
    "font.family": ["STIXGeneral", "DejaVu Sans"],  # the second for signs that the first lacks
    "mathtext.fontset": "stix",
    "font.size": 8,
    "legend.fontsize": 7,
    "axes.linewidth": 0.6,
    "grid.linewidth": 0.4,
    "svg.fonttype": "path",
}
"""The style `paper`: a Times-like face that comes with Matplotlib."""


T = TypeVar("T")


class Sheet(NamedTuple):
    """formats: of `FORMATS`. width [mm]: of each figure, None: as suits it. settings: of Matplotlib, beside the usual ones.
    signals: names of figures and of their panels, which alone are drawn; none: all.
    """

    formats: tuple[str, ...] = ("png", "svg")
    width: float | None = None
    settings: tuple[tuple[str, object], ...] = ()
    signals: tuple[str, ...] = ()

    def inches(self, usual: float) -> float:
        """The width of a figure that would like to be `usual` wide [in]."""
        return usual if self.width is None else self.width / 25.4

    def side_by_side(self, most: int, least: float = 2.7) -> int:
        """How many panels of at least `least` [in] stand beside each other, of `most` that would like to."""
        return max(1, min(most, int(self.inches(COLUMN) / least)))

    @property
    def dpi(self) -> float:
        """Of PNG files: what a screen shows, or what a press wants."""
        return 130.0 if self.width is None else 300.0

    def with_svg(self) -> "Sheet":
        """The same with SVG files, which a report is made of."""
        return self if "svg" in self.formats else self._replace(formats=(*self.formats, "svg"))

    def shown(self) -> "Sheet":
        """The same with SVG files where there is nothing else that a page can show."""
        return self if "png" in self.formats else self.with_svg()

    def chosen(self, panels: Iterable[tuple[str, str, T]]) -> list[T]:
        """Those of the panels that are among its signals, in the order of these. panels: name of the figure, label, panel."""
        if not self.signals:
            return [panel for _, _, panel in panels]
        wanted = [squeezed(one) for one in self.signals]
        places = [
            (min((wanted.index(one) for one in map(squeezed, (figure, *named(label))) if one in wanted), default=None), panel)
            for figure, label, panel in panels
        ]
        found = [(place, panel) for place, panel in places if place is not None]
        return [panel for _, panel in sorted(found, key=lambda one: one[0])]

    def lacking(self, figures: Mapping[str, Iterable[str]]) -> list[str]:
        """Its signals that are in none of the figures. figures: the labels of their panels by name."""
        known = {squeezed(one) for one in signals_of(figures)}
        return [one for one in self.signals if squeezed(one) not in known]

    def check_signals(self, figures: Mapping[str, Iterable[str]]) -> None:
        """The same. Raises UserError for the first."""
        for one in self.lacking(figures):
            raise UserError(f"--signals: {unknown_name('signal', one, signals_of(figures))}")


def signals_of(figures: Mapping[str, Iterable[str]]) -> list[str]:
    """What can be chosen: figures, then their panels."""
    return [*dict.fromkeys([*figures, *(one for labels in figures.values() for label in labels for one in named(label))])]


def named(label: str) -> list[str]:
    """The signals that a panel shows, by its label: one, or columns with commas between them."""
    return label.split(", ")


def squeezed(name: str) -> str:
    """A name as it may be typed without quotes: z_d-z, for the panel z_d - z."""
    return "".join(name.split())


def sheet(figures: str = USUAL, width: float | None = None, style: str = SCREEN, signals: str | None = None) -> Sheet:
    """What --figures, --width, --style and --signals ask for. Raises UserError."""
    formats = tuple(dict.fromkeys(name.strip().lower() for name in figures.split(",")))
    for name in formats:
        if name not in FORMATS:
            raise UserError(f"--figures: {unknown_name('format', name, FORMATS)}, separated by commas")
    if width is not None and not (math.isfinite(width) and NARROWEST <= width <= WIDEST):
        raise UserError(f"--width: should be from {NARROWEST:g} to {WIDEST:g} mm, not {width:g}")
    settings = {} if style == SCREEN else IN_PRINT if style == PAPER else style_file(Path(style))
    names = () if signals is None else tuple(one.strip() for one in signals.split(","))
    return Sheet(formats, width, tuple(settings.items()), names)


def style_file(path: Path) -> dict[str, object]:
    """The settings in a Matplotlib style file, each as Matplotlib understands it. Raises UserError naming the line."""
    if path.suffix != ".mplstyle":
        raise UserError(f"--style: {unknown_name('style', str(path), (SCREEN, PAPER), 'a file NAME.mplstyle')}")
    from matplotlib import RcParams, rcParamsDefault  # noqa: PLC0415 (loaded only where it is used)

    settings: dict[str, object] = {}
    for number, line in enumerate(read_text(path, STYLE_FILE).splitlines(), start=1):
        name, colon, value = line.partition(":")
        name, value = name.strip(), value.strip()
        if not name or name.startswith("#"):
            continue
        if not colon or name in OURS or name not in rcParamsDefault:
            raise UserError(f"{path}: line {number}: {name!r:.60} is not a setting of a Matplotlib style")
        try:
            checked = RcParams({name: value.partition(" #")[0].strip().strip('"')})
            settings[name] = cast(Mapping[str, object], checked)[name]
        except ValueError as error:
            raise UserError(f"{path}: line {number}: {name}: {str(error).splitlines()[0]:.200}") from None
    return settings
