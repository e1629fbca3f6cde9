"""The page of a campaign: its flights are those of `quadstep campaign`, to the bit, whatever control is moved."""

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.engines.wasm import exporting, import_names, leb, leb128, sections
from quadstep.io.errors import UserError
from quadstep.metrics.statistics import share
from quadstep.mission.read import plan_mission
from quadstep.page import answers, serve
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, SUCCESS, TIME, Flyer
from quadstep.studies.campaign.page import campaign_page, rate
from quadstep.studies.campaign.schema import read_campaign
from tests.commands import write
from tests.needs import CHROMIUM, needs, package
from tests.pages import serving

package("playwright")

FLIGHTS = 83  # no multiple of what a vector holds, or a worker takes at a time
GUSTS = """
flights = 83
precision = "{precision}"
[mission]
[mission.vehicle]
preset = "x500"
[mission.path]
type = "circle"
centre = [0.0, 0.0, 10.0]
radius = 3.0
period = 8.0
[mission.controller]
type = "geometric"
{gains}
[mission.wind]
mean = [6.0, 0.0, 0.0]
turbulence = {{ intensity = "moderate", height = 10.0 }}
[mission.limits]
distance = 0.35
[mission.simulation]
duration = 2.0
[vary]
wind.mean.0 = {{ type = "normal", mean = 9.0, deviation = 5.0 }}
[failure]
largest_error = 0.2
position_rmse = 0.19
"""


def campaign(folder, precision="f64", gains=""):
    return write(folder, GUSTS.format(precision=precision, gains=gains), "gusts.toml")


@pytest.fixture(scope="module", params=["f64", "f32"])
def precision(request):
    return request.param


@pytest.fixture(scope="module")
def page_file(tmp_path_factory, precision):
    folder = tmp_path_factory.mktemp("rate")
    return write(folder, campaign_page(campaign(folder, precision)), "page.html")


def assert_flown_as_by_the_campaign(page, path):
    page.wait_for_function("() => quadstep.rate()?.done")
    ours = page.evaluate("quadstep.rate()")
    table = Flyer(read_campaign(path)).fly(0, FLIGHTS)
    code = [OUTCOMES.index(one) for one in table[OUTCOME].to_pylist()]
    lost = np.array(code) != 0
    assert ours["outcome"] == code and 0 < lost.sum() < FLIGHTS
    for name in ("position_rmse", "largest_error"):
        np.testing.assert_array_equal(np.array(ours[name], dtype=float), table[f"{name}[m]"].to_numpy(), err_msg=name)
    np.testing.assert_array_equal(0.002 * np.array(ours["ended"])[lost], table[TIME].to_numpy()[lost])
    success = table[SUCCESS].to_numpy()
    np.testing.assert_array_equal(np.array(ours["success"], dtype=bool), success)
    failures = int((~success).sum())
    assert lost.sum() < failures == ours["failures"]
    assert page.locator("#rate-words b").inner_text().startswith(f"{failures} of {FLIGHTS} flights fail: ")
    drawn = [one.get_attribute("aria-label") for one in page.locator("#rate canvas").all()]
    assert [label.split(" of ")[1] for label in drawn] == ["the largest error", "the position RMSE"]


@needs(CHROMIUM)
def test_flights_are_those_of_the_campaign_whatever_gain_is_set(open_page, precision, tmp_path):
    page = open_page()
    assert_flown_as_by_the_campaign(page, campaign(tmp_path, precision))
    page.evaluate("quadstep.setControl('k_x', [12, 14, 16])")
    assert_flown_as_by_the_campaign(page, campaign(tmp_path, precision, "k_x = [12.0, 14.0, 16.0]"))


