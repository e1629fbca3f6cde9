"""The page in a real browser: opened from disk, offline, looked at, played with, and flown like Python."""

import base64
import io
import re
from pathlib import Path

import numpy as np
import pytest

from quadstep import read_mission
from quadstep.engines.fly import fly
from quadstep.metrics.registry import AT_REST
from quadstep.mission.paths import CirclePath
from quadstep.page.build import build_page, flown_mission, fly_missions
from quadstep.page.model import ClaimView
from quadstep.page.serve import server
from quadstep.page.story import OWN
from tests.browsers import axe, picture, until
from tests.commands import write
from tests.needs import CHROMIUM, needs, package
from tests.pages import fly_page, needs_node, serving

EXAMPLES = Path(__file__).parent.parent / "examples"

package("playwright")
pytestmark = needs(CHROMIUM)

HOSTILE = "<script>alert(1)</script>"
HOSTILE_MISSION = f"""name = "{HOSTILE}"
[path]
type = "circle"
centre = [0.0, 0.0, 5.0]
radius = 3.0
period = 8.0
[simulation]
duration = 4.0
"""


BRIEF_MISSIONS = [
    f"""name = "{name}"
[path]
type = "minimum-jerk"
end = [2.0, 0.5, 1.0]
duration = 4.0
"""
    for name in ("One", "Another")
]


@pytest.fixture(scope="module")
def brief_file(tmp_path_factory):
    """Two flights of four seconds, where another flight would show no more."""
    folder = tmp_path_factory.mktemp("brief")
    missions = [write(folder, text, f"{i}.toml") for i, text in enumerate(BRIEF_MISSIONS)]
    return write(folder, fly_missions(missions), "page.html")


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """Case 1, the flight that diverges, and a mission whose name is markup."""
    folder = tmp_path_factory.mktemp("page")
    hostile = folder / "hostile.toml"
    hostile.write_text(HOSTILE_MISSION)
    missions = [EXAMPLES / "case1.toml", EXAMPLES / "stress.toml", hostile]
    file = folder / "page.html"
    file.write_text(fly_missions(missions), encoding="utf-8")
    return file


ROWS = """() => {
  const rows = quadstep.rows(), bytes = new Uint8Array(Float64Array.from(rows.flatMap((row) => [...row])).buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return [rows.length, btoa(text)];
}"""


def rows(page):
    """What was flown, to the bit; as numbers one by one it would be a second under way."""
    count, text = page.evaluate(ROWS)
    return np.frombuffer(base64.b64decode(text)).reshape(count, -1)


def test_file_opens_offline_small_and_at_once(open_page, page_file):
    page = open_page()
    assert page_file.stat().st_size < 3e6
    assert page.title()
    assert page.locator("#flight-name").inner_text() == "Case 1: three position commands at once"
    assert page.locator(".plot").count() >= 6
    assert "Flew as commanded for 40.0 s" in page.locator("#outcome").inner_text()
    said = "Theorem 5.1: 6 of 6 gain conditions hold\nRepaired theorem (at hover): holds"
    assert page.locator("#conditions").inner_text() == said
    assert "default-src 'none'" in page.locator("meta[http-equiv]").get_attribute("content")
    sliders = page.locator("#controls input[type=range]:visible")
    for part in (page.locator("#play"), *(sliders.nth(place) for place in range(3))):
        box = part.bounding_box()  # within the first screen
        assert box["y"] + box["height"] <= 900


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_scene_shows_something_that_moves(open_page, scheme):
    page = open_page("#t=8", scheme=scheme, webgl=True, width=900, height=640)
    assert until(page, lambda: picture(page, "#scene").std() > 0.02)
    page.wait_for_timeout(400)
    first = picture(page, "#scene")
    page.evaluate("quadstep.seek(30)")
    assert until(page, lambda: (np.abs(first - picture(page, "#scene")).max(axis=2) > 0.1).sum() > 300)
    dark = np.array([0.08, 0.09, 0.1]) if scheme == "dark" else np.array([0.98, 0.98, 0.97])
    assert np.median(np.abs(first - dark)) < 0.12  # the theme is the one asked for
    assert first.std() > 0.02
    words = page.locator("#labels").inner_text()
    assert "thrust 9." in words
    assert "10 m" in words
    if scheme == "dark":  # once is enough
        box = page.locator("#scene").bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0], box["y"] - 900)
        page.mouse.up()
        page.wait_for_timeout(400)
        camera = page.evaluate("quadstep.camera()")
        assert camera["position"][2] > camera["ground"]
        shape = "one => one.width / one.height"
        before = page.locator("#scene").evaluate(shape)
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.locator("#scene-paper").evaluate(shape) == pytest.approx(
            182 / 80, rel=0.01
        )  # the box that print.css gives it
        assert page.locator("#scene").evaluate(shape) == before


def test_case_1_flies_as_in_python(open_page):
    page = open_page()
    plan = read_mission(EXAMPLES / "case1.toml").plan(EXAMPLES)
    log = fly(plan)
    assert page.evaluate("quadstep.columns()") == list(log.columns)
    assert page.evaluate("quadstep.units()") == list(log.columns.values())
    np.testing.assert_array_equal(rows(page), log.rows)


