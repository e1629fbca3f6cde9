"""The guided walk in a real browser: what is new is seen, and has the focus."""

import pytest

from quadstep.engines.engine import Engine
from quadstep.page.build import build_page, fly_missions, with_walk
from quadstep.page.story import OWN, read_story
from tests.browsers import axe
from tests.commands import LINE, write
from tests.missions import EXAMPLES
from tests.needs import CHROMIUM, needs, package

package("playwright")
pytestmark = needs(CHROMIUM)

STEP = """## Step {number}

```toml
mission = "mission.toml"
move = "K_r1"
watch = "net"
```

A sentence that is long enough to take some room on a telephone, and another one of the same kind. It is step {number}.

"""


ASKED = """
success = { largest = [0.0, 100.0] }

[guess]
ask = "Sooner or later?"
choices = ["sooner", "later"]
answer = "later"
show = { K_r1 = 1.5 }
"""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """Two steps, each on a short flight of its own."""
    folder = tmp_path_factory.mktemp("walk")
    write(folder, LINE)
    write(folder, LINE, "other.toml")
    second = STEP.format(number=2).replace("mission.toml", "other.toml")
    story = write(folder, "# A walk\n\n" + STEP.format(number=1) + second, "story.md")
    return write(folder, fly_missions([], story=read_story(story)), "page.html")


@pytest.mark.parametrize(("width", "height"), [(360, 740), (900, 700), (1200, 800)])
def test_a_step_begins_in_sight_and_with_the_focus(open_page, page_file, width, height):
    page = open_page(width=width, height=height)

    def assert_new(selector):
        new = page.locator(selector)
        assert new.evaluate("one => one === document.activeElement")
        box, stage = new.bounding_box(), page.locator("#stage").bounding_box()
        assert box["y"] >= (stage["y"] + stage["height"] if width < 760 else 0)
        assert box["y"] + box["height"] <= height

    page.locator("#walk .stretch").first.evaluate("one => one.after(one.cloneNode(true))")
    page.locator("#walk .stretch").last.evaluate("one => one.firstChild.classList.add('field')")  # has a layout of its own
    page.click("#guide-start")
    assert_new("#guide h2")
    for button, title in (("next", "Step 2"), ("back", "Step 1"), ("next", "Step 2")):
        page.click(f"#guide-{button}")
        assert page.locator("#guide h2").inner_text() == title
        assert_new("#guide h2")
        assert page.locator("#walk").is_hidden()  # what a step moves and shows needs the room
        flight = page.evaluate("quadstep.settings().flight")
        page.keyboard.press("n" if title == "Step 1" else "p")
        assert page.evaluate("quadstep.settings().flight") == flight, "a step chooses its own"
    page.go_back()
    page.wait_for_function("() => document.querySelector('#guide h2').textContent === 'Step 1'")
    page.go_forward()
    page.wait_for_function("() => document.querySelector('#guide h2').textContent === 'Step 2'")
    page.click("#guide-finish")
    assert_new("#guide-start")
    assert page.locator("#walk").is_visible()


@pytest.mark.parametrize(("place", "said", "width"), [(0, "✕", 360), (1, "✓", 1200)])
def test_a_step_waits_for_a_guess_then_flies_and_says_what_was_right(open_page, tmp_path, place, said, width):
    write(tmp_path, LINE)
    step = STEP.format(number=1).replace('watch = "net"', 'watch = "position-error"' + ASKED)
    story = write(tmp_path, "# A walk\n\n" + step, "story.md")
    page = open_page(file=write(tmp_path, fly_missions([], story=read_story(story)), "page.html"), width=width, height=740)
    page.click("#guide-start")
    assert page.locator(".guide-trial").is_hidden()
    assert page.locator(".guide-trial .guide-text").first.is_hidden()  # it answers the guess
    assert page.locator("#controls").evaluate("one => one.inert")  # so would its sliders
    assert page.locator("#waits").is_visible() == (width > 1180)
    assert axe(page) == []
    page.locator(".choice").nth(place).focus()
    page.keyboard.press("Enter")
    assert page.locator(".guide-trial").is_visible()
    assert not page.locator("#controls").evaluate("one => one.inert") and page.locator("#waits").is_hidden()
    verdict = page.locator("#guess-verdict")
    assert verdict.inner_text().startswith(said) and "later" in verdict.inner_text()
    assert verdict.evaluate("one => one === document.activeElement")
    assert "K_r1:1.5" in page.evaluate("location.hash")
    assert page.locator(".guide-goal").inner_text().startswith("✓ Done")
    if (
        width < 760
    ):  # the scene, the title, the slider and its picture are in sight together, and what is said comes after them
        parts = "#stage", "#guide h2", ".guide-control .slider", ".guide-plot"
        stage, title, slider, plot = (page.locator(one).bounding_box() for one in parts)
        assert stage["y"] >= 0 and stage["y"] + stage["height"] <= title["y"] < slider["y"] < plot["y"]
        assert plot["y"] + plot["height"] <= 740
    assert page.locator(".guide-trial .guide-text").first.is_visible()
    assert axe(page) == []


