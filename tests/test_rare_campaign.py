"""`quadstep campaign --rare`: known probabilities through flights, what is kept and resumed, and what is refused."""

import json
import os
import re
import signal
from types import SimpleNamespace

import numpy as np
import pytest

from quadstep.io.errors import InterruptedRun, UserError
from quadstep.io.parts import sealed
from quadstep.numbers.noise import probability
from quadstep.report import units
from quadstep.report.markup import figure
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.run import CampaignRequest
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.rare import run
from quadstep.studies.rare.cross_entropy import Replicate
from quadstep.studies.rare.mixture import FIRST, Points
from quadstep.studies.rare.point_flyer import PointFlyer, values
from quadstep.studies.rare.replicates import by_choice
from tests.campaigns import NOISY, of, refused
from tests.commands import quadstep

METRIC = """
from quadstep.interfaces.log import Metric
from quadstep.numbers import maximum


class Far(Metric):
    name = "far"

    def start(self):
        return -1e9

    def add(self, sums, sample):
        return maximum(sums, (sample["x"] + sample["y"]) / 0.01)

    def value(self, sums):
        return sums
"""
"""x + y at the start, in deviations of one: the vehicle begins at rest, and one sample later is where it was."""

MISSION = """
metrics = ["far.py:Far"]
path = { type = "minimum-jerk", end = [0.1, 0.0, 0.0], duration = 1.0 }
controller = { type = "backstepping", nets = { enabled = false } }
start = { position = [0.0, 0.0, 0.0] }
simulation = { step = 1e-4, control_period = 1e-4, log_period = 1e-4, duration = 2e-4 }
"""

VARY = """
[vary]
start.position.0 = { type = "normal", mean = 0.0, deviation = 0.01 }
start.position.1 = { type = "normal", mean = 0.0, deviation = 0.01 }
"""

PATHS = """
path = { type = "choice", weights = [3, 1], values = [
    { type = "minimum-jerk", end = [0.1, 0.0, 0.0], duration = 1.0 },
    { type = "minimum-jerk", start = [-0.01, 0.0, 0.0], end = [0.1, 0.0, 0.0], duration = 1.0 },
] }
"""

FAILURE = "[failure]\nfar = 6.0\n"
"""A probability of 1 - Phi(6 / sqrt 2)."""

RARE = '[rare]\nmethod = "cross-entropy"\nscore = "far"\nflights = 300\nreplicates = 5\nopinions = 1\n'