def test_download_is_what_quadstep_writes(open_page, tmp_path):
    from quadstep.report.publish import write_log

    page = open_page()
    with page.expect_download() as begun:
        page.click("#csv")
    text = Path(begun.value.path()).read_text()
    write_log(tmp_path / "flight.csv", fly(read_mission(EXAMPLES / "case1.toml").plan(EXAMPLES)))
    ours = (tmp_path / "flight.csv").read_text()
    assert text.splitlines()[0] == ours.splitlines()[0]
    assert len(text.splitlines()) == len(ours.splitlines())
    np.testing.assert_array_equal(np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1), rows(page))
    assert begun.value.suggested_filename == "Case-1-three-position-commands-at-once.csv"


@pytest.mark.parametrize("kind", ["SVG", "PNG"])
def test_plot_can_be_taken_along(open_page, brief_file, kind):
    page = open_page(file=brief_file)
    page.hover("#plot-position")
    with page.expect_download() as begun:
        page.click(f"#plot-position .tools button:has-text('{kind}')")
    content = Path(begun.value.path()).read_bytes()
    if kind == "PNG":
        assert content.startswith(b"\x89PNG")
    else:
        assert content.startswith(b"<svg") and content.count(b"<path") > 6 and b"Position" in content
        assert re.search(rb'<tspan dy="[\d.]+" font-size="[\d.]+">d<', content) and b"x_d" not in content


def slide(page, label, share):
    """Drags a slider to a share of its way."""
    slider = page.locator(f"#controls input[type=range][aria-label^='{label}']:visible").first
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    middle = box["y"] + box["height"] / 2
    at = page.evaluate("e => e.value / e.max", slider.element_handle())
    page.mouse.move(box["x"] + 7 + at * (box["width"] - 14), middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 7 + share * (box["width"] - 14), middle, steps=4)
    page.mouse.up()


def test_slider_flies_again(open_page):
    page = open_page()
    before = rows(page)
    numbers = page.locator("#plot-position .legend dd").all_inner_texts()
    slide(page, "time t f", 0.3)
    after = rows(page)
    assert len(after) < len(before)
    assert "set=t_f" in page.url
    page.evaluate("quadstep.seek(4)")
    shown = page.locator("#plot-position .legend dd").all_inner_texts()
    assert shown != numbers
    assert [float(text.replace("−", "-")) for text in shown] == pytest.approx(after[400, 1:4], abs=0.006)
    assert float(page.locator("#time").inner_text().split("/")[1].split()[0]) == pytest.approx(after[-1, 0], abs=0.06)
    page.click("#reset")
    np.testing.assert_array_equal(rows(page), before)


def test_without_javascript_nothing_is_shown_but_that_it_is_needed(open_page, page_file):
    bare = open_page().context.browser.new_page(java_script_enabled=False)
    bare.goto(page_file.as_uri())
    assert bare.locator("body").inner_text().strip() == (
        "This page flies in your browser: it needs JavaScript, which is switched off here."
    )
    bare.close()


@pytest.fixture(scope="module")
def noted_file(tmp_path_factory):
    """A fragile flight with a text and claims beside it, as the paper's have."""
    claims = [ClaimView(f"It {one}", "As stated.", "As measured.", one, (), "", ()) for one in ("holds", "fails")]
    return with_claims(tmp_path_factory.mktemp("noted"), claims)


def with_claims(folder, claims):
    mission = read_mission(EXAMPLES / "case1.toml")
    plan = mission.plan(EXAMPLES)
    places = tuple(range(len(claims)))
    shown = flown_mission(mission, plan, fly(plan), EXAMPLES)._replace(note="Three commands at once.", claims=places)
    rest = {AT_REST: {"grade": "fragile", "why": "phase margin 29.4° in thrust (less than 30.0°)"}}
    return write(folder, build_page("Noted", (), [shown._replace(metrics={**shown.metrics, **rest})], claims), "page.html")


HEIGHTS = "['#scene-box', '#summary'].map((one) => document.querySelector(one).getBoundingClientRect().height)"


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (360, 740)])
def test_nothing_moves_while_a_slider_is_held_and_a_fragile_loop_is_told_at_every_width(open_page, noted_file, width, height):
    page = open_page(file=noted_file, width=width, height=height, webgl=True)
    assert page.locator("#margins").inner_text() == "Loop at rest: fragile, phase margin 29.4° in thrust (less than 30.0°)"
    assert page.locator("#margins").is_visible()
    if width == 1440:  # of a claim a reader of the first screen sees the verdict
        assert page.locator("#of-paper > summary").inner_text().split("\n") == ["The paper’s claims", "1 holds, 1 fails"]
        assert page.locator("#of-paper").bounding_box()["y"] < page.locator("#controls").bounding_box()["y"]
    page.evaluate("document.querySelector('#skip-controls').click()")
    for label in ("K r1", "Λ2", "time t f"):  # which end in good flights and in lost ones
        slider = page.locator(f"#controls input[type=range][aria-label^='{label}']:visible").first
        slider.scroll_into_view_if_needed()
        box = slider.bounding_box()
        found = [(round(box["y"]), page.evaluate(HEIGHTS))]
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        for share in (0.6, 0.95, 0.05):
            page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
            page.evaluate("() => new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame))")
            found.append((round(slider.bounding_box()["y"]), page.evaluate(HEIGHTS)))
        page.mouse.up()
        assert page.locator("#controls .hinted").inner_text().startswith("You changed the settings; ")
        found.append((round(slider.bounding_box()["y"]), page.evaluate(HEIGHTS)))
        assert found == found[:1] * len(found), label
        page.evaluate("document.querySelector('#reset').click()")


