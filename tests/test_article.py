"""`quadstep explain`: the article's words, its law to the bit, its figures in a browser, with and without JavaScript."""

import base64
import itertools
import json
import re
import shutil
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
import pytest

from docs.article import FIGURES, STILLS, WIDTH, stills
from docs.site.pages import ROOT
from quadstep import fly, read_mission
from quadstep.commands.serve import explain, link_pair
from quadstep.control.vectoring import invert_force
from quadstep.io.errors import UserError
from quadstep.linear.grade import grade
from quadstep.mission.lagrange import LagrangeMission
from quadstep.numbers import Number, Vector
from quadstep.page.build import fill
from quadstep.proofs.article import FLIGHTS, PERIOD, SHOWN, article, ball, body, missions, printed_roll, tools
from quadstep.proofs.certify.certificate import error_radius
from quadstep.vehicle.in_space import COLUMNS
from quadstep.vehicle.lagrange import Lagrange
from quadstep.vehicle.paper import thrust_direction
from tests.browsers import axe, until
from tests.frontend import FRONTEND
from tests.golden import FILE as GOLDEN
from tests.needs import CHROMIUM, NODE, needs
from tests.pages import STAND_IN, run_node

FLY = """
const [path, changes] = process.argv.slice(1);
const text = require("node:fs").readFileSync(path, "utf8");
const inside = (id) => text.match(new RegExp(`<script id="${id}"[^>]*>([\\\\s\\\\S]*?)</script>`))[1];
const data = JSON.parse(inside("quadstep-data"));
new Function(inside("quadstep-laws"))();
const doubles = (packed) => new Float64Array(Uint8Array.from(Buffer.from(packed, "base64")).buffer);
const answer = Object.entries(data.flights).map(([name, flight]) => {
  const [parameters, start] = [doubles(flight.parameters), doubles(flight.start)];
  for (const [key, value] of Object.entries(JSON.parse(changes))) parameters[data.names.indexOf(key)] = value;
  const count = Math.floor(flight.ticks.last / flight.ticks.log) + 1;
  const [log, seen] = [new Float64Array(count * data.columns.length), new Float64Array(count * data.shown.length)];
  const end = quadstepLaws.article.fly(parameters, [], start, flight.ticks, log, seen);
  const packed = (rows, width) => Buffer.from(rows.buffer, 0, end.rows * width * 8).toString("base64");
  return [name, packed(log, data.columns.length), packed(seen, data.shown.length), data.shown];
});
console.log(JSON.stringify(answer));
"""


@pytest.fixture(scope="module")
def article_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("article") / "article.html"
    path.write_text(article(), encoding="utf-8")
    return path


def flown_in_node(path, changes):
    """Log and shown rows of every figure's flight, with some parameters changed."""
    rows = json.loads(run_node(FLY, str(path), json.dumps(changes)))

    def table(packed, width):
        return np.frombuffer(base64.b64decode(packed)).reshape(-1, width)

    logs = {name: np.frombuffer(base64.b64decode(log)) for name, log, _, _ in rows}
    shown = {name: dict(zip(names, table(seen, len(names)).T, strict=True)) for name, _, seen, names in rows}
    return logs, shown


def source(name):
    """Of a figure, in TypeScript."""
    return (FRONTEND / "src" / "article" / "figures" / f"{name}.ts").read_text(encoding="utf-8")


def words(text):
    """The words of the text, formulas as one, without the list of sections, captions and questions."""
    beside = r"<nav.*?</nav>|<svg.*?</svg>|<table.*?</table>|<figcaption.*?</figcaption>|<details.*?</details>"
    text = re.sub(beside, " ", text, flags=re.DOTALL)
    text = re.sub(r'<div class="equation".*?</div>', " ", text, flags=re.DOTALL)
    text = re.sub(r"<math.*?</math>", "x", text, flags=re.DOTALL)
    return re.sub(r"<[^>]+>", " ", text).split()