def written(folder, rest=VARY + FAILURE + RARE, mission=MISSION):
    """A campaign file, its mission and its metric, written into a folder; the campaign's path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "far.py").write_text(METRIC, encoding="utf-8")
    (folder / "mission.toml").write_text(mission, encoding="utf-8")
    path = folder / "camp.toml"
    path.write_text(f'mission = "mission.toml"\n{rest}', encoding="utf-8")
    return path


def kept(folder):
    """rare.json."""
    return json.loads((folder / "rare.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("kinds", [1, 2])
def test_the_kinds_of_failure_stand_below_one_another_on_a_phone(tmp_path, kinds):
    names = ["ended early", "completed, above a limit"][:kinds]
    events = [
        SimpleNamespace(failure=one, levels=[(3.0, 0.1), (1.0, 1e-10)], probability=1e-12, score=["far"]) for one in names
    ]
    pieces = [SimpleNamespace(kind=one, events=events) for one in (run.PieceKind.REPLICATE.value, "opinion")]
    run.draw_levels(tmp_path / "levels", pieces, Sheet(("svg",)))
    strips = figure(tmp_path / "levels", "").split("<svg ")[1:]
    assert len(strips) == kinds
    assert not any('class="wide"' in one for one in strips)
    any_of_them = SimpleNamespace(kind=run.PieceKind.SCORE.value, events=[SimpleNamespace(failure="any")])
    assert run.dashed(pieces, names) == run.OPINIONS
    assert run.dashed([*pieces, any_of_them], names) == run.OPINIONS + run.UNDRAWN
    assert run.dashed([any_of_them], ["any"]) == run.OPINIONS and not run.dashed(pieces[:1], names)
    events[0].levels = [(None, 0.2)]
    assert run.climbed(pieces) == names[1:], "of a common failure there are no steps to draw"


def test_it_says_a_known_probability_and_the_most_likely_failure(tmp_path):
    path, out = written(tmp_path), tmp_path / "out"
    ran = quadstep("campaign", path, "--rare", "--out", out)
    assert (ran.code, ran.err) == (0, "")
    judged = "success means reaching the end with far at most 6, however large the error; "
    judged += "only the first 0.0002 s of a path of 1 s are flown"
    assert "A flight fails with probability" in ran.out
    assert f"From 5 independent estimates (replicates) by cross-entropy ({judged})." in ran.out
    assert re.search(r"Second opinion by subset simulation, as a check: \S+ × \S+ by the same score\.", ran.out), ran.out
    found = kept(out)["summary"]
    true = probability(-6.0 / 2.0**0.5)
    assert found["probability"]["value"] == pytest.approx(true, rel=0.3)
    assert found["probability"]["low"] < true < found["probability"]["high"]
    assert found["flights"] * 10 < found["flights_one_by_one"]
    assert found["warnings"] == []
    (near,) = found["nearest_failures"]
    assert sum(near["values"].values()) == pytest.approx(0.06, rel=0.1)
    assert near["deviations"] == pytest.approx(6.0 / 2.0**0.5, rel=0.1)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "The most likely flight that failed" in page
    assert page.count("<figure") == 1
    assert (out / "figures" / "levels.png").exists()

    again = quadstep("campaign", path, "--rare", "--out", out)
    refused(again, "holds the estimate 'camp' (complete)", "--resume", "--overwrite")
    machine = quadstep("campaign", path, "--rare", "--out", out, "--resume", "--json", "--require", "0.999999")
    told = json.loads(machine.out)
    assert (machine.code, told["exit_code"], told["passed"]) == (4, 4, False)
    assert told["probability"] == found["probability"]
    assert told["requirement"]["shown"] == 1.0 - found["probability"]["high"]
    assert quadstep("campaign", path, "--rare", "--out", out, "--resume", "--require", "0.9999").code == 0


@pytest.fixture
def heeded():
    """Interrupts are heeded, though a shell's background job would ignore them."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupted_run_goes_on_to_the_same_result(tmp_path, monkeypatch, heeded):
    path = written(tmp_path)
    whole = run.estimate(CampaignRequest(path, tmp_path / "whole"))
    fly = run.fly_piece

    def pressed(flights, piece, told):
        if piece.place == 2:
            os.kill(os.getpid(), signal.SIGINT)
        return fly(flights, piece, told)

    monkeypatch.setattr(run, "fly_piece", pressed)
    with pytest.raises(InterruptedRun, match=r"2 of 6 replicates are kept in .*; continue with --resume"):
        run.estimate(CampaignRequest(path, tmp_path / "part"))
    assert len(kept(tmp_path / "part")["pieces"]) == 2
    assert not kept(tmp_path / "part")["complete"]
    monkeypatch.setattr(run, "fly_piece", fly)
    assert run.estimate(CampaignRequest(path, tmp_path / "part", resume=True)).summary == whole.summary


def test_what_has_changed_cannot_be_resumed(tmp_path):
    path, out = (
        written(tmp_path, VARY + FAILURE + RARE.replace("300", "200").replace("opinions = 1", "opinions = 0")),
        tmp_path / "out",
    )
    refused(quadstep("campaign", path, "--rare", "--out", out, "--resume"), "there is no estimate to resume")
    assert quadstep("campaign", path, "--rare", "--out", out).code == 0
    path.write_text(path.read_text().replace("far = 6.0", "far = 5.0"))
    refused(quadstep("campaign", path, "--rare", "--out", out, "--resume"), "cannot be resumed", "has changed")
    before = sorted(one.name for one in out.rglob("*"))
    assert quadstep("campaign", path, "--rare", "--out", out, "--overwrite").code == 0
    assert sorted(one.name for one in out.rglob("*")) == before
    (out / "rare.json").write_text("{}")
    refused(quadstep("campaign", path, "--rare", "--out", out, "--resume"), "is damaged, or was not written by quadstep")
    refused(quadstep("campaign", path, "--out", out), "contains other files")