SLOWER = """(() => {
  const now = performance.now.bind(performance);
  performance.now = () => 300 * now();
  for (let i = 0; i < 40; i++) quadstep.fly();
})()"""
"""A clock by which no flight is quick, as the page knows from then on."""

EVEN = "(() => { let n = 0; performance.now = () => 30 * n++; for (let i = 0; i < 40; i++) quadstep.fly(); })()"
"""A clock by which every flight takes 30 ms."""

PATIENT = "(() => { const later = setTimeout; window.setTimeout = (act, wait) => later(act, 300 * (wait ?? 0)); })()"
"""Where a control that rests is still being dragged, however late a picture comes."""


DRAG = """async () => {
  const slider = document.querySelector("#controls input[type=range][aria-label^='K r1']");
  const text = (where) => document.querySelector(where).textContent;
  const picture = () => document.querySelector("#plot-position canvas").toDataURL();
  const before = picture();
  slider.value = slider.max / 5;
  slider.dispatchEvent(new Event("input"));
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  const [outcome, words, figures] = ["#outcome", "#summary-words", "#summary-figures"].map((where) => text(where));
  const { values } = quadstep.settings();
  return { ...quadstep.outcome(), rows: quadstep.rows(), drawn: picture() !== before,
    hash: location.hash, outcome, words, figures, values };
}"""
"""What is seen at the first picture after a slider has moved, before it is let go."""


def test_dragging_flies_the_beginning_and_letting_go_all_of_it(open_page, tmp_path):
    page = open_page()
    figures = page.locator("#summary-figures").inner_text()
    page.evaluate(SLOWER)
    page.evaluate(PATIENT)
    seen = page.evaluate(DRAG)
    dragged, (values,) = np.array(seen["rows"]), seen["values"].values()
    ended = dragged[-1, 0]
    assert seen["dragged"] and seen["drawn"] and 0.0 < ended < seen["whole"] == 40.0
    assert seen["words"] == "While you drag, numbers and plots cover only this beginning."
    assert seen["outcome"] == f"First {ended:#.3g} s of 40.0 s"
    assert seen["figures"] != figures and "was " not in seen["figures"] and "K_r1" not in seen["hash"]
    page.locator("#controls input[type=range][aria-label^='K r1']").first.dispatch_event("change")
    text = LINE.format(duration=40.0) + CONTROLLER + f"K_r1 = {values}\n"
    flown = fly(read_mission(write(tmp_path, text, "dragged.toml")).plan(tmp_path))
    assert page.evaluate("quadstep.outcome().whole") is None and "K_r1" in page.url
    np.testing.assert_array_equal(rows(page), flown.rows)
    np.testing.assert_array_equal(dragged, flown.rows[: len(dragged)])


SCENE_DRAG = """async () => {
  const slider = [...document.querySelectorAll("#controls input[type=range]")].find((one) => one.ariaLabel.startsWith(LABEL));
  const end = () => [...document.querySelectorAll("#labels .end:not([hidden])")].map((one) => one.style.transform).join();
  const before = end();
  const scene = document.querySelector("#scene"), gl = scene.getContext("webgl2");
  let drawn = 0;
  for (const name of ["drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"]) {
    const draw = gl[name].bind(gl);
    gl[name] = (...given) => { drawn++; draw(...given); };
  }
  slider.value = slider.max / 5;
  slider.dispatchEvent(new Event("input"));
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  const pixels = scene.width / scene.clientWidth, after = end();
  slider.dispatchEvent(new Event("change"));
  return [drawn, pixels, scene.width / scene.clientWidth, quadstep.outcome().dragged, before, after, end()];
}"""


@pytest.mark.parametrize("label", ["K r1", "target in"])
def test_the_scene_follows_a_drag_at_the_same_picture_with_fewer_pixels_where_drawing_is_slow(open_page, brief_file, label):
    page = open_page(file=brief_file, webgl=True)
    page.wait_for_selector("html[data-scene=yes]", state="attached")
    page.wait_for_function("document.querySelector('#labels .end:not([hidden])')")
    page.evaluate(SLOWER)
    page.evaluate(PATIENT)
    drawn, dragged, rests, still, *ends = page.evaluate(SCENE_DRAG.replace("LABEL", repr(label)))
    assert drawn > 0 and dragged == pytest.approx(0.5, abs=0.01) and rests == 1.0 and not still
    assert (ends[0] == ends[1]) == (label == "K r1"), "where a path is another, its beginning alone is known"


def test_a_control_that_rests_flies_all(open_page, brief_file):
    page = open_page(file=brief_file)
    page.evaluate(SLOWER)
    assert page.evaluate(DRAG)["whole"] == 4.0
    page.wait_for_function("() => !quadstep.outcome().dragged")
    assert page.evaluate("quadstep.outcome().whole") is None and rows(page)[-1, 0] == 4.0
    page.evaluate(EVEN)
    page.evaluate("quadstep.seek(3.5)")
    assert page.evaluate(DRAG)["whole"] is None, "the reader looks at its end"
    page.evaluate("quadstep.seek(0)")
    assert page.evaluate(DRAG)["whole"] == 4.0