def test_the_text_is_of_2500_words_and_has_five_figures_that_are_there_without_javascript():
    text = body()
    assert 2300 <= len(words(text)) <= 2800
    assert "{{" not in text
    assert "$" not in text
    drawn = re.findall(r'<figure id="(\w+)" class="live">\n<div class="drawing"[^>]*><svg', text)
    assert sorted(drawn) == sorted(FIGURES)
    assert set(FLIGHTS) <= set(FIGURES)
    listed = re.findall(r'<li><a href="#([\w-]+)">(.+?)</a></li>', text)
    assert [said for _, said in listed] == re.findall(r"<h2[^>]*>(.+?)</h2>", text)
    assert all(text.count(f'id="{name}"') == 1 for name, _ in listed)


def test_every_symbol_that_lights_up_has_something_to_light_in_its_section():
    for section in re.findall(r"<section.*?</section>", body(), re.DOTALL):
        lights = {one for found in re.findall(r'data-s="([^"]*)"', section) for one in found.split()}
        symbols = set(re.findall(r'<mrow class="s-(\w+)"', section))
        assert symbols <= lights or not lights, symbols - lights


def test_the_verdicts_are_those_of_the_study():
    claims = json.loads(GOLDEN.read_text(encoding="utf-8"))["verdicts"]
    counted = [list(claims.values()).count(verdict) for verdict in ("holds", "fails")]
    open_ones = len(claims) - sum(counted)
    said = f"Of {len(claims)} statements that the paper makes about its flights, <code>quadstep reproduce</code> finds that"
    assert f"{said} {counted[0]} hold, {counted[1]} fail, and {open_ones} are undecided" in body()


@needs(NODE)
def test_figures_fly_the_bits_of_the_package(article_file):
    logs, _ = flown_in_node(article_file, {})
    for name, mission in missions().items():
        assert np.array_equal(logs[name], fly(mission.plan()).rows.ravel(), equal_nan=True), name


@needs(NODE)
def test_the_four_rates_are_the_rate_of_l(article_file):
    slow = {f"gains.{key}.{i}": value for i in range(3) for key, value in (("slope_2", 1.0), ("gain_2", 15.0))}
    _, shown = flown_in_node(article_file, {"disturbance.scale": 0.5, **slow})
    for name in ("nested", "lyapunov"):
        one = shown[name]
        height = sum(one[part] for part in ("L_position", "L_attitude", "L_integrals"))
        rate = sum(one[part] for part in SHOWN if part.startswith("rate_"))
        period = FLIGHTS[name]["simulation"]["log_period"]
        found = (height[2:] - height[:-2]) / (2.0 * period)
        late = slice(round(1.2 / period), None)  # past the first second, where 20 ms from row to row are short
        assert np.abs(found - rate[1:-1])[late].max() < 0.03 * np.abs(rate[late]).max(), name
        assert np.abs(one["rate_coupling"][late]).max() > 0.05 * np.abs(rate[late]).max()


SLOW = {"Lambda2": 0.5, "K_r2": 6.0}
"""Gains with which Figure 5 begins."""


class Asked(NamedTuple):
    thrust: Number
    torque: Vector
    attitude: Vector


@dataclass(frozen=True)
class Obeyed(Lagrange):
    """The paper's plant, on which the force that the law asks for acts, whatever the attitude."""

    def rest(self, state, p):
        return super().rest(state, p)[0], Asked(0.0, state.rates, state.rates)

    def actuate(self, p, command):
        return Asked(command.thrust, command.torque, command.desired_attitude)

    def rate(self, p, state, held, wind, time):
        made = super().rate(p, state, held, wind, time)
        missing = held.thrust * (thrust_direction(held.attitude) - thrust_direction(state.attitude))
        return made._replace(velocity=made.velocity + (1.0 / p.vehicle.mass) * missing)


def obeyed_and_flown(mission):
    """The errors of position [m], |r| and the flight: with the wanted force, and as it is."""
    plan = mission.plan()
    plant = Obeyed(**{one.name: getattr(plan.loop.plant, one.name) for one in fields(Lagrange)})
    for flight in (fly(plan._replace(loop=replace(plan.loop, plant=plant))), fly(plan)):
        away = np.hypot.reduce([flight.column(axis) - flight.column(f"{axis}_d") for axis in "xyz"])
        yield away, np.hypot(flight.column("norm_r1"), flight.column("norm_r2")), flight


