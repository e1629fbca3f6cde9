"""The typefaces of pages and figures have every sign that these use."""

import pytest
from fontTools.ttLib import TTFont
from matplotlib.font_manager import findfont

from quadstep.report import canvas, markup, mathml, units
from quadstep.report.sheet import Sheet

HELD = {*TTFont(markup.FOR_FIGURES).getBestCmap()}


def test_figures_have_every_symbol_and_are_set_in_it():
    signs = {*units.GREEK.values(), *(mark for _, mark in units.ACCENTS.values()), "−≥≤±µ°×⁻⁰¹²³⁴⁵⁶⁷⁸⁹✓✗…–’“”→"}
    assert {ord(sign) for sign in "".join(signs)} <= HELD
    with canvas.drawing(Sheet()):
        assert findfont("Inter", fallback_to_default=False) == str(markup.FOR_FIGURES)


def test_a_page_holds_its_typeface_and_that_of_formulas_where_it_has_one():
    plain, set_ = markup.page_text("a", ["text"]), markup.page_text("a", [mathml.mathml("x")])
    assert plain.count("@font-face") == 1
    assert set_.count("@font-face") == 2


@pytest.mark.parametrize("name", ["inter.woff2", "inter.ttf", "math.woff2"])
def test_every_font_is_small_and_its_licence_lies_beside_it(name):
    assert (markup.FONTS / name).stat().st_size < 70_000
    text = (markup.FONTS / "LICENSES.txt").read_text(encoding="utf-8")
    assert text.count("SIL OPEN FONT LICENSE") == 2