LATE = """async () => {
  window.requestAnimationFrame = (act) => setTimeout(() => act(performance.now()), 600);
  const slider = document.querySelector("#controls input[type=range][aria-label^='K r1']");
  slider.value = slider.max / 5;
  slider.dispatchEvent(new Event("input"));
  while (!Object.keys(quadstep.settings().values).length) await new Promise((done) => setTimeout(done, 5));
  return quadstep.outcome().dragged;
}"""
"""Whether what is flown first is the beginning, where the next picture comes later than a control rests."""


def test_a_slow_machine_does_not_fly_all_between_two_moves(open_page, brief_file):
    assert open_page(file=brief_file).evaluate(LATE)


def test_a_control_says_what_it_is_how_far_it_goes_and_what_it_was(open_page, brief_file):
    page = open_page(file=brief_file)
    page.evaluate("quadstep.setControl('K_r1', 4)")
    control = page.locator("#controls .control", has_text="Kr1").first
    ends = [one.strip() for one in control.locator(".ends:visible span").all_inner_texts()]
    control.get_by_role("button", name="About K r1").press("Enter")
    hint = control.locator(".hint").inner_text().replace("\u00a0", " ")
    assert hint.startswith("Gain of r1, the filtered error; the theorem requires") and hint.endswith(
        "; you can type any positive number. Original: 3 N s/m."
    )
    assert f". Slider {ends[0]} to {ends[1]} N s/m; " in hint
    assert control.locator("input[type=range]:visible").get_attribute("aria-describedby") == control.locator(
        ".hint"
    ).get_attribute("id")


def test_a_slider_reaches_a_value_beyond_what_it_was_made_for(open_page, brief_file):
    page = open_page("#set=backstepping.K_r1:300,300,300", file=brief_file)
    control = page.locator("#controls .control", has_text="Kr1").first
    assert control.locator(".ends:visible span").last.inner_text() == "300"
    assert control.locator("input[type=range]:visible").input_value() == "400"
    assert "0.3 to 300 N s/m; " in control.locator(".hint").text_content().replace("\u00a0", " ")
    page.evaluate("quadstep.setControl('K_r1', 3)")
    assert control.locator(".ends:visible span").last.inner_text() == "30"
    assert control.locator("input[type=range]:visible").input_value() == "200"


def test_back_goes_to_the_flight_before(open_page, brief_file):
    page = open_page(file=brief_file)
    page.evaluate("quadstep.setControl('K_r1', 4)")
    before = page.url
    page.evaluate("quadstep.select('another')")
    page.go_back()
    page.wait_for_function("() => quadstep.settings().flight === 'one'")
    assert page.url == before and page.evaluate("quadstep.settings().values") == {"backstepping.K_r1": [4, 4, 4]}
    page.go_forward()
    page.wait_for_function("() => quadstep.settings().flight === 'another'")


def test_summary_tells_of_the_flight_that_is_shown_and_claims_know_that_they_do_not(open_page):
    page = open_page()
    mission = read_mission(EXAMPLES / "case1.toml")
    assert_summed_up_as(page, mission, fly(mission.plan(EXAMPLES)))
    assert not page.locator("#summary-words").inner_text()  # the badge says all
    figures = page.locator("#summary-figures").inner_text()
    assert "was " not in figures
    assert not page.locator(".stale-note:visible").count()
    page.evaluate("quadstep.setControl('t_f', 3)")
    words = page.locator("#summary-words").inner_text()
    assert re.match(r"[A-Z].*; the numbers stop at the last sample before\. The original flew for 40\.0 s\.$", words)
    assert not page.locator(".filed").count()  # a flight that ended early is not compared with one that did not
    page.click("#reset")
    page.evaluate("quadstep.setControl('disturbance', 2)")
    beside = page.locator(".filed").all_inner_texts()
    assert len(beside) == 4
    for text in beside:
        assert text.removeprefix("was ") in figures
    assert page.locator("#claims .stale-note").is_visible()
    page.click("#reset")
    assert not page.locator(".stale-note:visible").count()
    page.evaluate("quadstep.setControl('K_r2', [90, 90, 90])")
    assert page.locator("#margins").is_visible()
    page.select_option("#controller", index=1)
    page.click("#reset")  # the controller as well
    assert page.evaluate("quadstep.settings().controller") == page.evaluate(
        "document.querySelector('#controller').options[0].value"
    )
    page.evaluate("quadstep.setControl('t_f', 9)")
    assert page.locator("#margins").inner_text() == "Margins of the loop at rest: run quadstep linear"  # it is the same
    page.click("#reset")


def test_flying_again_is_quick(open_page):
    page = open_page()
    took = min(page.evaluate("quadstep.fly()") for _ in range(5))
    assert took < 1000  # a crawling laws script would take seconds; the time itself is measured elsewhere


def assert_summed_up_as(page, mission, log):
    """The page's numbers are those of metrics.json, to the bit."""
    metrics, _ = mission.flight_metrics(log)
    summary = page.evaluate("quadstep.summary()")
    wanted = {
        "rmse": "position_rmse[m]", "largest": "largest_error[m]", "tilt": "largest_tilt[rad]", "share": "largest_thrust_share"
    }  # fmt: skip
    assert {name: summary[name] for name, metric in wanted.items() if metric in metrics} == {
        name: metrics[metric] for name, metric in wanted.items() if metric in metrics
    }
    assert len(summary.keys() & wanted) >= 3