def test_with_the_wanted_force_the_flights_that_diverge_come_home():
    begun = {**FLIGHTS["lyapunov"], "controller": {**FLIGHTS["lyapunov"]["controller"], **SLOW}}
    (near, r, _), (_, loose, _) = obeyed_and_flown(LagrangeMission.model_validate(begun))
    assert 0.005 < near[-1] < 0.015, "1 cm"
    assert r.max() == r[0]
    assert loose.max() > 5 * r.max()
    (near, _, whole), (_, _, lost) = obeyed_and_flown(read_mission(ROOT / "examples" / "theorem_fails.toml"))
    assert whole.column("t")[-1] == 40.0
    assert np.sqrt(np.mean(near**2)) == pytest.approx(0.2e-6, abs=0.05e-6)
    assert 6.0 < lost.column("t")[-1] < 7.0


@needs(NODE)
def test_what_raises_l_in_figure_5_is_as_the_text_says(article_file):
    named = {"slope_2": SLOW["Lambda2"], "gain_2": SLOW["K_r2"]}
    logs, shown = flown_in_node(article_file, {f"gains.{key}.{i}": value for key, value in named.items() for i in range(3)})
    one, rows = shown["lyapunov"], logs["lyapunov"].reshape(len(shown["lyapunov"]["L_position"]), -1)
    late = round(6.3 / PERIOD) + 1
    added = {name: np.trapezoid(one[f"rate_{name}"][:late], dx=PERIOD) for name in ("coupling", "unknown")}
    assert added == pytest.approx({"coupling": 7.0, "unknown": 15.0}, abs=0.5)
    at = round(4.6 / PERIOD)
    assert one["rate_unknown"][at] / rows[at, list(COLUMNS).index("norm_r2")] > 9.0, "|eps| is no less"


@needs(NODE)
def test_figure_5_shows_how_far_the_quickest_inner_loop_errs(article_file):
    logs, shown = flown_in_node(article_file, {})
    rows = logs["lyapunov"].reshape(len(shown["lyapunov"]["L_position"]), -1)
    assert rows[:, list(COLUMNS).index("norm_r2")].max() == pytest.approx(0.0698, abs=1e-4)  # 28 ms after the start


@needs(NODE)
def test_what_the_text_says_of_both_gains_raised_in_figure_1_is_flown(article_file):
    raised = {f"gains.{key}.{i}": value for key, value in {"slope_1": 2.0, "gain_1": 6.0}.items() for i in range(3)}
    logs, _ = flown_in_node(article_file, raised)
    rows = logs["nested"].reshape(-1, len(COLUMNS))
    t, x, theta = (rows[:, list(COLUMNS).index(name)] for name in ("t", "x", "theta"))
    assert t[np.argmax(abs(x) < 0.15)] == pytest.approx(1.8, abs=0.05)
    assert np.degrees(abs(theta).max()) == pytest.approx(80.0, abs=2.0)


def test_what_the_text_says_of_doubled_gains_is_flown():
    slow = read_mission(ROOT / "examples" / "theorem_fails.toml")
    alone, *nets = (
        slow.with_(controller__K_r2=gain, controller__nets__enabled=nets)
        for gain, nets in ((12.0, False), (12.0, True), (40.0, True))
    )
    assert fly(alone).metrics()["position_rmse[m]"] < 1e-3
    assert grade(alone).why.startswith("gain margin 2.0 dB")
    assert [fly(one).outcome.name == "COMPLETED" for one in nets] == [False, True]


@needs(NODE)
def test_functions_beside_the_law_give_its_bits():
    forces = [(1.0, 2.0, -3.0), (10.0, 0.1, 0.1), (0.0, 0.0, 9.81), (-4.0, 3.0, 0.5), (2.0, -1.0, -6.0)]
    script = (
        f"const t={tools()};console.log(JSON.stringify({json.dumps(forces)}.map(f=>[...t.invert(...f),...t.printedRoll(...f),"
    )
    script += "...t.direction(f[0]/9,f[1]),...t.ball(0.01,f[0],0.02,2)])))"
    for force, found in zip(forces, json.loads(run_node(script)), strict=True):
        x, y, _ = force
        direction = thrust_direction(Vector((0.0, x / 9.0, y)))
        assert found == [*invert_force(Vector(force)), printed_roll(force), *direction, *ball(0.01, x, 0.02, 2.0)]
    u, theta, _ = invert_force(Vector((1.0, 2.0, -3.0)))
    made = [u * one for one in thrust_direction(Vector((0.0, theta, printed_roll((1.0, 2.0, -3.0)))))]
    assert np.linalg.norm(np.subtract(made, (1.0, 2.0, -3.0))) == pytest.approx(7.211, abs=1e-3)  # as the text says of Eq. 52
    assert ball(0.01, 2.0, 0.02, 2.0)[0] == error_radius(2.0, 0.02, 0.01, 2.0)