def test_a_walk_shows_what_was_not_guessed_and_ends_with_how_many_guesses_were_right(open_page, tmp_path):
    write(tmp_path, LINE)
    step = STEP.format(number=1).replace('watch = "net"', 'watch = "position-error"' + ASKED)
    second = step.replace("Step 1", "Step 2").replace("show =", 'controller = "completed-backstepping"\nshow =')
    story = write(tmp_path, "# A walk\n\n" + step + second, "story.md")
    page = open_page(file=write(tmp_path, fly_missions([], story=read_story(story)), "page.html"), width=1440)
    page.click("#guide-start")
    page.locator(".choice").nth(1).click()
    assert page.locator("#plots .guide-plot .plot").count() == 1  # where the other plots are
    page.click("#guide-next")
    assert page.locator("#guide-finish").inner_text() == "Show me" and page.locator("#plots .guide-plot .plot").count() == 0
    page.click("#guide-finish")
    assert page.locator("#guess-verdict").inner_text() == "The answer: later."
    assert page.locator(".guide-trial").is_visible() and "completed-backstepping.K_r1:1.5" in page.evaluate("location.hash")
    assert page.evaluate("quadstep.settings().controller") == "completed-backstepping"
    page.click("#guide-finish")
    card = page.locator(".guide-card").inner_text()
    assert "Right guesses: 1 of 1." in card and "quadstep explain" in card and "Six motions, four inputs" in card
    assert page.evaluate("quadstep.settings().values") == {}
    assert page.locator(".guide-plot .plot").count() == 0


CALM = """
[controller]
type = "backstepping"
Lambda2 = 0.5
[disturbance]
scale = 0.0
"""


def test_a_step_that_wants_a_flight_as_commanded_is_not_done_by_one_that_begins_to_swing(open_page, tmp_path):
    write(tmp_path, (EXAMPLES / "case1.toml").read_text() + CALM, "mission.toml")
    wanted = STEP.format(number=1).replace('"K_r1"', '"K_r2"').replace('"net"', '"position-error"\nas_commanded = true')
    step = wanted.replace("as_commanded", "success = { rmse = [0.0, 0.01] }\nsolution = { K_r2 = 75 }\nas_commanded")
    any_that_completes = step.replace("as_commanded = true\n", "").replace("solution = { K_r2 = 75 }\n", "")
    any_that_completes = any_that_completes.replace("rmse = [0.0, 0.01]", "tilt = [0.0175]")
    story = write(tmp_path, "# A walk\n\n" + step + any_that_completes, "story.md")
    page = open_page(file=write(tmp_path, fly_missions([], story=read_story(story)), "page.html"))
    page.click("#guide-start")
    for gain, told in ((70.0, "Goal"), (75.0, "✓ Done"), (6.0, "Goal")):
        page.evaluate("gain => quadstep.setControl('K_r2', [gain, gain, gain])", gain)
        assert (
            page.locator(".guide-goal").inner_text()
            == f"{told}: a flight as commanded with an RMSE of up to 10.0\N{NO-BREAK SPACE}mm."
        )
    page.click("#guide-solution")  # for who gives up
    assert page.locator(".guide-goal").inner_text().startswith("✓ Done") and "K_r2:75" in page.evaluate("location.hash")
    page.click("#guide-next")
    assert not page.locator("#guide-solution").count(), "a step that gives none"
    page.evaluate("quadstep.setControl('K_r2', [70, 70, 70])")
    said, (_, problems) = page.locator(".guide-goal").inner_text(), page.locator("#outcome").inner_text().split("problems: ")
    assert said.startswith("✓ Done: a completed flight with a largest tilt of at least 1.00°.") and said.endswith(
        f"Problems remain: {problems}."
    )