@needs(CHROMIUM)
@pytest.mark.parametrize("allowed", [True, False])
def test_a_served_page_flies_its_campaign_in_workers_or_by_its_own_laws(
    browsers, page_file, precision, tmp_path, monkeypatch, allowed
):  # of which there are none in f32
    if not allowed:
        policy = answers.SANDBOXED.replace(" 'wasm-unsafe-eval'", "")
        monkeypatch.setitem(answers.THEIRS, "Content-Security-Policy", policy)
    if allowed or precision == "f64":
        with serving(serve.server(page_file.parent, 0)) as port:
            page = browsers[False].page()
            page.goto(f"http://127.0.0.1:{port}/files/page.html")
            page.wait_for_selector("html[data-ready]", state="attached")
            workers = len(page.workers)
            path = campaign(tmp_path, precision)
            assert_flown_as_by_the_campaign(page, path)
            assert bool(workers) == allowed
            plan = plan_mission(read_campaign(path).mission, path)
            np.testing.assert_array_equal(page.evaluate("quadstep.rows()"), fly(plan).rows)
            browsers[False].blank()


HELD = """async () => {
  const [now, later] = [performance.now.bind(performance), setTimeout];
  performance.now = () => 300 * now(); // so slow that only the beginning is flown
  window.setTimeout = (act, ms) => (ms > 200 ? 0 : later(act, ms)); // a control that rests would fly all
  const slider = document.querySelector("#controls input[type=range][aria-label^='k x']");
  slider.value = 0; // with which it is lost at once
  slider.dispatchEvent(new Event("input"));
  await new Promise((done) => requestAnimationFrame(() => later(done)));
}"""


@needs(CHROMIUM)
def test_flights_are_whole_while_a_control_is_dragged(open_page, precision):
    page = open_page()
    page.evaluate(HELD)
    page.wait_for_function("() => quadstep.rate()?.done")
    assert page.evaluate("quadstep.outcome().dragged")
    rate = page.evaluate("quadstep.rate()")
    ended = [tick for tick, code in zip(rate["ended"], rate["outcome"], strict=True) if code == 0]
    assert ended and set(ended) == {1000}


@needs(CHROMIUM)
def test_a_control_of_what_the_campaign_varies_is_refused_in_words(open_page):
    page = open_page()
    page.evaluate("quadstep.setControl('wind', [3, 0, 0])")
    assert page.evaluate("quadstep.rate()") is None
    said = (
        "The campaign varies mean wind along x, 9 ± 5 m/s (normal) itself; restore the original value to see the failure rate."
    )
    assert page.locator("#rate-words").inner_text() == said
    assert page.locator("#outcome").inner_text().startswith("Nominal flight: ")
    assert page.locator("#rate .note").is_hidden()
    page.evaluate("quadstep.setControl('wind', [6, 0, 0])")
    page.wait_for_function("() => quadstep.rate()?.done")
    page.evaluate("quadstep.setControl('k_x', [12, 14, 16])")
    page.click("#reset")
    assert page.evaluate("quadstep.rate().done")  # as counted before
    page.evaluate("quadstep.setControl('k_x', [13, 14, 16])")  # at once: the flights of the file are still known
    page.wait_for_function("() => document.querySelector('#rate-words').textContent.includes('with the original values (')")
    unknown = "The changed loop may be unstable even so: for its margins run quadstep linear"
    assert page.locator("#margins").inner_text() == unknown
    page.click("#reset")
    assert "changed" not in page.locator("#margins").inner_text()
    assert not page.locator("#reset").is_enabled()


@needs(CHROMIUM)
def test_a_page_that_opens_with_other_values_counts_the_original_ones_too(open_page):
    page = open_page("#set=k_x:12,14,16")
    page.wait_for_function("() => document.querySelector('#rate .note').textContent.includes('Outline: ')")
    assert "with the original values (" in page.locator("#rate-words").inner_text()
    changed = page.evaluate("quadstep.rate()")
    page.click("#reset")
    original = page.evaluate("quadstep.rate()")  # as counted behind the others
    assert original["done"] and original["largest_error"] != changed["largest_error"]


