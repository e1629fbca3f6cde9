"""`quadstep fly` with a real vehicle: the files it writes, what they say, and how flights end."""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from quadstep.mission.read import check_mission, read_mission
from quadstep.report import units
from quadstep.vehicle.in_space import airframe_columns
from tests.commands import columns, files, quadstep, strict_json, without_figures, write

pytestmark = pytest.mark.usefixtures("ungraded")

FLIGHT = """\
name = "In the wind"
seed = 7
score_from = 0.3
[vehicle]
preset = "research-2.6kg"
ground = 0.0
[path]
type = "figure-eight"
length = 2.0
width = 1.0
period = 6.0
ramp = 1.0
centre = [0.0, 0.0, 1.0]
[wind]
mean = [4.0, 0.0, 0.0]
turbulence = { intensity = "light" }
[sensors]
position_noise = 0.002
latency = 0.02
[simulation]
duration = 0.6
[controller]
"""
NETS = FLIGHT + 'type = "rotation-backstepping"\nnets.neurons = 4\n'
PICTURES = {"path", "position", "attitude", "inputs", "vehicle"}


def without_airframe_figures(patch):
    without_figures(patch)
    patch.setattr("quadstep.mission.schema.flight_jobs", lambda *_: [])
    patch.setattr("quadstep.page.build.write_mission_page", lambda *_: None)


