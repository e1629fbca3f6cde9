"""The plots of the page in a real browser: pointed at, zoomed, chosen, arranged, added and laid over."""

import re
from pathlib import Path

import numpy as np
import pytest

from quadstep.page.build import fly_missions
from tests.browsers import picture, until
from tests.commands import quadstep, write
from tests.needs import CHROMIUM, needs, package
from tests.pages import data_of

package("playwright")
pytestmark = needs(CHROMIUM)

CASE_1 = Path(__file__).parent.parent / "examples" / "case1.toml"


STILL = """name = "Still"
vehicle = { preset = "crazyflie" }
path = { type = "minimum-jerk", end = [0.5, 0.0, 0.5], duration = 1.0 }
"""


@pytest.fixture(scope="module")
def still_file(tmp_path_factory):
    """A real vehicle in still air, told all, its battery not simulated."""
    folder = tmp_path_factory.mktemp("still")
    return write(folder, fly_missions([write(folder, STILL)]), "page.html")


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    """Case 1."""
    return write(tmp_path_factory.mktemp("page"), fly_missions([CASE_1]), "page.html")


def test_a_symbol_in_a_title_is_set_as_in_a_legend(open_page):
    page = open_page()
    heading = page.locator("#plot-r1 h3")
    assert (heading.inner_text(), heading.locator("sub").inner_text()) == ("Filtered position error |r1|", "1")
    page.locator("#chooser summary").click()
    assert page.locator(".pickable:has-text('|r1|') sub").inner_text() == "1"
    assert page.locator("#plot-weights .legend dt").first.inner_text() == "|W\u03021|"


def test_an_error_of_an_angle_is_the_shorter_way_round(open_page):
    page = open_page("#set=K_r2:6&set=Lambda2:0.5&set=disturbance:0")
    ended = page.evaluate("quadstep.outcome()")["ended"]
    off = []
    for share in (0.5, 0.8, 0.9, 0.95, 0.99):
        page.evaluate("t => quadstep.seek(t)", share * ended)
        told = page.locator("#plot-attitude-error .legend dd").all_text_contents()
        off += [abs(float(text.replace("−", "-"))) for text in told]
    assert 150.0 < max(off) <= 180.0  # as in metrics.json


def test_a_link_puts_a_plot_first(open_page):
    page = open_page("#plot=attitude-error")
    assert page.locator("#plots-list > *").first.get_attribute("id") == "plot-attitude-error"
    assert page.locator("#notice").is_hidden()
    page.evaluate("location.hash = '#plot=no-such'")
    page.wait_for_function("document.querySelector('#notice').innerText.includes('plot=no-such')")


def test_the_numbers_of_an_axis_are_written_alike(open_page):
    page = open_page()
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    said = page.locator(".plot:has-text('Norms of the weights') .on-paper text").all_text_contents()
    assert {"0", "10⁻⁴", "2×10⁻⁴", "4×10⁻⁴"} <= {*said}
    assert not [one for one in page.locator("main text").all_text_contents() if re.search(r"\de[−\d]", one)]


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


def test_two_fingers_zoom_about_the_times_that_they_hold(open_page):
    page = open_page(width=390, height=800)
    stage = page.locator("#plot-position .stage")
    stage.scroll_into_view_if_needed()
    box, touches = stage.bounding_box(), page.context.new_cdp_session(page)
    left, width, y = box["x"] + 48, box["width"] - 58, box["y"] + box["height"] / 2

    def touch(kind, *shares):
        points = [{"x": left + share * width, "y": y, "id": i} for i, share in enumerate(shares)]
        touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 0.4)
    held = page.evaluate("quadstep.time()")
    assert held == pytest.approx(16, abs=0.6)
    touch("touchStart", 0.4, 0.6)
    for share in (0.3, 0.2):
        touch("touchMove", share, 1 - share)
    touch("touchEnd")
    assert page.locator("#whole").is_visible() and page.evaluate("quadstep.time()") == held
    touch("touchStart", 0.2)
    touch("touchEnd")
    assert page.evaluate("quadstep.time()") == pytest.approx(held, abs=0.6)  # what the finger held is where it left it
    touch("touchStart", 0.8)
    touch("touchEnd")
    assert page.evaluate("quadstep.time()") == pytest.approx(24, abs=0.6)


def test_plots_are_chosen_arranged_added_and_laid_over(open_page):
    page = open_page()

    before = ids(page)
    open_chooser(page)
    page.locator("#chooser").get_by_text("Position error", exact=True).click()
    assert ids(page) == [one for one in before if one != "position-error"]
    page.hover("#plot-attitude")
    page.click("#plot-attitude button[aria-label^=Up]")
    assert ids(page)[:2] == ["attitude", "position"]
    page.click("#plot-attitude button[aria-label^='log axis']")
    for kind, columns, title in (
        ("time", ["u", "norm_r1"], "u, norm_r1"),
        ("phase", ["x", "x_dot"], "x\u0307 over x"),
        ("spectrum", ["theta"], "Spectrum of θ"),
    ):
        page.select_option("#own-kind", kind)
        page.select_option("#own-columns", columns)
        page.click("#own-add")
        assert page.locator("#plots-list h3").first.inner_text() == title
    assert page.locator("#own-kind").input_value() == "spectrum"  # stays for the next plot
    assert page.locator("#own-add").evaluate("one => one === document.activeElement")
    page.select_option("#own-kind", "phase")
    page.click("#own-add")
    assert "Choose two columns" in page.locator("#chooser .quiet").inner_text()
    page.click("#keep")
    page.evaluate("quadstep.setControl('t_f', 20)")
    assert "kept" in page.locator("#plot-position .roles").inner_text()
    assert picture(page, "#plot-own-2 .stage").std() > 0.02