DRAWN = """() => new Promise((tell) => {
  const [rectangles, words, own] = [[], [], CanvasRenderingContext2D.prototype];
  const [fill, write] = [own.fillRect, own.fillText];
  const mine = (pen) => pen.canvas === document.querySelector("#rate canvas");
  own.fillRect = function (...of) {
    if (mine(this)) rectangles.push([of[2], of[3], this.fillStyle]);
    fill.apply(this, of);
  };
  own.fillText = function (...of) {
    if (mine(this)) words.push(of[0]);
    write.apply(this, of);
  };
  document.querySelector("#theme").click();
  requestAnimationFrame(() => requestAnimationFrame(() => {
    [own.fillRect, own.fillText] = [fill, write];
    tell([rectangles, words]);
  }));
})"""


@needs(CHROMIUM)
def test_the_limit_is_an_edge_between_bars_so_that_colours_count_failures(open_page):
    page = open_page()
    page.wait_for_function("() => quadstep.rate()?.done")
    flown = page.evaluate("quadstep.rate()")
    errors = [error for error, code in zip(flown["largest_error"], flown["outcome"], strict=True) if code == 0]
    rectangles, words = page.evaluate(DRAWN)
    (tallest,) = (int(word.split()[0]) for word in words if "flight" in word)
    bars = [(height, colour) for width, height, colour in rectangles if width < 20]
    scale = tallest / max(height for height, _ in bars)
    good = round(scale * sum(height for height, colour in bars if colour == bars[0][1]))
    assert good == sum(error <= 0.2 for error in errors) < len(errors)


@needs(CHROMIUM)
def test_while_nothing_is_counted_no_count_is_shown(open_page):
    page = open_page()
    page.wait_for_function("() => quadstep.rate()?.done")
    said = page.evaluate("""() => new Promise((tell) => {
      const words = document.querySelector('#rate-words');
      const told = () => tell([words.textContent, !!document.querySelector('#rate .counting')]);
      new MutationObserver(told).observe(words, {childList: true});
      quadstep.setControl('k_x', [12, 14, 16]);
    })""")
    assert said == ["Counting…", True]


@needs(CHROMIUM)
def test_a_control_that_comes_to_rest_where_it_was_keeps_the_count(open_page):
    page = open_page()
    page.wait_for_function("() => quadstep.rate()?.done")
    flown = page.evaluate("""() => {
      quadstep.setControl('k_x', [12, 14, 16]);
      return new Promise((tell) => setInterval(() => {
        const flown = quadstep.rate().flown;
        if (!flown) return;
        quadstep.setControl('k_x', [12, 14, 16]);
        tell([flown, quadstep.rate().flown]);
      }));
    }""")
    assert flown[1] >= flown[0] > 0


@needs(CHROMIUM)
def test_intervals_are_exact(open_page):
    page = open_page()
    for count, total in ((0, 1000), (1, 1000), (37, 1000), (500, 1000), (999, 1000), (1000, 1000), (1, 1), (3, 7)):
        ours = page.evaluate("([count, total]) => quadstep.share(count, total)", [count, total])
        assert list(ours.values()) == pytest.approx(list(share(count, total)), rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("largest_error = 0.2", "effort_thrust = 9.0", "failure.effort_thrust: a page counts failures by position_rmse and"),
    ('wind.mean.0 = { type = "normal", mean = 9.0, deviation = 5.0 }',
        'controller.type = { type = "choice", values = ["geometric", "pid"] }', "vary no choice of another structure"),
])  # fmt: skip
def test_what_a_page_cannot_fly_is_refused(tmp_path, old, new, words):
    path = campaign(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(UserError, match=words):
        rate(read_campaign(path), str(path))


@pytest.mark.parametrize("value", [0, 1, 127, 128, 300, 2**31])
def test_numbers_of_a_module(value):
    assert leb128(leb(value) + b"\xff", 0) == (value, len(leb(value)))


def test_a_module_that_calls_what_a_browser_lacks_is_refused():
    calls = b"\x02\x03env\x0f__linear_memory\x02\x00\x00\x03env\x0dquadstep_call\x00\x01"
    assert import_names(calls) == [b"__linear_memory", b"quadstep_call"]
    code = b"\0asm\1\0\0\0" + b"\x02" + leb(len(calls)) + calls
    assert list(sections(code)) == [(2, calls)]
    with pytest.raises(UserError, match="call quadstep_call, which a browser does not have"):
        exporting(code, "sweep")
