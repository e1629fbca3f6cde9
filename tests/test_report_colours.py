"""One definition of colours for reports, figures, page and article: readable, and told apart, also without red and green."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import quadstep
from quadstep.report.colours import CURVES, IN_THE_DARK, ON_PAPER, themed
from quadstep.report.markup import style
from tests.frontend import FRONTEND

TO_DEUTERANOPIA = np.array([[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]])  # Machado et al. 2009
TO_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def light(colour):
    """Linear red, green and blue."""
    values = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def contrast(one, other):
    low, high = sorted(float(TO_LUMINANCE @ light(colour)) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def lightness(colour):
    """L* as seen without green cones."""
    return 116.0 * float(np.cbrt(TO_LUMINANCE @ TO_DEUTERANOPIA @ light(colour))) - 16.0


@pytest.mark.parametrize("rule", [ON_PAPER, IN_THE_DARK], ids=["light", "dark"])
def test_colours_can_be_read_and_told_apart_by_lightness(rule):
    colours = dict(re.findall(r"--(\w+): (#\w{6});", rule))
    for ground in ("paper", "panel", "raised"):
        for name in ("ink", "muted", "blue", "green", "vermillion", "fair"):
            assert contrast(colours[name], colours[ground]) >= 4.5, f"{name} on {ground} as text"
        for name in ("orange", "pink"):
            assert contrast(colours[name], colours[ground]) >= 3.0, f"{name} on {ground} as a curve"
    for one, other in itertools.pairwise(("blue", "orange", "green", "pink")):
        assert abs(lightness(colours[one]) - lightness(colours[other])) > 8.0, (one, other)


def test_a_figure_in_a_report_takes_the_colours_of_the_page():
    drawn = '<path style="stroke: {}"/><rect fill="{}"/><path style="fill: #440154"/><text>#e0e0e0</text>'
    grey = "color-mix(in srgb, var(--ink) 12%, var(--raised))"
    assert themed(drawn.format(CURVES[0], "#e0e0e0")) == drawn.format("var(--blue)", grey)


def test_no_caption_names_a_colour_that_differs_in_the_dark():
    """Maps that are pictures keep their colours, and their captions may name them."""
    colour = re.compile(r'(?<=[\s({f])"[^"\n]*\b(?:(?:black|white|grey|red)[,;:.)]|darker)[^"\n]*"', re.IGNORECASE)
    package = Path(quadstep.__file__).parent
    for path in {*package.glob("studies/**/*.py"), *package.glob("proofs/**/*.py")} - {package / "studies" / "envelope.py"}:
        assert not [said for said in colour.findall(path.read_text(encoding="utf-8")) if " " in said], path


def test_no_colour_is_defined_twice():
    assert style().count("--blue:") == 2, "light and dark"
    for name in ("view/theme.ts", "style/base.css"):
        assert not re.search(r'#[0-9a-f]{6}[;"]', (FRONTEND / "src" / name).read_text()), name
