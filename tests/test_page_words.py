"""Words and numbers on the page, in a real browser: nothing covers them, and they read well."""

import re
import tomllib

import pytest

from quadstep.engines.fly import fly
from quadstep.mission.schema import Mission
from quadstep.page.build import fly_missions
from tests.commands import write
from tests.needs import CHROMIUM, needs, package

package("playwright")
pytestmark = needs(CHROMIUM)

WINDY = """name = "Windy"
vehicle = { preset = "crazyflie" }
path = { type = "minimum-jerk", end = [0.5, 0.0, 0.5], duration = 1.12 }
controller = { type = "rotation-backstepping" }
wind = { mean = [8.0, 0.0, 0.0] }
"""
HASTY = """name = "Hasty"
path = { type = "minimum-jerk", end = [20.0, 5.0, 10.0], duration = 3.0 }
"""
WEAK = """name = "Weak"
[vehicle.rotors]
limits = [0.0, 2.0]
[path]
type = "minimum-jerk"
end = [1.0, 0.0, 0.0]
duration = 1.0
"""
LIMITED = """name = "Limited"
path = { type = "minimum-jerk", end = [0.0, 0.0, 1.0], duration = 3.0 }
vehicle = { rotors = { limits = [0.0, 8.0] } }
"""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """A small vehicle in a strong wind, the paper's flight that is lost, and one with rotors that are too weak."""
    folder = tmp_path_factory.mktemp("page")
    missions = [write(folder, text, f"{i}.toml") for i, text in enumerate((WINDY, HASTY, WEAK, LIMITED))]
    return write(folder, fly_missions(missions), "page.html")


def test_the_clock_tells_both_times_in_the_same_way(open_page):
    page = open_page()
    for flight, words in (("windy", "1.12 / 1.12 s"), ("hasty", "2.26 / 2.26 s")):
        page.evaluate("id => { quadstep.select(id); quadstep.seek(1e9); }", flight)
        assert page.locator("#time").inner_text() == words
    page.evaluate("quadstep.select('windy')")
    assert page.locator("#outcome").inner_text() == "Flew 1.12 s, with problems: large error"
    assert page.locator("#summary-words").inner_text().startswith("Its error is large: ")


def test_letters_of_symbols_have_the_face_of_formulas_and_words_and_units_do_not(open_page):
    page = open_page()
    page.evaluate("quadstep.select('hasty')")
    letters = page.locator("#plot-position-error .legend i")
    assert letters.all_text_contents() == ["x", "x", "y", "y", "z", "z"]
    assert letters.first.evaluate("one => getComputedStyle(one).fontFamily").startswith('"STIX Two Math"')
    page.wait_for_function("[...document.fonts].some(({ family, status }) => family.includes('STIX') && status === 'loaded')")
    names = {name.text_content(): name.locator("i").all_text_contents() for name in page.locator("#controls .name").all()}
    assert (names["Kr1"], names["Λ1"], names["filter frequency"]) == (["K"], ["Λ"], [])
    page.evaluate("quadstep.select('windy')")
    assert page.locator("#plot-attitude .legend i").all_text_contents() == []  # yaw, pitch, roll
    assert page.locator("#plot-attitude-error .legend i").all_text_contents() == []
    assert page.locator("#plot-wind .legend sub").all_text_contents() == ["x", "y", "z"]


def test_a_control_shows_four_digits_and_flies_all(open_page):
    page = open_page()
    boxes = page.locator("#controls input[type=text]")
    shown = [text.replace("−", "-") for text in boxes.evaluate_all("boxes => boxes.map(box => box.value)") if text]
    assert len(shown) > 20
    assert all(len(text.lstrip("-0.").replace(".", "")) <= 4 or text.lstrip("-").isdigit() for text in shown), shown
    box = page.locator("#controls input[type=text][aria-label^='K i1']:visible").first
    assert box.input_value() == "0.06246"
    box.focus()
    assert float(box.input_value()) == pytest.approx(0.06246, abs=5e-6)
    assert len(box.input_value()) > len("0.06246")
    box.blur()
    assert box.input_value() == "0.06246"
    assert page.evaluate("quadstep.settings().values") == {}
    box.fill("0.123456")
    box.press("Enter")
    box.blur()
    assert (box.input_value(), box.get_attribute("title")) == ("0.1235", "0.123456")
    assert "K_i1:0.123456,0.123456,0.123456" in page.url


BOXES = """(selector) => [...document.querySelectorAll(selector)].filter((one) => one.checkVisibility()).map((one) => {
  const { left, top, right, bottom } = one.getBoundingClientRect();
  return { left, top, right, bottom, text: one.textContent };
})"""