LINE = '[path]\ntype = "minimum-jerk"\nend = [20.0, 5.0, 10.0]\nduration = {duration}\n'
CONTROLLER = '[controller]\ntype = "backstepping"\n'


@pytest.mark.parametrize(
    ("flight", "controls", "mission"),
    [
        (
            "case-1-three-position-commands-at-once",
            {"K_r1": [4, 3, 5], "t_f": 20, "disturbance": 2},
            LINE.format(duration=20.0) + CONTROLLER + "K_r1 = [4.0, 3.0, 5.0]\n[disturbance]\nscale = 2.0\n",
        ),
        (
            "case-1-three-position-commands-at-once",
            {"neurons": 7, "t_f": 12},
            LINE.format(duration=12.0) + CONTROLLER + "nets.neurons = 7\n",
        ),
        (
            "case-1-three-position-commands-at-once",
            {"nets": 0, "mass": 1.2, "start": [0.5, 0, -0.5], "t_f": 12},
            LINE.format(duration=12.0)
            + CONTROLLER
            + "mass = 1.0\nnets.enabled = false\n[vehicle]\nmass = 1.2\n[start]\nposition = [0.5, 0.0, -0.5]\n",
        ),
        ("script-alert-1-script", {"period": 10}, HOSTILE_MISSION.replace("8.0", "10.0")),
    ],
)
def test_control_is_the_mission_with_that_number(open_page, tmp_path, flight, controls, mission):
    page = open_page(f"#flight={flight}")
    for name, value in controls.items():
        page.evaluate("([name, value]) => quadstep.setControl(name, value)", [name, value])
    (tmp_path / "changed.toml").write_text(mission)
    changed = read_mission(tmp_path / "changed.toml")
    log = fly(changed.plan(tmp_path))
    flown = rows(page)
    count = min(len(flown), len(log.rows))  # a slower turn makes the page's flight longer, as its path is
    assert count > 300
    np.testing.assert_array_equal(flown[:count], log.rows[:count])
    if len(flown) == count:
        assert_summed_up_as(page, changed, log)


@needs_node
def test_slider_gives_the_very_bits_of_the_mission_with_that_number(open_page, page_file):
    flight, period = "script-alert-1-script", 7.7
    assert 2.0 * np.pi * (1.0 / period) != 2.0 * np.pi / period  # as the frequency is in Python
    page = open_page(f"#flight={flight}")
    page.evaluate("period => quadstep.setControl('period', period)", period)
    (answer,) = fly_page(page_file, {"flight": flight, "values": {"period": [period]}})
    frequency = answer["parameters"][answer["names"].index("path.frequency.0")]
    assert frequency == CirclePath(type="circle", radius=3.0, period=period).build(Path()).parameters.frequency[0]
    np.testing.assert_array_equal(rows(page), answer["values"])


def test_a_typed_extreme_widens_the_range_only_while_it_flies(open_page, brief_file):
    page = open_page(file=brief_file)
    card = page.locator("#controls .control:has(input[aria-label^='K r1'])").first
    ends, box = card.locator(".ends").first, card.locator("input[type=text]:visible").first
    before, original = ends.inner_text(), box.input_value()
    for extreme in ("1e99", "-3"):
        box.fill(extreme)
        box.press("Enter")
        assert ends.inner_text() != before
        box.fill(original)
        box.press("Enter")
        assert ends.inner_text() == before


def test_typed_number_is_held_to_its_bounds_and_nonsense_is_left(open_page, brief_file):
    page = open_page(file=brief_file)
    box = page.locator("#controls input[type=text][aria-label^='K r1']:visible").first
    box.fill("-5")
    box.press("Enter")
    assert float(box.input_value().replace("−", "-")) >= 0
    box.fill("1; alert(1)")
    box.press("Enter")
    assert box.get_attribute("aria-invalid") is not None
    box.fill("4.5")
    box.press("Enter")
    assert "set=backstepping.K_r1:4.5,4.5,4.5" in page.url


def test_paper_has_no_half_empty_sheet(open_page, tmp_path):
    claims = [ClaimView(f"Claim {one}", "As stated. " * 8, "As measured. " * 12, "holds", (), "", ()) for one in range(8)]
    page = open_page(file=with_claims(tmp_path, claims))
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True))) <= 3