def ids(page):
    return [one.get_attribute("id").removeprefix("plot-") for one in page.locator("#plots-list .plot").all()]


def open_chooser(page):
    """Its entries are made when it opens, a moment after the click."""
    page.click("#chooser summary")
    page.wait_for_selector(".pickables .pickable")


def offered(page):
    """The names of the plots that may be chosen, and whether each is."""
    return {one.inner_text(): one.locator("input").is_checked() for one in page.locator(".pickables .pickable").all()}


def words_of(page, plot):
    """The texts of a plot's SVG."""
    page.hover(f"#plot-{plot}")
    with page.expect_download() as begun:
        page.click(f"#plot-{plot} .tools button:has-text('SVG')")
    return re.findall(r"<text[^>]*>([^<]*)</text>", Path(begun.value.path()).read_text(encoding="utf-8"))


def test_what_a_flight_lacks_is_not_drawn_but_said(open_page, still_file):
    page = open_page(file=still_file, webgl=True)
    lacked = {
        "wind": "Wind",
        "voltage": "Battery",
        "weights": "Norms of the weights",
        "estimate": "Estimated minus true position",
    }
    assert not lacked.keys() & set(ids(page))
    assert "rotors" in ids(page)
    open_chooser(page)
    for title in lacked.values():
        assert offered(page)[f"{title} (none in this flight)"] is False
    assert "wind" not in page.locator("#legend").inner_text()
    page.evaluate("quadstep.setControl('wind', [2, 0, 0])")
    assert "wind" in ids(page)
    assert offered(page)["Wind"] is True
    assert "wind" in page.locator("#legend").inner_text()


def test_axis_around_a_constant_has_round_numbers(open_page, still_file):
    page = open_page(file=still_file)
    open_chooser(page)
    page.get_by_label("Battery (none in this flight)").check()
    assert {"1.0", "0.0", "−1.0"} <= set(words_of(page, "voltage"))
    page.evaluate("quadstep.setControl('wind', [2, 0, 0])")
    page.select_option("#own-columns", ["wind_x"])
    page.click("#own-add")
    assert {"1.80", "2.00", "2.20"} <= set(words_of(page, "own-1"))


def test_the_end_of_a_lost_flight_does_not_flatten_what_came_before(open_page):
    page = open_page("#set=disturbance:3.79&set=t_f:14.667")
    assert page.evaluate("quadstep.outcome()")["ended"] < 14.0
    head, said = page.locator("#plot-position-error"), words_of(page, "position-error")
    assert head.locator("h3").get_attribute("data-unit") == "[mm]" and {"−1.0", "1.0"} <= {*said}
    for cut in ("position-error", "attitude", "weights"):
        assert "The end is off scale" in page.locator(f"#plot-{cut} .note").inner_text()
    held = open_page("#set=disturbance:1")
    assert "off scale" not in held.locator("body").inner_text()


def test_the_end_of_a_lost_flight_does_not_flatten_the_force_of_its_net(open_page):
    page = open_page("#set=disturbance:3.79&set=t_f:14.667")
    open_chooser(page)
    page.get_by_label("Net: force, neurons and weights").check()
    assert page.locator("#plot-net .note").inner_text().startswith("The end is off scale")
    assert {"−0.3", "0.4"} <= set(words_of(page, "net"))


def test_a_map_stands_beside_its_flights_and_the_one_of_the_median_error_is_seen_first(open_page, tmp_path):
    axes = "--x", "disturbance.scale=0:2:3", "--y", "path.duration=20:40:3"
    assert quadstep("envelope", CASE_1, *axes, "--out", tmp_path / "map").code == 0
    page = open_page(file=tmp_path / "map" / "flights.html")
    assert page.locator("#side #walk .coloured").count() == 9
    errors = {
        one["id"]: one["summary"]["filed"]["rmse"]
        for one in data_of((tmp_path / "map" / "flights.html").read_text())["flights"]
    }
    assert page.evaluate("location.hash") == f"#flight={sorted(errors, key=errors.get)[4]}"
    page.set_viewport_size({"width": 1000, "height": 800})
    assert until(page, lambda: page.locator("#side #walk").count() == 0 and page.locator("#walk .coloured").count() == 9)


