"""The page and the article in Firefox: both draw, fly, take what is dropped and dragged, and report no error."""

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.page.build import missions_page
from quadstep.proofs.article import article
from tests.dropped import DROP, carried
from tests.firefox import Firefox
from tests.needs import FIREFOX, needs, without
from tests.pages import FLIGHTS, flown, mission

pytestmark = needs(FIREFOX)

CASE = FLIGHTS["other clock"]


@pytest.fixture(scope="module")
def firefox():
    try:
        running = Firefox()
    except RuntimeError as error:  # a program of this name that only asks for Firefox to be installed, say
        without(FIREFOX, str(error))
    yield running
    running.close()


@pytest.fixture
def opened(firefox, tmp_path):
    """The page, open; what it complained of fails the test."""
    file = tmp_path / "page.html"
    file.write_text(missions_page([flown("case", CASE)]), encoding="utf-8")
    firefox.open(file)
    assert firefox.evaluate("return document.documentElement.dataset.ready") == "yes"
    yield firefox
    assert firefox.errors(file) == []


def rows(page):
    return np.array(page.evaluate("return quadstep.rows()"))


def test_plots_are_drawn(opened):
    drawn = opened.evaluate("""
        const colours = (one) => {
          const { data } = one.getContext("2d").getImageData(0, 0, one.width, one.height);
          return new Set(new Uint32Array(data.buffer)).size;
        };
        const plots = [...document.querySelectorAll("#plots-list canvas")].filter((one) => one.width && one.height);
        const seen = (one) => new Promise((done) => {
          one.scrollIntoView();
          const look = () => (colours(one) > 20 ? done(colours(one)) : setTimeout(look, 50));
          look();
        });
        return plots.reduce(async (before, one) => [...await before, await seen(one)], Promise.resolve([]));
    """)
    assert len(drawn) >= 5
    assert min(drawn) > 20  # colours: lines, axes, and what smooths them; drawn once a plot is in sight


def test_case_flies_as_in_python_and_again_with_another_number(opened):
    np.testing.assert_array_equal(rows(opened), fly(CASE.plan()).rows)
    opened.press("#controls input[type=text]", "3\ue007")  # and Enter
    assert "set=" in opened.evaluate("return location.hash")
    opened.evaluate("document.getElementById('reset').click()")
    opened.evaluate("quadstep.setControl('K_r1', [4, 3, 5])")
    changed = mission(**{**CASE.model_dump(include={"simulation"}), "controller": {"type": "backstepping", "K_r1": [4, 3, 5]}})
    np.testing.assert_array_equal(rows(opened), fly(changed.plan()).rows)


def test_log_that_is_dropped_lies_beside_the_flight(opened):
    said = opened.evaluate(f"return ({DROP})(...arguments)", *carried("log.csv", b"t,x[m]\n10,1\n10.5,2\n11,4\n"))
    assert said.startswith("Opened log.csv: CSV with 1 signal, 1.0 s long.")
    assert opened.evaluate("return quadstep.signal('x')") == [[0, 0.5, 1], [1, 2, 4]]


LATER = """
const drawing = document.querySelector(`#${arguments[0]} .drawing`), [, before, said] = arguments;
return new Promise((done) => {
  const changed = () => drawing.innerHTML !== before && drawing.innerHTML.includes(said);
  const look = () => (changed() ? done(drawing.innerHTML) : setTimeout(look, 50));
  look();
});
"""
"""A figure of the article once it is no longer what it was and says so; the test fails where that never comes."""


def test_figures_of_the_article_follow_keyboard_and_finger(firefox, tmp_path):
    file = tmp_path / "article.html"
    file.write_text(article(), encoding="utf-8")
    firefox.open(file)
    firefox.ask("WebDriver:SetWindowRect", width=600, height=900)
    drawn = "return document.querySelector(`#${arguments[0]} .drawing`).innerHTML"
    for name in ("nested", "sliding", "net", "inversion", "lyapunov"):
        before = firefox.evaluate(drawn, name)
        firefox.press(f"#{name} input", ("\ue014" if name == "lyapunov" else "\ue012") * 8)  # arrows
        assert firefox.evaluate(LATER, name, before, "") != before, name
    where = """
        const handle = document.querySelector(`#${arguments[0]} .handle`);
        handle.scrollIntoView({ block: "center", behavior: "instant" });
        const { x, y, width, height } = handle.getBoundingClientRect();
        return [Math.round(x + width / 2), Math.round(y + height / 2)];
    """
    for name, said in (("sliding", " at the start: −"), ("inversion", "misses by")):
        before = firefox.evaluate(drawn, name)
        x, y = firefox.evaluate(where, name)
        moves = [{"type": "pointerMove", "x": x, "y": y + down} for down in (0, 60, 120, 170)]
        steps = [moves[0], {"type": "pointerDown", "button": 0}, *moves[1:], {"type": "pointerUp", "button": 0}]
        finger = {"type": "pointer", "id": "finger", "parameters": {"pointerType": "touch"}, "actions": steps}
        firefox.ask("WebDriver:PerformActions", actions=[finger])
        assert firefox.evaluate(LATER, name, before, said) != before
    dropped = """
        const parts = [...document.querySelector("a[data-set='K_r1=8'] msub").children];
        const [letter, low] = parts.map((one) => one.getBoundingClientRect());
        return (low.bottom - letter.bottom) / letter.height;
    """
    assert firefox.evaluate(dropped) < 0.3, "the line under a link takes part in a formula's layout"
    assert firefox.errors(file) == []


def test_complaint_of_a_page_is_seen(firefox, tmp_path):
    file = tmp_path / "wrong.html"
    file.write_text("<!doctype html><script>absent()</script>")
    firefox.open(file)
    assert firefox.errors(file) == ["ReferenceError: absent is not defined"]
