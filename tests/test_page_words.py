"""Words and numbers on the page, in a real browser: nothing covers them, and they read well."""

import pytest

from quadstep.page.missions import fly_missions
from tests.commands import write
from tests.needs import CHROMIUM, needs, package

package("playwright")
pytestmark = needs(CHROMIUM)

WINDY = """name = "Windy"
[vehicle]
preset = "crazyflie"
[path]
type = "minimum-jerk"
end = [0.5, 0.0, 0.5]
duration = 1.12
[controller]
type = "rotation-backstepping"
[wind]
mean = [8.0, 0.0, 0.0]
"""
HASTY = """name = "Hasty"
[path]
type = "minimum-jerk"
end = [20.0, 5.0, 10.0]
duration = 3.0
"""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """A small vehicle in a strong wind, and the paper's flight that is lost."""
    folder = tmp_path_factory.mktemp("page")
    missions = [write(folder, text, f"{i}.toml") for i, text in enumerate((WINDY, HASTY))]
    return write(folder, fly_missions(missions), "page.html")


def test_the_clock_tells_both_times_in_the_same_way(open_page):
    page = open_page()
    for flight, words in (("windy", "1.12 / 1.12 s"), ("hasty", "2.60 / 2.60 s")):
        page.evaluate("id => { quadstep.select(id); quadstep.seek(1e9); }", flight)
        assert page.locator("#time").inner_text() == words
    page.evaluate("quadstep.select('windy')")
    assert page.locator("#outcome").inner_text() == "Flew for 1.12 s"
    assert page.locator("#summary-words").inner_text() == "Completed all 1.12 s."


def test_a_control_shows_four_digits_and_flies_all(open_page):
    page = open_page()
    boxes = page.locator("#controls input[type=text]")
    shown = [text.replace("−", "-") for text in boxes.evaluate_all("boxes => boxes.map(box => box.value)") if text]
    assert len(shown) > 20
    assert all(len(text.lstrip("-0.").replace(".", "")) <= 4 or text.lstrip("-").isdigit() for text in shown), shown
    box = page.locator("#controls input[type=text][aria-label^='K_i1']:visible").first
    assert box.input_value() == "0.144"
    box.focus()
    assert float(box.input_value()) == pytest.approx(0.1440329, abs=1e-7)
    box.blur()
    assert box.input_value() == "0.144"
    assert page.evaluate("quadstep.settings().values") == {}
    box.fill("0.123456")
    box.press("Enter")
    box.blur()
    assert (box.input_value(), box.get_attribute("title")) == ("0.1235", "0.123456")
    assert "K_i1:0.123456,0.123456,0.123456" in page.url