def test_the_net_is_chosen_like_other_plots(open_page):
    page = open_page("#t=12")
    open_chooser(page)
    box = page.get_by_label("Net: force, neurons and weights")
    assert not box.is_checked() and "net" not in ids(page)
    box.focus()
    page.keyboard.press("Space")
    assert ids(page)[-1] == "net"
    assert box.is_checked() and box.evaluate("one => one === document.activeElement")
    assert (
        page.locator("#plot-net .stage").get_attribute("aria-label").startswith("Force of the net over time; left and right")
    )
    page.locator("#plot-net").scroll_into_view_if_needed()
    told = page.locator("#plot-net canvas.net-picture")
    page.wait_for_selector("#plot-net canvas.net-picture[aria-label^='The 10 neurons of the first net at 12.0 s']")
    assert picture(page, "#plot-net canvas.net-picture").std() > 0.02
    page.evaluate("quadstep.seek(30)")
    assert " at 30.0 s: activity and weights" in told.get_attribute("aria-label")
    page.hover("#plot-net")
    page.click("#plot-net button[aria-label^='log axis']")
    assert any(word.startswith("10⁻") for word in words_of(page, "net"))
    page.click("#plot-net button[aria-label^=Hide]")
    assert "net" not in ids(page) and not box.is_checked()
    page.evaluate("quadstep.setController('nested-saturation')")
    assert not any(name.startswith("Net") for name in offered(page))


def test_a_phase_portrait_pairs_what_was_at_the_same_time(open_page, tmp_path):
    """Of a log beside a flight: its own signals with one another, at the times of its rows."""
    page = open_page(webgl=True)
    rows = "\n".join(f"{0.5 * i},{i},{0.2 * i},{0.3 * i},{2 * i}" for i in range(41))
    page.set_input_files("#log-file", write(tmp_path, f"t,x[m],y[m],z[m],twice[m]\n{rows}\n", "log.csv"))
    page.wait_for_selector("#notice:not([hidden])")
    assert "file" in page.locator("#legend").inner_text()
    open_chooser(page)
    page.select_option("#own-kind", "phase")
    for columns, least in ((["x", "twice"], 30), (["z_d", "twice"], 4)):
        page.select_option("#own-columns", columns)
        page.click("#own-add")
        words = words_of(page, page.locator("#plots-list .plot").first.get_attribute("id").removeprefix("plot-"))
        (last,) = [float(word.split()[0]) for word in words if re.fullmatch(r"[\d.]+ (x|z_?d) \[m\]", word)]
        assert last >= least, words
    page.locator("#plots-list .plot button[aria-label^=Hide]").first.click()
    page.select_option("#own-kind", "time")
    page.select_option("#own-columns", ["x"])
    page.click("#own-add")
    page.hover("#plots-list .plot:first-child .stage")
    assert page.locator("#plots-list .plot").first.locator(".tip").inner_text().count("log.csv") == 1
    page.click(".chip button")
    assert "file" not in page.locator("#legend").inner_text()


def test_a_logarithmic_axis_says_that_it_shows_sizes(open_page):
    page = open_page()
    names = page.locator("#plot-position-error .legend dt")
    assert "|" not in names.first.inner_text()
    page.hover("#plot-position-error")
    page.click("#plot-position-error .tools button:has-text('log')")
    assert [one.inner_text().count("|") for one in names.all()] == [2, 2, 2]


@pytest.mark.parametrize("plot", ["position", "position-error", "rotors"])
def test_lines_pass_every_sample_within_a_pixel_in_few_points(open_page, plot):
    page = open_page()
    page.hover(f"#plot-{plot}")
    with page.expect_download() as begun:
        page.click(f"#plot-{plot} .tools button:has-text('SVG')")
    flown = dict(zip(page.evaluate("quadstep.columns()"), np.array(page.evaluate("quadstep.rows()")).T, strict=True))
    values = {
        "position": [flown[name] for name in "xyz"],
        "position-error": [flown[f"{name}_d"] - flown[name] for name in "xyz"],
        "rotors": [flown[f"f{number}"] for number in range(1, 5)],
    }[plot]
    paths = re.findall(r'<path d="([^"]+)"[^>]*stroke-width="1.6"', Path(begun.value.path()).read_text(encoding="utf-8"))
    lines = [np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path), dtype=float) for path in paths[-len(values) :]]
    assert max(map(len, lines)) < 400 < len(flown["t"]) / 10 + 1
    most, least = np.max(values), np.min(values)
    top, bottom = min(line[:, 1].min() for line in lines), max(line[:, 1].max() for line in lines)
    for line, value in zip(lines, values, strict=True):
        right, down = (
            line[0, 0] + flown["t"] / 40.0 * (line[-1, 0] - line[0, 0]),
            top + (most - value) / (most - least) * (bottom - top),
        )
        near = [np.interp(right + aside, *reached.T) for aside in np.linspace(-0.5, 0.5, 17) for reached in ends(line)]
        assert (np.min(near, axis=0) - 0.6 < down).all() and (down < np.max(near, axis=0) + 0.6).all()


def ends(line):
    """A line with the lowest, and with the highest, of its points in each column of pixels."""
    columns, at = np.unique(line[:, 0], return_inverse=True)
    for furthest in (np.minimum, np.maximum):
        found = np.full(len(columns), furthest.reduce([-np.inf, np.inf]) * -1)
        furthest.at(found, at, line[:, 1])
        yield np.column_stack([columns, found])