@pytest.fixture
def plain(monkeypatch):
    """Without figures and page, where these are not the point."""
    without_airframe_figures(monkeypatch)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A flight with figures."""
    folder = tmp_path_factory.mktemp("flown")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quadstep.page.build.write_mission_page", lambda *_: None)
        run = quadstep("fly", write(folder, NETS), "--out", folder / "out", "--figures", "png,svg")
        return run, folder / "out"


def test_it_writes_log_figures_metrics_and_weights(flown):
    run, folder = flown
    assert (run.code, run.err) == (0, "")
    pictures = {f"figures/{name}.{kind}" for name in PICTURES for kind in ("png", "svg")}
    assert set(files(folder)) == {"flight.csv", "metrics.json", "report.html", "weights.json"} | pictures
    assert all(files(folder).values())
    assert "Completed 0.6 s" in run.out
    for axis in "xyz":
        assert f"{axis} [mm]" in run.out


def test_the_log_has_the_columns_of_an_airframe_with_units(flown):
    log = columns(flown[1])
    assert list(log) == [f"{name}[{unit}]" for name, unit in airframe_columns(4).items()]
    assert log["t[s]"] == pytest.approx(np.arange(61) / 100)
    assert np.isfinite(list(log.values())).all()


def test_the_metrics_are_those_of_the_log_from_the_score_on(flown):
    metrics, log = strict_json(flown[1] / "metrics.json"), columns(flown[1])
    errors = np.array([log[f"{axis}_d[m]"] - log[f"{axis}[m]"] for axis in "xyz"])
    scored = np.linalg.norm(errors, axis=0)[log["t[s]"] >= 0.3]
    assert len(scored) == 31
    assert metrics["position_rmse[m]"] == pytest.approx(math.sqrt(np.mean(scored**2)))
    assert metrics["largest_error[m]"] == pytest.approx(scored.max())
    assert " mm from 0.3 s on; only the first 0.6 s of a path of " in " ".join(flown[0].out.split())
    assert " from 0.3 s on" in (flown[1] / "report.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert (metrics["outcome"], metrics["ended[s]"], metrics["warnings"]) == ("completed", 0.6, [])
    assert metrics["mission"]["vehicle"]["mass"] == 2.644
    assert set(metrics["files"]) == set(files(flown[1]))


def test_the_pictures_show_rotors_and_wind(flown):
    picture = (flown[1] / "figures" / "vehicle.svg").read_text(encoding="utf-8")
    for words in ("rotor thrust", "wind", "m/s"):
        assert words in picture
    texts = "".join(ET.fromstring(picture).itertext())
    assert "f4" in "".join(texts.split())


def test_the_mission_in_the_metrics_is_the_one_that_was_flown(flown):
    content = strict_json(flown[1] / "metrics.json")["mission"]
    read = check_mission(content, "metrics.json")
    written = read_mission(flown[1].parent / "mission.toml")
    assert read == written


@pytest.mark.parametrize("name", ["W1", "W2"])
def test_a_warm_start_begins_with_the_weights_of_the_flight_before(flown, plain, tmp_path, name):
    saved = strict_json(flown[1] / "weights.json")
    assert (saved["neurons"], saved["seed"], np.shape(saved[name])) == (4, 1, (4, 3))
    end = columns(flown[1])[f"norm_{name}[-]"][-1]
    assert np.linalg.norm(saved[name]) == pytest.approx(end, rel=0.1)
    mission = write(tmp_path, NETS + f"nets.weights = '{flown[1] / 'weights.json'}'\n")
    assert quadstep("fly", mission, "--out", tmp_path / "out").code == 0
    warm = columns(tmp_path / "out")
    assert columns(flown[1])[f"norm_{name}[-]"][0] == 0.0
    assert warm[f"norm_{name}[-]"][0] == pytest.approx(np.linalg.norm(saved[name]), rel=1e-12)
    assert not np.array_equal(warm["x[m]"], columns(flown[1])["x[m]"])


@pytest.mark.parametrize(("kind", "learns"), [("backstepping", True), ("geometric", False)])
def test_only_a_controller_with_nets_writes_weights(plain, tmp_path, kind, learns):
    mission = write(tmp_path, FLIGHT.replace("0.6", "0.35") + f'type = "{kind}"\n')
    assert quadstep("fly", mission, "--out", tmp_path / "out", "--engine", "python").code == 0
    assert (tmp_path / "out" / "weights.json").exists() == learns


def test_a_crash_ends_with_code_3_and_says_so(plain, tmp_path):
    heavy = '[[events]]\ntype = "payload"\ntime = 0.1\nmass = 30.0\n'
    mission = write(tmp_path, FLIGHT.replace("0.6", "2.0") + 'type = "geometric"\nk_x = 24.0\nk_i = 20.0\n' + heavy)
    run = quadstep("fly", mission, "--out", tmp_path / "out", "--engine", "python")
    metrics, log = strict_json(tmp_path / "out" / "metrics.json"), columns(tmp_path / "out")
    assert run.code == 3
    assert metrics["outcome"] == "crashed"
    assert f"Lost at {metrics['ended[s]']:g} s: it hit the ground" in run.out
    assert 0.3 < metrics["ended[s]"] < 1.0
    assert 0.0 < log["z[m]"][-1] < 0.1
    last, ending = log["t[s]"][-1], metrics["ending"]
    assert ending["t[s]"] == metrics["ended[s]"] > last
    assert ending["z[m]"] <= 0.0  # on the ground, where no row of the log is
    assert ending["z[m]"] == pytest.approx(log["z[m]"][-1] + log["v_z[m/s]"][-1] * (ending["t[s]"] - last), abs=1e-3)
    off = np.sqrt(sum((log[f"{name}_d[m]"][-1] - log[f"{name}[m]"][-1]) ** 2 for name in "xyz"))
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"<dt>distance from the path at {last:.4g}\u00a0s</dt><dd>{units.quantity(off, 'm')}<small>in the log" in page
    assert "<dt>largest error" not in page  # of the last row of the log, almost the same distance
    assert "the rotors were saturated" in run.err
    assert not (tmp_path / "out" / "weights.json").exists()


def test_a_weight_that_no_rotor_lifts_is_warned_of(plain, tmp_path):
    mission = write(tmp_path, FLIGHT.replace("ground = 0.0", "mass = 9.0") + 'type = "geometric"\n')
    run = quadstep("fly", mission, "--out", tmp_path / "out", "--engine", "python")
    assert run.code == 0
    said = (
        "vehicle.mass: it cannot hover: 9 kg weigh 88.29 N, its rotors lift at most 57 N; it could with a mass below 5.81 kg, "
    )
    assert f"{said}or rotor.fastest above 1078 rad/s\n" in run.err
    heavy = read_mission(mission)
    assert not heavy.with_(vehicle__mass=5.8).vehicle.warnings()
    assert not heavy.with_({"vehicle.rotor.fastest": 1079.0}).vehicle.warnings()
    assert heavy.with_({"vehicle.rotor.fastest": 1077.0}).vehicle.warnings()
    in_grams = read_mission(mission).with_(vehicle__mass=9000.0).vehicle.warnings()[0]
    assert in_grams.startswith("vehicle.mass: ") and in_grams.endswith("; is the mass in grams?")
    assert all(line.startswith(f"quadstep: warning: {mission}: ") for line in run.err.splitlines())