def test_explain_writes_one_file_and_replaces_no_other(tmp_path, capsys):
    out = tmp_path / "new" / "a.html"
    explain(out)
    explain(out)
    assert "0.52 MB" in capsys.readouterr().out
    assert [path.name for path in out.parent.iterdir()] == ["a.html"]
    place, text = out.with_name("page.html"), fill(STAND_IN, "page", {"links": []}, "0")
    place.write_text(text)
    assert link_pair(out.with_name("b.html"), text) == text
    assert '"links":[{"label":"The flights, live","href":"page.html"}]' in link_pair(out.with_name("article.html"), text)
    assert '"links":[{"label":"The article","href":"article.html"}]' in place.read_text(), "and from there to the article"
    other = tmp_path / "notes.html"
    other.write_text("mine")
    with pytest.raises(UserError, match="exists and is not a page"):
        explain(other)
    assert other.read_text() == "mine"


@pytest.fixture
def opened(browsers, article_file):
    """Opens the article; a request beyond its file, and an error, fails the test."""
    said = []

    def at(width, scheme="light", motion="reduce"):
        page = browsers[False].page()
        page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on(
            "request", lambda request: said.append(request.url) if not request.url.startswith(("file:", "data:")) else None
        )
        page.set_viewport_size({"width": width, "height": 900})
        page.emulate_media(color_scheme=scheme, reduced_motion=motion)
        page.goto(article_file.as_uri())
        for name in FIGURES:
            page.wait_for_selector(f"#{name} .drawing[data-live] > svg")
        return page

    yield at
    browsers[False].blank()
    assert said == []


@needs(CHROMIUM)
def test_stills_are_the_figures_as_they_begin(opened):
    for name, drawing in stills(opened(WIDTH)).items():
        assert drawing + "\n" == (STILLS / f"{name}.svg").read_text(encoding="utf-8"), "run `python docs/article.py`"


@needs(CHROMIUM)
def test_figures_follow_the_finger_and_the_keyboard_and_symbols_light_up(opened):
    page = opened(360)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert page.locator("#inversion .name sub").all_text_contents() == ["x", "y", "z"]
    assert page.locator("#inversion .low").all_text_contents() == list("ddddd")
    assert not any("_" in said for said in page.locator(".drawing text").all_text_contents())
    labels = page.evaluate("[...document.querySelectorAll('input[type=range]')].map((one) => one.labels[0]?.innerText)")
    assert len(labels) > 10 and all(labels)
    for name in FIGURES:
        before = page.locator(f"#{name} .drawing").inner_html()
        page.locator(f"#{name} input").first.press("ArrowRight" if name == "lyapunov" else "ArrowLeft")
        assert until(page, lambda name=name, before=before: page.locator(f"#{name} .drawing").inner_html() != before)
    handle = page.locator("#inversion .handle")
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    assert box["width"] >= 18
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y + 170, steps=4)
    page.mouse.up()
    assert until(page, lambda: "misses by" in page.locator("#inversion .drawing").text_content())
    page.locator("#idea .s-e1").first.focus()
    assert page.evaluate("getComputedStyle(document.querySelector('#nested [data-s~=vel]')).opacity") == "0.16"