def overlap(a, b):
    return a["left"] < b["right"] and b["left"] < a["right"] and a["top"] < b["bottom"] and b["top"] < a["bottom"]


def assert_apart(some, others):
    assert [(a["text"], b["text"]) for a in some for b in others if overlap(a, b)] == []


def drawn(page, script):
    """What is seen once the scene has been drawn anew."""
    page.evaluate(script)
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def test_no_words_of_the_scene_stand_under_what_explains_it(open_page):
    page = open_page(webgl=True, width=1200, height=800)
    seen = set()
    for camera in ("orbit", "follow"):
        page.click(f"#camera button[value={camera}]")
        for turn in range(8):
            drawn(page, f"quadstep.seek({turn} * 0.14)")
            page.locator("#scene").press("]")
            labels = page.evaluate(BOXES, ".label")
            seen |= {one["text"] for one in labels}
            assert_apart(labels, page.evaluate(BOXES, "#legend, #caption, #camera, .badge"))
            for place, label in enumerate(labels):
                assert_apart([label], labels[place + 1 :])
    assert len(seen) > 8
    for part in ("#legend", "#caption"):
        colour = page.locator(part).evaluate("one => getComputedStyle(one).backgroundColor")
        assert float(re.search(r"[/,] ([\d.]+)\)$", colour)[1]) > 0.85, colour


@pytest.mark.parametrize(("width", "height"), [(1200, 800), (360, 740)])
def test_what_is_said_of_a_lost_vehicle_stands_beside_it(open_page, width, height):
    page = open_page("#flight=hasty", webgl=True, width=width, height=height)
    drawn(page, "quadstep.seek(1e9)")
    (call,) = page.evaluate(BOXES, ".call")
    assert call["text"] == "✕ Lost: turning faster than 100 rad/s"
    (frame,) = page.evaluate(BOXES, "#labels")
    vehicle = page.evaluate("quadstep.camera().vehicle")
    x, y, radius = frame["left"] + vehicle["x"], frame["top"] + vehicle["y"], vehicle["radius"]
    assert radius > 10
    around = {"left": x - radius, "right": x + radius, "top": y - radius, "bottom": y + radius, "text": "vehicle"}
    assert_apart([call], [around, *page.evaluate(BOXES, ".label:not(.call), #legend, .badge, #camera")])
    assert frame["left"] <= call["left"] and call["right"] <= frame["right"]
    assert frame["top"] <= call["top"] and call["bottom"] <= frame["bottom"]
    assert page.locator(".call").evaluate("one => getComputedStyle(one).backgroundColor") == "rgb(255, 255, 255)"


def test_warnings_are_sentences(open_page):
    page = open_page("#flight=weak")
    warnings = page.locator("#story .why").all_inner_texts()
    assert (
        warnings[0].replace("\u00a0", " ")
        == "Warning: vehicle.rotors.limits: four rotors lift at most 8 N, the weight is 9.81 N."
    )
    page.evaluate("quadstep.setControl('K_r1', 4)")
    assert not page.locator("#story .why:visible").count(), "which were of the original"
    page.evaluate("quadstep.setControl('K_r1', 3)")
    assert page.locator("#story .why:visible").count() == len(warnings)
    assert len(warnings) > 1
    assert all(re.fullmatch(r"[A-Z][^\n]+[^.]\.", warning) for warning in warnings)
    page.evaluate("quadstep.setControl('mass', 0.5)")
    assert not page.locator("#story .why:visible").count()  # it is light enough now


def test_rotors_that_reach_their_limits_for_a_moment_are_said_to_as_fly_says_it(open_page):
    page = open_page("#flight=limited")
    given = Mission.model_validate(tomllib.loads(LIMITED.replace("8.0", "2.61")))
    _, (said,) = given.flight_metrics(fly(given.plan()))
    page.evaluate("quadstep.setControl('limits', [0, 2.61])")
    share, _, limit = said.partition(": ")  # which limit it is only `fly` knows
    assert page.locator("#summary-words").inner_text() == f"{share[0].upper()}{share[1:]}."
    assert limit == "by full thrust 7.64 %"
    page.evaluate("quadstep.setControl('limits', [0, 2.6])")  # so often that it breaks a rule, which says it
    assert page.locator("#summary-words").inner_text().startswith("Its rotors were saturated ")


def test_paper_has_the_reason_that_a_telephone_leaves_to_the_badge(open_page):
    page = open_page("#flight=hasty", width=360)
    assert page.locator("#summary-words").is_hidden()
    page.emulate_media(media="print")
    assert "the numbers stop at the last sample before" in page.locator("#summary-words").inner_text()
    page.emulate_media(media="screen")