def test_a_link_with_a_value_that_is_not_allowed_says_so(open_page, page_file):
    page = open_page("#set=backstepping.K_r1:-3", file=page_file)
    assert "sets backstepping.K_r1 to what is not allowed; the nearest allowed" in page.locator("#notice").inner_text()
    assert "K_r1:1e-9" in page.evaluate("location.hash")
    assert open_page("#set=backstepping.K_r1:3.5", file=page_file).locator("#notice").is_hidden()


def test_only_a_control_that_changes_how_long_the_path_takes_hides_that_it_is_flown_in_part(open_page, tmp_path):
    page = open_page(file=write(tmp_path, fly_missions([OWN.parent / "rotor.toml"]), "page.html"))
    for control, value, said in (("radius", 2.9, True), ("period", 9.5, False)):
        page.evaluate("([control, value]) => quadstep.setControl(control, value)", [control, value])
        assert ("Only the first 12 s of a path of" in page.locator("#summary-words").inner_text()) == said


def test_numbers_and_plots_say_from_when_on_errors_count(open_page, tmp_path):
    text = "score_from = 2.0\n" + (OWN.parent / "rotor.toml").read_text()
    page = open_page(file=write(tmp_path, fly_missions([write(tmp_path, text, "scored.toml")]), "page.html"))
    labels = page.locator("#summary-figures dt").all_inner_texts()
    assert labels[:2] == ["RMSE from 2 s on", "Largest error from 2 s on"] and "from" not in labels[2]
    assert page.locator("#plots .note", has_text="errors count").all_inner_texts() == [
        "Shaded: errors count only from 2 s on."
    ]
    assert page.locator("#plot-rotors .note").inner_text().startswith("Pale bands:")


def test_in_a_walk_a_flight_is_compared_with_its_step_as_it_began(open_page, tmp_path):
    step = STEP.format(number=1).replace('"net"', '"position-error"\nset = { K_r1 = 6.0 }')
    story = write(tmp_path, "# A walk\n\n" + step, "story.md")
    write(tmp_path, (EXAMPLES / "case1.toml").read_text(), "mission.toml")
    (flown,), walk = with_walk([], read_story(story), Engine.LANES)
    noted = build_page("A walk", (), [flown._replace(note="Of the file.")], walk=walk)
    page = open_page(file=write(tmp_path, noted, "page.html"))
    page.click("#guide-start")
    assert page.locator(".guide-place span").inner_text() == "Step 1 of 1"
    began = page.locator("#summary-figures dd").first.inner_text()
    assert page.locator("#summary-figures .filed").count() == 0
    page.evaluate("quadstep.setControl('K_r1', [4, 4, 4])")
    assert page.locator("#summary-figures .filed").first.inner_text() == f"was {began}"
    assert page.locator("#controls .hinted").inner_text().startswith("Drag a slider")  # the text is of the step


def test_time_pauses_where_the_plots_of_a_step_end_and_goes_on_when_asked(open_page, tmp_path):
    write(tmp_path, LINE)
    step = STEP.format(number=1).replace('watch = "net"', 'watch = "position-error"\nlook = "its end"\nwindow = [0, 0.4]')
    story = write(tmp_path, "# A walk\n\n" + step, "story.md")
    page = open_page(file=write(tmp_path, fly_missions([], story=read_story(story)), "page.html"), width=1440)
    page.click("#guide-start")
    assert page.locator(".guide-where").inner_text() == "“Position error”, the first plot on the right: its end."
    page.click("#play")  # which this browser, calm, leaves to the reader
    page.wait_for_function("() => quadstep.time() === 0.4", timeout=10_000)
    page.click("#play")
    page.wait_for_function("() => quadstep.time() > 0.4", timeout=10_000)