def test_paper_shows_every_plot_and_nothing_to_press(open_page, brief_file):
    page = open_page(file=brief_file, scheme="dark")
    theme = page.locator("html")  # which follows with the next frame
    page.emulate_media(media="print")  # which alone has to do
    assert until(page, lambda: theme.get_attribute("data-theme") == "light")
    drawn = page.evaluate("[...document.querySelectorAll('.plot')].map((one) => one.querySelectorAll('svg path').length)")
    assert len(drawn) >= 8 and min(drawn) > 6
    assert page.locator("#plot-position .stage svg").is_visible()
    assert not [one for one in ("#transport", "#controls", "#tabs", "#camera") if page.locator(one).is_visible()]
    assert page.locator("#summary").is_visible() and page.locator("#story").is_visible()
    assert page.locator(".more").count() and not page.locator(".more").first.is_visible()  # what it would open is shown
    assert page.locator(".claim .facts").first.is_visible()
    assert "Changed settings" not in page.locator("main").inner_text()
    page.evaluate("quadstep.setControl('t_f', 6)")
    said = r"Changed settings: t_f = 6\ss \(original: \d+\ss\)\. Link: .+\.html#flight=.+&set=t_f:6"
    assert len(re.findall(said, page.locator("#summary").inner_text())) == 1
    assert not page.locator(".claim .facts").first.is_visible(), "numbers of the original flight above plots of another"
    assert not page.locator(".stale-note:visible").count(), "a remark on text that is not printed"
    page.emulate_media(media="screen")
    assert "Changed settings" not in page.locator("main").inner_text()
    assert page.locator("#transport").is_visible() and until(page, lambda: theme.get_attribute("data-theme") == "dark")


def test_vehicle_is_drawn_as_it_is_turned(open_page):
    from scipy.spatial.transform import Rotation

    page = open_page()
    page.evaluate("quadstep.setControl('tilt', [0.4, 0.3, -0.2])")
    columns = page.evaluate("quadstep.columns()")
    psi, theta, phi = rows(page)[0, [columns.index(name) for name in ("psi", "theta", "phi")]]
    assert (psi, theta, phi) == (0.4, 0.3, -0.2)
    w, x, y, z = page.evaluate("quadstep.attitude(0)")
    drawn = Rotation.from_quat([x, y, z, w]).as_matrix()
    left_handed = Rotation.from_euler("XYZ", [-phi, -theta, -psi]).as_matrix()  # Rx(-phi) Ry(-theta) Rz(-psi)
    np.testing.assert_allclose(drawn, left_handed, atol=1e-12)
    np.testing.assert_allclose(  # Eq. 7
        drawn[:, 2], [-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], atol=1e-12
    )


def test_ghost_flies_beside(open_page):
    page = open_page()
    own = rows(page)
    page.select_option("#ghost", "nested-saturation")
    ghost = page.evaluate("quadstep.outcome().ghost")
    assert ghost["held"]
    np.testing.assert_array_equal(rows(page), own)
    assert "ghost" in page.locator("#plot-position .roles").inner_text()
    page.select_option("#controller", "nested-saturation")
    assert np.abs(rows(page)[:, :4] - own[:, :4]).max() > 1e-3


HEAVY = ("1.999", "4", "4.943", "4.944", "5")


@pytest.mark.parametrize("hovering", [True, False])
def test_a_true_mass_that_is_moved_starts_at_its_own_hover_and_may_be_too_heavy(open_page, tmp_path, hovering):
    """Rows are those that `fly` has for that mass with the controller's belief left as it was."""
    text = (OWN.parent / "wind.toml").read_text() + f"[start]\nhovering = {str(hovering).lower()}\n"
    text = text.replace("duration = 14.0", "duration = 0.3")
    page = open_page(file=write(tmp_path, fly_missions([write(tmp_path, text, "wind.toml")]), "page.html"))
    for mass in HEAVY:
        page.evaluate("mass => quadstep.setControl('mass', mass)", float(mass))
        own = text.replace('"x500"', f'"x500"\nmass = {mass}').replace('"geometric"', '"geometric"\nmass = 2.28')
        plan = read_mission(write(tmp_path, own, "own.toml")).plan()
        assert rows(page).tobytes() == fly(plan).rows.tobytes(), mass
        said = next((one for one in plan.warnings if "cannot hover" in one), "")
        clause = said.partition("it cannot hover: ")[2].partition(";")[0].replace(" ", "\N{NO-BREAK SPACE}")
        words = page.locator("#summary-words").inner_text().replace(" ", "\N{NO-BREAK SPACE}")
        assert (clause in words) and (bool(clause) == ("cannot" in words)), (said, words)


def test_divergence_is_told(open_page):
    page = open_page()
    page.locator("#walk button", has_text="three seconds").click()
    text = page.locator("#outcome").inner_text()
    log = fly(read_mission(EXAMPLES / "stress.toml").plan(EXAMPLES))
    assert re.fullmatch(r"Lost at (.+) s", text)
    assert page.evaluate("quadstep.outcome().ended") == pytest.approx(log.ended, abs=0.3)
    thrust = page.locator("#summary-figures div", has_text="Largest thrust").locator("dd").inner_text()
    promise = page.locator("#promise").inner_text()  # the conditions hold
    assert f"at thrusts up to the {thrust} of this flight" in promise and "it does not bound the flight" in promise
    page.evaluate("quadstep.setControl('K_r1', [1.002, 1.002, 1.002])")  # enough for 13.4 N, at hover it is 9.81 N
    assert "holds at hover, but not at" in page.locator("#promise").inner_text()
    page.evaluate("quadstep.setControl('target', [0, 0, 1e6])")  # beyond what a flight may be off at its first sample
    page.evaluate("quadstep.setControl('start', [0, 0, -1e6])")
    assert page.evaluate("quadstep.summary().thrust") is None
    assert page.locator("#promise").inner_text().endswith("the conditions do not promise that the flight stays bounded.")
    page.click(".badge summary")
    assert "Reason:" in page.locator(".sheet").inner_text()
    figures = [text.replace("\xa0", " ") for text in page.locator(".sheet .figures").all_inner_texts()]
    assert [re.sub(r".*[\d⁰-⁹] ", "", text) for text in figures] == [*["N s/m"] * 3, *["N m s"] * 3, "N²"], figures
    assert "k1 and k2 the least margins of Kr1 and Kr2" in page.locator(".sheet").inner_text()
    page.evaluate("quadstep.select('case1')")
    for control, value in (("Lambda2", 0.5), ("K_r2", 6.0), ("disturbance", 0.0)):
        page.evaluate("([control, value]) => quadstep.setControl(control, value)", [control, value])
    assert (
        page.locator("#conditions").inner_text()
        == "Theorem 5.1: 6 of 6 gain conditions hold\nRepaired theorem (at hover): violated"
    )
    assert page.locator("#conditions .bad").all_inner_texts() == ["Repaired theorem (at hover): violated"]
    assert page.locator("#promise").inner_text().endswith("the repaired theorem’s condition is violated.")