@pytest.mark.parametrize(("rest", "options", "said"), [
    ("[vary]\n", (), ("vary: empty",)),
    ('[vary]\nstart.position.0 = { type = "grid", values = [0.0, 1.0] }\n', (), ("vary.start.position.0: a grid",)),
    (VARY + "[rare]\nscore = 'speed'\n", (), ("rare.score: 'speed'", "allowed here: position_rmse", "far")),
    (VARY + "[rare]\nscore = []\n", (), ("rare.score",)),
    (VARY + "[rare]\nmethod = 'crude'\n", (), ("rare.method", "cross-entropy", "subset")),
    (VARY + "[rare]\nmethod = 3\n", (), ("rare.method: should be cross-entropy or subset, not 3",)),
    (VARY + "[rare]\nflights = 10\n", (), ("rare.flights", "200")),
    (VARY + "[rare]\nreplicates = 1\n", (), ("rare.replicates", "5")),
    (VARY + "[rare]\nlevels = 3\n", (), ("rare.levels: unknown key", "replicates")),
    (VARY, ("--flights", "100"), ("--flights: cannot be used with --rare",)),
    (VARY, ("--engine", "gpu"), ("--engine: cannot be used with --rare",)),
    (VARY, ("--until", "1e-3"), ("--until: cannot be used with --rare",)),
    ('[vary]\nvehicle.mass = { type = "normal", mean = 0.1, deviation = 1.0 }\n', (), ("vehicle.mass",)),
])  # fmt: skip
def test_wrong_input_is_one_line(tmp_path, rest, options, said):
    refused(quadstep("campaign", written(tmp_path, rest), "--rare", "--out", tmp_path / "out", *options), *said)
    assert not (tmp_path / "out").exists()


def test_normal_numbers_become_the_campaigns_own_values():
    """The same quantile functions as of any flight, at shares that the normal distribution gives."""
    file = of(
        """
        [vary]
        a = { type = "uniform", low = 1.0, high = 3.0 }
        b = { type = "choice", values = ["x", "y"], weights = [1, 3] }
        c = { type = "sobol", low = 0.0, high = 1.0 }
        d = { type = "log-normal", median = 2.0, sigma = 0.5, high = 4.0 }
        [[correlated]]
        keys = ["e", "f"]
        mean = [0.0, 1.0]
        covariance = [[1.0, 0.8], [0.8, 1.0]]
        """
    )
    found = values(file, np.array([[0.0] * 6, [1.0] * 6, [-9.0] * 6, [9.0] * 6]))
    assert list(found) == ["a", "b", "c", "d", "e", "f"]
    assert found["a"].values[:2].tolist() == pytest.approx([2.0, 1.0 + 2.0 * probability(1.0)])
    assert [found["b"].at(i) for i in range(4)] == ["y", "y", "x", "y"]
    assert found["e"].values[:2].tolist() == pytest.approx([0.0, 1.0])
    assert found["f"].values[1] == pytest.approx(1.0 + 0.8 + 0.6)
    assert all(np.isfinite(found[name].values.astype(float)).all() for name in found)
    assert found["d"].values.max() == pytest.approx(4.0)


def test_a_flight_keeps_or_changes_its_noise_by_its_number(tmp_path):
    rest = '[vary]\nvehicle.mass = { type = "normal", mean = 2.6, deviation = 0.1 }\n[failure]\nlargest_error = 0.2\n'
    flights = PointFlyer(read_campaign(written(tmp_path, rest, NOISY)))
    assert flights.noisy
    assert [event.failure.value for event in flights.events()] == ["completed, above a limit", "ended early"]
    table = flights.fly(Points(np.zeros((3, 1)), np.array([FIRST, FIRST + 1, FIRST])))
    first, other, same = table["position_rmse[m]"].to_pylist()
    assert first == same != other


@pytest.mark.parametrize("together", [False, True])
def test_a_draw_beyond_the_range_of_its_key_is_said_with_what_bounds_it(tmp_path, together):
    law = 'controller = { type = "choice", values = [{ type = "rotation-backstepping", mass = 2.644 }] }\n'
    alone = '[vary]\nvehicle.mass = { type = "normal", mean = 2.6, deviation = 0.4 }\n' + law
    joint = "[vary]\n" + law + '[[correlated]]\nkeys = ["vehicle.mass", "wind.mean.0"]\nmean = [2.6, 1.0]\n'
    joint += "covariance = [[0.16, 0.0], [0.0, 0.01]]\n"
    rest = (joint if together else alone) + "[failure]\nlargest_error = 0.2\n"
    flights = PointFlyer(read_campaign(written(tmp_path, rest, NOISY)))
    latent = np.zeros((2, len(flights.campaign.file.keys)))
    latent[1, flights.campaign.file.keys.index("vehicle.mass")] = -7.0
    with pytest.raises(UserError) as error:
        flights.fly(Points(latent, np.array([FIRST, FIRST + 1])))
    end = "give vehicle.mass low or high in [vary]" + ", not in [[correlated]]" * together
    assert str(error.value).endswith(end) and "vehicle.mass: should be" in str(error.value)
    assert '{"type" = "rotation-backstepping", "mass" = 2.644}' in str(error.value), "as in TOML"