@needs(CHROMIUM)
def test_links_of_the_text_set_a_figure_and_sliders_reach_their_ends(opened):
    page = opened(1024)
    text = page.locator("#lyapunov .drawing")
    assert "6.0 − 10 · 0.50 = 1.0 > 0: holds" in text.text_content()
    page.locator("a[data-set^='Lambda2=15']").click()
    assert until(page, lambda: "250.0 − 10 · 15.00 = 100.0 > 0: holds" in text.text_content())
    rings = sorted(text.locator("text.small").evaluate_all("all => all.map(one => one.y.baseVal[0].value)"))
    assert len(rings) >= 4 and all(below - above > 15 for above, below in itertools.pairwise(rings)), "none covers another"
    rights = "all => all.map(one => one.getBoundingClientRect().right)"
    ends = page.locator("mtable.aligned").nth(1).locator("mtd:first-child > :last-child").evaluate_all(rights)
    assert max(ends) - min(ends) < 1, "formulas are aligned at their signs"
    page.locator("#lyapunov input").nth(1).press("Home")
    assert until(page, lambda: "6.0 − 10 · 15.00 = −144.0: does not hold" in text.text_content())
    assert page.locator("#lyapunov [data-s=ball]").count() == 0  # without a surplus there is none
    page.locator("#lyapunov input").first.press("End")
    assert page.locator("#lyapunov output").first.inner_text() == "15 /s"
    page.locator("#lyapunov button", has_text="Reset").click()
    assert until(page, lambda: "6.0 − 10 · 0.50 = 1.0 > 0: holds" in text.text_content())
    for _ in range(11):
        page.locator("#lyapunov input").first.press("ArrowRight")
    assert until(page, lambda: "6.000 − 10 · 0.6030 = −0.030: does not hold" in text.text_content())


@needs(CHROMIUM)
def test_an_axis_has_more_than_one_number(opened):
    page = opened(1024)
    page.locator("a", has_text="Slow the inner loop down tenfold").click()
    heights = "all => all.filter(one => one.getAttribute('text-anchor') === 'end').map(one => one.textContent)"
    assert until(page, lambda: page.locator("#nested .tick").evaluate_all(heights)[-4:] == ["−40", "−20", "0", "20"])


CENTRE = """() => {
  const label = document.querySelector("#nested text[data-s~=vel]");
  label.scrollIntoView({ block: "center", behavior: "instant" });
  const { x, y, width, height } = label.getBoundingClientRect();
  return [x + width / 2, y + height / 2];
}"""


@needs(CHROMIUM)
def test_back_returns_from_a_figure_to_its_link_and_a_resting_mouse_lights_nothing(opened):
    page = opened(1024)
    link = page.locator("a[data-set='Lambda1=2 K_r1=6 time=0.6']")
    link.evaluate("link => link.scrollIntoView({ block: 'start' })")
    before = page.evaluate("scrollY")
    link.click()
    assert until(page, lambda: page.evaluate("scrollY") < before - 500)
    page.go_back()
    assert until(page, lambda: page.evaluate("scrollY") == before)
    x, y = page.evaluate(CENTRE)  # at once: the figure is drawn anew meanwhile
    page.evaluate("scrollBy(0, 300)")
    page.mouse.move(x, y)
    page.evaluate("globalThis.over = []; addEventListener('pointerover', (event) => over.push(event.target.dataset.s))")
    page.evaluate("scrollBy(0, -300)")
    assert until(page, lambda: page.evaluate("over.some((one) => one?.includes('vel'))")), (
        "the page brings the curve to the mouse"
    )
    lit = "document.querySelectorAll('[data-lit]').length"
    assert page.evaluate(lit) == 0
    page.mouse.move(x + 1, y)
    assert until(page, lambda: page.evaluate(lit) == 1)


@needs(CHROMIUM)
def test_paper_has_few_pages_and_no_instructions(opened):
    page = opened(1024)
    sheets = re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True))
    assert 7 <= len(sheets) <= 10, "a figure that does not fit leaves its page half empty"
    page.emulate_media(media="print")
    shown = page.locator("main").inner_text()
    assert "Nested commands" in shown and not re.search("Drag|Touch|Reset", shown)
    page.emulate_media(media="null")


def test_links_of_the_text_name_sliders_that_are_there():
    sliders = {name: set(re.findall(r'slider\(stage, "(\w+)"', source(name))) for name in FIGURES}
    sliders["inversion"] = {"f_x", "f_y", "f_z"}
    for figure, settings in re.findall(r'<a href="#(\w+)" data-set="([^"]+)"', body()):
        assert {one.partition("=")[0] for one in settings.split()} <= sliders[figure]


@needs(CHROMIUM)
def test_a_drag_across_a_plot_moves_its_time(opened):
    page = opened(1024)
    page.locator("#nested").scroll_into_view_if_needed()
    box = page.locator("#nested .drawing svg svg").first.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 8, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, y, steps=3)
    page.mouse.up()
    assert until(page, lambda: "t = 2.0" in page.locator("#nested .drawing").text_content())