def test_keyboard(open_page, brief_file):
    page = open_page(file=brief_file, webgl=True, width=900, height=700)
    page.keyboard.press("Space")
    assert page.evaluate("quadstep.playing()")
    assert until(page, lambda: page.evaluate("quadstep.time()") > 0.1)
    page.keyboard.press("Space")
    assert not page.evaluate("quadstep.playing()")
    page.keyboard.press("Home")
    assert page.evaluate("quadstep.time()") == 0
    page.keyboard.press("ArrowRight")
    step = page.evaluate("quadstep.time()")
    assert step > 0
    page.keyboard.press("Shift+ArrowRight")
    assert page.evaluate("quadstep.time()") > 5 * step
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("End")
    assert page.evaluate("quadstep.time()") == pytest.approx(4)
    page.keyboard.press("c")
    assert page.locator("#camera button[value=follow]").get_attribute("aria-pressed") == "true"
    page.keyboard.press("d")
    assert page.locator("html").get_attribute("data-theme") == "dark"
    page.keyboard.press("?")
    assert page.locator("#help").is_visible()
    assert page.evaluate("document.activeElement.tagName") == "H2"
    assert page.locator("[autofocus]").count() == 0  # which a frame refuses, and says so on the console
    page.keyboard.press("Escape")
    page.keyboard.press("n")
    assert "flight=another" in page.url
    assert page.locator("#flight-name").inner_text() == "Another"


def test_everything_that_can_be_pressed_can_be_reached(open_page, brief_file):
    page = open_page(file=brief_file, webgl=True)
    reached = set()
    for _ in range(120):
        page.keyboard.press("Tab")
        found = page.evaluate(
            """() => { const e = document.activeElement; const s = getComputedStyle(e);
                 return [e.id || e.getAttribute("aria-label") || e.textContent, s.outlineStyle, e.tagName]; }"""
        )
        if found[2] == "BODY":
            break
        reached.add(found[0])
        assert found[1] != "none", f"no visible focus on {found[0]}"
    for wanted in ("scene", "play", "scrub", "speed", "theme", "keys", "share", "csv", "controller", "ghost"):
        assert wanted in reached


def test_fragment_gives_the_flight_back(open_page):
    page = open_page()
    page.evaluate(
        "quadstep.setControl('t_f', 15); quadstep.setControl('nets', 0); quadstep.setControl('wind', [0.3, -0.2, 0.1])"
    )
    page.evaluate("quadstep.setGhost('completed-backstepping')")
    fragment = "#" + page.url.split("#")[1]
    again = open_page(fragment + "&t=7.25")
    np.testing.assert_array_equal(rows(again), rows(page))
    assert again.evaluate("quadstep.settings()") == page.evaluate("quadstep.settings()")
    assert again.evaluate("quadstep.time()") == 7.25
    assert not again.locator("#notice").is_visible()


@pytest.mark.parametrize(
    "fragment",
    [
        "#flight=nowhere",
        "#%%%",
        "#set=t_f:1e999",
        "#set=t_f:NaN",
        "#set=__proto__:1",
        "#set=constructor.name:1",
        "#controller=<img src=x onerror=alert(1)>",
        "#ghost=alert(1)&set=K_r1",
        "#t=javascript:alert(1)",
        "#" + "a" * 20000,
    ],
)
def test_bad_fragment_is_left_out_and_said(open_page, brief_file, fragment):
    page = open_page(fragment, file=brief_file)
    assert page.locator("#notice").is_visible()
    assert re.fullmatch(r"(The link|Ignored part of the link).+\.", page.locator("#notice span").inner_text())
    assert page.evaluate("quadstep.settings().values") == {}
    assert page.evaluate("quadstep.outcome().held")


def test_name_that_is_markup_is_only_a_name(open_page):
    page = open_page()
    page.locator("#walk button", has_text=HOSTILE).click()
    assert page.locator("#flight-name").inner_text() == HOSTILE
    assert page.locator("script", has_text="alert(1)").count() <= 1  # the data itself, as JSON
    page.hover("#plot-position")
    with page.expect_download() as begun:
        page.click("#plot-position .tools button:has-text('SVG')")
    assert HOSTILE not in Path(begun.value.path()).read_text()
    assert "<" not in begun.value.suggested_filename