def test_the_probability_is_said_of_each_value_of_a_choice(tmp_path):
    """Both are known: with the second path, which begins beside, failures are 18 times as frequent."""
    metric = METRIC.replace('sample["y"]', 'sample["y"] - sample["x_d"]')
    path = written(tmp_path, VARY + PATHS + FAILURE + RARE)
    (tmp_path / "far.py").write_text(metric, encoding="utf-8")
    ran = quadstep("campaign", path, "--rare", "--out", tmp_path / "out")
    assert ran.code == 0, ran
    found = kept(tmp_path / "out")["summary"]
    near, far = found["by_choice"].values()
    true = [probability(-limit / 2.0**0.5) for limit in (6.0, 5.0)]
    assert [one["low"] < each < one["high"] for one, each in zip((near, far), true, strict=True)] == [True, True]
    assert 0.75 * near["value"] + 0.25 * far["value"] == pytest.approx(found["probability"]["value"])
    said = " and ".join(
        f"{units.number(one['value'])} with {name} (95 % interval {units.number(one['low'])} to {units.number(one['high'])})"
        for name, one in found["by_choice"].items()
    )
    assert f"A flight fails with probability {said}, if no kind of failure was missed. Over all" in ran.out.replace("\n", " ")
    assert "by subset simulation, other method" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_choice_between_numbers_or_of_many_values_is_drawn_as_any_key(tmp_path):
    for options in ("[1.0, 1.1]", "[1.0]", "[true, false, true, false]"):
        key = "controller.nets.enabled" if "true" in options else "vehicle.mass"
        rest = f'{VARY}{key} = {{ type = "choice", values = {options} }}\n'
        flights = PointFlyer(read_campaign(written(tmp_path, rest + FAILURE + RARE)))
        nothing = Points(np.zeros((0, 3)), np.zeros(0, int))
        assert by_choice(flights.campaign.file, Replicate(0.0, 1, nothing, (), nothing, np.zeros(0))) == {}


def test_an_estimate_of_another_version_is_replaced_if_asked(tmp_path):
    path, out = written(tmp_path, VARY + FAILURE + RARE.replace("opinions = 1", "opinions = 0")), tmp_path / "out"
    quadstep("campaign", path, "--rare", "--out", out)
    before = kept(out)
    older = {name: one for name, one in before.items() if name != "wanted"} | {"fits": 3}
    (out / "rare.json").write_bytes(sealed(older))
    for option in ((), ("--resume",)):
        refused(quadstep("campaign", path, "--rare", "--out", out, *option), "is damaged, or was not written by quadstep")
    assert quadstep("campaign", path, "--rare", "--out", out, "--overwrite").code == 0
    assert kept(out)["summary"] == before["summary"]
    (out / "rare.json").write_text("{}")
    refused(quadstep("campaign", path, "--rare", "--out", out, "--overwrite"), "is damaged, or was not written by quadstep")


def test_a_switch_has_no_deviation_and_does_not_count_in_the_distance(tmp_path):
    """Nor is the grade of the mission as written said where a switch is drawn: it is that of some flights only."""
    switch = 'controller.nets.enabled = { type = "choice", values = [true, false] }\n'
    path, out = written(tmp_path, VARY + switch + FAILURE + RARE.replace("opinions = 1", "opinions = 2")), tmp_path / "out"
    ran = quadstep("campaign", path, "--rare", "--out", out)
    assert ran.code == 0 and "Hovering at the start" not in ran.out, ran
    (near,) = kept(out)["summary"]["nearest_failures"]
    assert set(near["deviations_by_key"]) == {"start.position.0", "start.position.1"} < set(near["values"])
    assert near["deviations"] == pytest.approx(np.linalg.norm([*near["deviations_by_key"].values()]))
    assert re.search(r"^nets +(on|off) +–$", ran.out, re.MULTILINE), ran.out
    assert [*kept(out)["summary"]["by_choice"]] == ["nets on", "nets off"]
