"""The plots of the page in a real browser: pointed at, zoomed, chosen, arranged, added and laid over."""

import re
from pathlib import Path

import pytest

from quadstep.page.missions import fly_missions
from tests.browsers import picture
from tests.commands import write
from tests.needs import CHROMIUM, needs, package

package("playwright")
pytestmark = needs(CHROMIUM)

CASE_1 = Path(__file__).parent.parent / "examples" / "case1.toml"


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """Case 1."""
    return write(tmp_path_factory.mktemp("page"), fly_missions([CASE_1]), "page.html")


def test_plots_share_cursor_zoom_and_hover(open_page):
    page = open_page()
    stage = page.locator("#plot-position .stage")
    box = stage.bounding_box()

    def across(share):
        return box["x"] + 48 + share * (box["width"] - 58)

    middle = box["y"] + box["height"] / 2
    page.mouse.click(across(0.5), middle)
    assert page.evaluate("quadstep.time()") == pytest.approx(20, abs=0.3)
    page.mouse.move(across(0.25), middle)
    tip = page.locator("#plot-position .tip").inner_text()
    assert "t = 10.0" in tip or "t = 9.9" in tip
    assert re.search(r"x\s+[\d.]+\sm", tip)
    page.mouse.move(across(0.2), middle)
    page.mouse.down()
    page.mouse.move(across(0.4), middle, steps=3)
    page.mouse.up()
    assert page.locator("#whole").is_visible()
    page.mouse.click(across(0.5), middle)
    assert page.evaluate("quadstep.time()") == pytest.approx(12, abs=0.3)
    page.mouse.dblclick(across(0.5), middle)
    assert not page.locator("#whole").is_visible()
    page.mouse.wheel(0, -200)
    page.wait_for_selector("#whole", state="visible")


def test_plots_are_chosen_arranged_added_and_laid_over(open_page):
    page = open_page()

    def ids():
        return [one.get_attribute("id").removeprefix("plot-") for one in page.locator("#plots-list .plot").all()]

    before = ids()
    page.click("#chooser summary")
    page.locator("#chooser").get_by_text("Position error", exact=True).click()
    assert ids() == [one for one in before if one != "position-error"]
    page.hover("#plot-attitude")
    page.click("#plot-attitude button[aria-label^=Up]")
    assert ids()[:2] == ["attitude", "position"]
    page.click("#plot-attitude button[aria-label^='log axis']")
    for kind, columns, title in (
        ("time", ["u", "norm_r1"], "u, norm_r1"),
        ("phase", ["x", "x_dot"], "x_dot over x"),
        ("spectrum", ["theta"], "Spectrum of θ"),
    ):
        page.select_option("#own-kind", kind)
        page.select_option("#own-columns", columns)
        page.click("#own-add")
        assert page.locator("#plots-list h3").first.inner_text() == title
    page.select_option("#own-kind", "phase")
    page.click("#own-add")
    assert "Choose two columns" in page.locator("#chooser .quiet").inner_text()
    page.click("#keep")
    page.evaluate("quadstep.setControl('t_f', 20)")
    assert "kept" in page.locator("#plot-position .roles").inner_text()
    assert picture(page, "#plot-own-2 .stage").std() > 0.02