@pytest.mark.parametrize(("width", "height"), [(360, 740), (760, 700), (900, 700), (1180, 800), (1440, 900)])
def test_no_width_scrolls_sideways(open_page, brief_file, width, height):
    page = open_page(file=brief_file, width=width, height=height)
    for tab in ("plots", "controls", "story"):
        if width < 1180:
            page.click(f"#tabs button[value={tab}]")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("#play").is_visible()
    high = "document.documentElement.dataset.embedded = ''; document.body.getBoundingClientRect().height"
    first = page.evaluate(high)
    page.set_viewport_size({"width": width, "height": height // 2})
    assert 500 < first < 850
    assert page.evaluate(high) == first, "inside another page, which makes its frame as high"
    page.set_viewport_size({"width": width, "height": height})


def test_without_webgl_there_are_plots_and_a_sentence(open_page):
    page = open_page("#t=10", webgl=False)
    assert "WebGL" in page.locator("#no-webgl").inner_text()
    assert until(page, lambda: picture(page, "#plot-position .stage").std() > 0.02)
    page.keyboard.press("c")
    page.evaluate("quadstep.setControl('t_f', 10)")
    assert page.evaluate("quadstep.rows().length") > 500
    for width in (360, 760, 1440):
        page.set_viewport_size({"width": width, "height": 634})
        sentence, badge = (page.locator(one).bounding_box() for one in ("#no-webgl", ".badge"))
        assert sentence["y"] + sentence["height"] <= badge["y"] or badge["y"] + badge["height"] <= sentence["y"], width


@pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (390, "dark")])
def test_axe_finds_nothing(open_page, width, scheme):
    page = open_page("#set=t_f:4", width=width, height=844, scheme=scheme)
    for tab in ("plots", "controls", "story"):
        if width < 1180:
            page.click(f"#tabs button[value={tab}]")
        assert axe(page) == []


@pytest.mark.parametrize(
    ("part", "values"), [("K_r1:4,3,5", [4, 3, 5]), ("backstepping.K_r1:4,3,5", [4, 3, 5]), ("K_r1:4", [4, 4, 4])]
)
def test_a_link_names_a_gain_with_or_without_its_controller(open_page, brief_file, part, values):
    page = open_page(f"#set={part}", file=brief_file)
    assert page.evaluate("quadstep.settings().values") == {"backstepping.K_r1": values}
    assert page.locator("#notice").is_hidden()


@pytest.mark.parametrize(
    ("typed", "said"), [("−3", "−3 is below the least allowed, 1e−9, which is used."), ("abc", "“abc” is not a number.")]
)
def test_a_typed_value_that_is_not_taken_is_said(open_page, brief_file, typed, said):
    page = open_page(file=brief_file)
    box = page.get_by_role("textbox", name="K r1 in N s/m", exact=True)
    box.fill(typed)
    box.press("Enter")
    assert page.locator(".complaint:visible").inner_text() == said
    box.fill("3")  # as it was, which changes nothing
    assert not page.locator(".complaint:visible").count() and box.get_attribute("aria-invalid") is None
    box.fill(typed)
    box.press("Enter")
    assert page.locator(".complaint:visible").count()
    page.evaluate("quadstep.setControl('K_r1', 2)")
    assert not page.locator(".complaint:visible").count()


def test_a_file_that_is_served_flies_but_cannot_read_the_list(browsers, brief_file):
    script = "<script>const list = open('/'); document.title = `${origin} ${list} ${document.querySelector('p')}`</script>"
    write(brief_file.parent, f"<p>{script}", "report.html")
    page, errors = browsers[False].page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    with serving(server(brief_file.parent, 0)) as port:
        page.goto(f"http://127.0.0.1:{port}/files/page.html")
        page.wait_for_selector("html[data-ready]", state="attached")
        count, _ = page.evaluate(ROWS)
        page.goto(f"http://127.0.0.1:{port}/files/report.html")
        assert page.title() == "null null [object HTMLParagraphElement]"
    browsers[False].blank()
    assert count > 100 and errors == []


@pytest.mark.slow
def test_a_flight_that_is_kept_is_in_the_scene_too(open_page):
    page = open_page(webgl=True)
    page.evaluate("quadstep.setControl('t_f', 8)")
    page.click("#keep")
    page.evaluate("quadstep.setControl('t_f', 12)")
    page.evaluate("quadstep.pause()")
    page.evaluate("quadstep.seek(5)")
    assert "kept" in page.locator("#legend").inner_text()
    assert until(page, lambda: picture(page, "#scene").std() > 0.02)
    both = picture(page, "#scene")
    page.click("#keep")
    assert "kept" not in page.locator("#legend").inner_text()
    assert until(page, lambda: (np.abs(both - picture(page, "#scene")).max(axis=2) > 0.1).sum() > 100)


def test_a_link_lays_a_flight_behind_those_that_are_shown(open_page):
    page = open_page("#keep=stress")
    names = page.evaluate("quadstep.flights()")
    assert page.locator("#keep").inner_text() == "Keep" and page.locator("#notice").is_visible()  # there is none of that name
    page.evaluate("id => { location.hash = `#keep=${id}` }", names[1])
    page.wait_for_function("() => document.querySelector('#keep').textContent === 'Kept (release)'")
    assert page.locator("#plot-position").get_by_text("kept").is_visible()
    page.click("#keep")
    assert page.locator("#plot-position").get_by_text("kept").count() == 0