@needs(CHROMIUM)
def test_a_finger_drags_a_handle_down_and_the_page_stays(opened):
    page = opened(360)
    handle = page.locator("#inversion .handle")
    handle.scroll_into_view_if_needed()
    box, scrolled = handle.bounding_box(), page.evaluate("scrollY")
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    session = page.context.new_cdp_session(page)
    session.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
    for kind, points in (("touchStart", [0]), ("touchMove", range(10, 171, 20)), ("touchEnd", [])):
        for down in points or [None]:
            at = [] if down is None else [{"x": x, "y": y + down}]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})
    session.send("Emulation.setTouchEmulationEnabled", {"enabled": False})
    assert until(page, lambda: "misses by" in page.locator("#inversion .drawing").text_content())
    assert page.evaluate("scrollY") == scrolled


@needs(CHROMIUM)
@pytest.mark.parametrize(("motion", "button"), [("no-preference", "Stop"), ("reduce", "Play")])
def test_a_figure_inside_another_page_stands_alone_flies_and_takes_its_theme(browsers, article_file, motion, button):
    page = browsers[False].page()
    page.emulate_media(reduced_motion=motion)
    around = article_file.with_name("around.html")
    script = shutil.copyfile(ROOT / "docs" / "site" / "static" / "frames.js", article_file.with_name("frames.js")).name
    frame = '<iframe class="flying" src="article.html?figure=nested" width="900" height="200" style="border: 0"></iframe>'
    around.write_text(f'<!doctype html><script src="{script}"></script>{frame}')
    page.goto(around.as_uri())
    figure = page.frame_locator("iframe")
    assert until(page, lambda: figure.locator("#nested .drawing[data-live]").count() == 1)
    shown = figure.locator("#nested").bounding_box()["height"]
    assert until(page, lambda: shown <= page.locator("iframe").bounding_box()["height"] <= shown + 3)  # the whole figure
    assert until(page, lambda: figure.locator("#nested .plain").first.text_content() == button)
    assert figure.locator("figure:visible, h1:visible, h2:visible, p:visible").count() == 1
    drawing, slider = (figure.locator(f"#nested {part}").first.bounding_box() for part in (".drawing", "input"))
    assert slider["x"] > drawing["x"] + drawing["width"]  # beside it, not below
    assert slider["y"] < drawing["y"] + 100
    first, second = (figure.locator("#nested .plain").nth(i).bounding_box() for i in (0, 1))
    assert first["y"] == second["y"]
    for theme in ("dark", "light"):  # as the page around it is switched
        page.evaluate("(theme) => { document.body.dataset.theme = theme; }", theme)
        assert until(page, lambda theme=theme: figure.locator(f"html[data-theme={theme}]").count() == 1)
    page.emulate_media(reduced_motion="reduce")
    browsers[False].blank()


@needs(CHROMIUM)
@pytest.mark.parametrize(("width", "scheme"), [(1024, "light"), (360, "dark")])
def test_axe_finds_nothing(opened, width, scheme):
    assert axe(opened(width, scheme)) == []


@needs(CHROMIUM)
@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (360, 740)])
def test_a_vehicle_flies_on_the_first_screen_until_somebody_takes_the_time(opened, width, height):
    page = opened(width, motion="no-preference")
    page.set_viewport_size({"width": width, "height": height})
    lowest = "[...document.querySelectorAll('#nested .craft')].at(-1).getBoundingClientRect().bottom"
    assert page.evaluate(lowest) < height
    clock = page.locator("#nested .drawing text", has_text="t = ")
    before = clock.first.text_content()
    assert until(page, lambda: clock.first.text_content() != before)
    page.locator("#nested input").last.press("ArrowLeft")
    assert until(page, lambda: page.locator("#nested .plain").first.text_content() == "Play")


@needs(CHROMIUM)
def test_the_time_of_a_lost_flight_ends_with_it(opened):
    page = opened(1024)
    page.locator("a[data-set='F1=20']").click()
    said = page.locator("#net .drawing").text_content
    assert until(page, lambda: "lost after 2.6 s" in said())
    assert "along x at 2.60 s" in said()
    assert page.locator("#net output").last.inner_text() == "2.6 s"
