"""quadstep from Python: missions without files, the interface of a flight, and errors in one line."""

import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from quadstep import Engine, Flight, Mission, UserError, flight_metrics, fly, fly_all, read_mission
from quadstep.engines import fly as engines
from quadstep.engines.fly import fingerprint
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.studies.fly import fly_mission
from tests.commands import files
from tests.needs import package

ROOT = Path(__file__).parent.parent
LINE = {"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 2.0}
CIRCLE = {"type": "circle", "centre": [0.0, 0.0, 3.0], "radius": 1.0, "period": 6.0, "turns": 0.5}
TOML = """\
name = "Circle"
vehicle = { preset = "crazyflie" }
path = { type = "circle", centre = [0.0, 0.0, 3.0], radius = 1.0, period = 6.0, turns = 0.5 }
controller = { type = "pid" }
wind = { mean = [1.0, 0.0, 0.0] }
"""


@pytest.fixture(scope="module")
def paper():
    return fly(Mission(name="Line", path=LINE))


@pytest.fixture(scope="module")
def real():
    sections = {"vehicle": {"preset": "crazyflie"}, "path": CIRCLE, "controller": {"type": "pid"}}
    return fly(Mission(name="Circle", wind={"mean": (1.0, 0.0, 0.0)}, **sections))


def in_a_new_process(code):
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()


def test_a_mission_is_that_of_its_vehicle():
    assert type(Mission(path=LINE)) is LagrangeMission
    assert type(Mission(path=LINE, vehicle={"mass": 2.0})) is LagrangeMission
    real = Mission(vehicle={"preset": "x500"}, path=CIRCLE, controller={"type": "pid"})
    assert type(real) is MultirotorMission
    assert real.controller.type == "pid"
    assert Mission(vehicle=real.vehicle, path=real.path, controller=real.controller) == real
    assert Mission.model_validate({"path": LINE}) == Mission(path=LINE)


def test_lists_tuples_and_arrays_are_the_same():
    given = [
        {"end": end, "duration": duration, "type": "minimum-jerk"}
        for end, duration in (([1, 2, 3], 4), ((1.0, 2.0, 3.0), np.float32(4)), (np.array([1, 2, 3]), np.int64(4)))
    ]
    assert len({Mission(path=path).model_dump_json() for path in given}) == 1
    places = ({"t": 0.0, "position": np.zeros(3)}, {"t": 2.0, "position": (0.0, 0.0, 1.0)})
    assert len(Mission(path={"type": "waypoints", "waypoints": places}).path.waypoints) == 2


def test_files_are_looked_up_from_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text('preset = "x500"\nmass = 2.5\n')
    (tmp_path / "path.csv").write_text("t,x,y,z\n" + "".join(f"{0.1 * i},{0.1 * i},0,1\n" for i in range(30)))
    mission = Mission(vehicle={"file": Path("own.toml")}, path={"type": "recorded", "file": "path.csv"})
    assert mission.vehicle.mass == 2.5
    assert mission.plan().ticks.last > 0


def test_files_of_a_mission_that_was_read_are_looked_up_beside_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mission = read_mission(str(ROOT / "examples" / "recorded.toml"))
    assert mission.folder == ROOT / "examples"
    assert fingerprint([mission.plan()]) == fingerprint([mission.plan(ROOT / "examples")])


@pytest.mark.parametrize(("keys", "said"), [
    ({}, "path is required"),
    ({"path": {**CIRCLE, "radius": -1.0}}, "path.radius: should be greater than 0, not -1.0"),
    ({"path": {"type": "spiral"}}, "path.type: unknown value 'spiral'; allowed: minimum-jerk, waypoints, circle, "),
    ({"path": LINE, "vehicle": "x500"}, "vehicle: should be a table, not 'x500'"),
    ({"vehicle": "x500", "controller": {"type": "geometric"}}, "vehicle: should be a table, not 'x500'"),
    ({"path": LINE, "vehicle": {"preset": "y500"}}, "vehicle: unknown preset 'y500'; did you mean x500? Allowed: crazyflie, "),
    ({"path": LINE, "vehicle": {"file": "none.toml"}}, "vehicle.file: none.toml: file not found"),
    ({"path": LINE, "controller": {"type": "pid"}}, "controller.type = 'pid' needs a real vehicle, "),
    ({"path": LINE, "wind": {}}, "[wind] needs a real vehicle, but [vehicle] names none"),
    ({"path": LINE, "vehicle": {"preset": "x500"}, "disturbance": {}}, "[disturbance] needs the paper's plant, "),
    ({"path": LINE, "speed": 3}, "speed: unknown key; allowed here: controller, disturbance, "),
])  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(keys, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for build in (lambda: Mission(**keys), lambda: Mission.model_validate(keys)):
        with pytest.raises(UserError) as raised:
            build()
        assert str(raised.value).startswith(f"Mission: {said}")
        assert "\n" not in str(raised.value)


def test_what_is_no_table_of_keys_is_refused():
    with pytest.raises(UserError, match=r"^Mission: should be a table, not 3$"):
        Mission.model_validate(3)


@pytest.mark.parametrize("flown", ["paper", "real"])
def test_a_flight_is_the_log_that_an_engine_gives(flown, request):
    flight = request.getfixturevalue(flown)
    log = engines.fly(flight.plan)
    assert np.array_equal(flight.rows, log.rows)
    assert (flight.columns, flight.outcome, flight.ended) == (log.columns, log.outcome, log.ended)
    assert np.array_equal(flight.table("t", "x"), log.table("t", "x"))
    assert flight.final == log.final or str(flight.final) == str(log.final)
    copied = pickle.loads(pickle.dumps(flight))
    assert repr(copied) == repr(flight)


def test_a_flight_from_python_is_that_of_quadstep_fly_to_the_byte(real, tmp_path):
    (tmp_path / "mission.toml").write_text(TOML)
    fly_mission(tmp_path / "mission.toml", tmp_path / "fly", Engine.LANES, overwrite=False)
    real.save(tmp_path / "save")
    by_command, by_python = files(tmp_path / "fly"), files(tmp_path / "save")
    assert by_command == by_python
    assert {"flight.csv", "metrics.json", "page.html", "figures/position.png"} <= by_python.keys()


def test_results_of_another_mission_are_not_overwritten(paper, real, no_figures, tmp_path):
    paper.save(str(tmp_path))
    with pytest.raises(UserError, match="holds other results"):
        real.save(tmp_path)
    real.save(tmp_path, overwrite=True)
    assert json.loads((tmp_path / "metrics.json").read_text())["name"] == "Circle"


def test_a_metric_that_there_is_none_of_is_refused_with_those_there_are():
    with pytest.raises(KeyError, match=r"unknown metric 'position_rms\[m\]'; did you mean position_rmse\[m\]\?"):
        fly(Mission(path=LINE)).metrics()["position_rms[m]"]


def test_engines_are_named_by_text_or_member():
    mission = Mission(path={**LINE, "duration": 0.1})
    flights = [fly(mission, engine) for engine in ("lanes", "python", Engine.PYTHON)]
    assert [flight.engine for flight in flights] == [Engine.LANES, Engine.PYTHON, Engine.PYTHON]
    assert all(np.array_equal(flight.rows, flights[0].rows) for flight in flights)
    with pytest.raises(UserError, match=r"^unknown engine 'gpu'; allowed: lanes, python, c$"):
        fly(mission, "gpu")


def test_many_missions_and_plans_are_flown_in_order(paper):
    missions = [Mission(path={**LINE, "end": [float(x), 0.0, 2.0]}) for x in range(3)]
    flights = fly_all((*missions, paper.plan))
    assert [round(flight.column("x")[-1]) for flight in flights] == [0, 1, 2, 1]
    assert [flight.mission for flight in flights] == [*missions, None]
    assert fly_all([]) == []


@pytest.mark.parametrize("wrong", ["mission.toml", {"path": LINE}, None])
def test_only_missions_and_plans_fly(wrong):
    with pytest.raises(UserError, match=r"^only a Mission or its plan can be flown, not "):
        fly(wrong)


def test_metrics_are_those_of_the_file(real, no_figures, tmp_path):
    real.save(tmp_path)
    written = json.loads((tmp_path / "metrics.json").read_text())
    metrics = real.metrics()
    assert {key: written[key] for key in metrics} == metrics
    assert "largest_thrust_share" in metrics
    assert list(real.warnings) == written["warnings"]


def test_warnings_are_those_before_and_after_the_flight():
    weak = Mission(path=LINE, vehicle={"rotors": {"limits": (0.0, 2.4)}})
    flight = fly(weak)
    assert len(flight.warnings) == 3
    assert flight.warnings[:2] == weak.plan().warnings
    assert "the rotors were saturated" in flight.warnings[2]


@pytest.mark.parametrize(("preset", "names"), [(None, "learning"), ("crazyflie", "vehicle")])
def test_the_flight_of_a_plan_knows_no_mission(preset, names, tmp_path):
    flight = fly(Mission(path=LINE, **({"vehicle": {"preset": preset}} if preset else {})).plan())
    assert flight.mission is None
    assert flight.metrics() == flight_metrics(flight)
    assert flight.warnings == ()
    assert flight.figures() == ["path", "position", "attitude", "inputs", names]
    assert repr(flight).startswith("<Flight 'Flight': completed")
    with pytest.raises(UserError, match="only the flight of a mission can be saved"):
        flight.save(tmp_path)


def test_a_frame_has_every_column_by_time(paper):
    package("pandas")
    frame = paper.to_pandas()
    assert frame.index.name == "t"
    assert list(frame.columns) == [name for name in paper.columns if name != "t"]
    assert np.array_equal(frame["theta"].to_numpy(), paper.column("theta"))
    assert np.array_equal(frame.index.to_numpy(), paper.column("t"))
    assert frame.attrs["units"]["theta"] == "rad"
    frame.loc[:, "x"] = 7.0
    assert paper.column("x")[0] == 0.0


def test_without_pandas_it_is_said_what_to_install(paper, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(UserError, match=r"^Flight.to_pandas\(\) needs pandas; install it: .* -m pip install .*pandas"):
        paper.to_pandas()


@pytest.mark.parametrize("flown", ["paper", pytest.param("real", marks=pytest.mark.thorough)])
def test_figures_are_those_of_quadstep_fly(flown, request, tmp_path):
    from matplotlib import rc_context
    from matplotlib.image import imread

    flight = request.getfixturevalue(flown)
    flight.save(tmp_path / "out")
    for name in flight.figures():
        figure = flight.plot(name)
        with rc_context({"grid.color": "red", "axes.grid": False, "lines.linewidth": 9.0}):  # settings of the user's own
            figure.savefig(tmp_path / "own.png")
        assert np.array_equal(imread(tmp_path / "own.png"), imread(tmp_path / "out" / "figures" / f"{name}.png")), name


def test_an_unknown_figure_is_refused_by_name(paper):
    with pytest.raises(UserError, match=r"^unknown figure 'speed'; allowed: path, position, attitude, inputs, learning$"):
        paper.plot("speed")


def test_drawing_leaves_the_settings_of_matplotlib_alone():
    code = """
import matplotlib
from quadstep import Mission, fly
before = list(dict.items(matplotlib.rcParams))  # reading them one by one would choose a backend
flight = fly(Mission(path={"type": "minimum-jerk", "end": [0.1, 0.0, 0.0], "duration": 0.1}), "python")
flight.plot()
flight._repr_html_()
import sys
print(list(dict.items(matplotlib.rcParams)) == before, "matplotlib.pyplot" in sys.modules)
"""
    assert in_a_new_process(code) == ["True", "False"]


def test_importing_the_package_loads_nothing_heavy():
    code = """
import sys
import quadstep
print(*sorted(name for name in sys.modules if name.startswith("quadstep.") or "." not in name))
assert "fly" in dir(quadstep) and "Mission" in dir(quadstep)
"""
    loaded = set(in_a_new_process(code))
    assert not {"numpy", "pydantic", "llvmlite", "matplotlib", "pandas", "typer", "rich"} & loaded
    assert {name for name in loaded if name.startswith("quadstep.")} <= {"quadstep.io"}
    flown = in_a_new_process("import sys, quadstep; quadstep.fly, quadstep.Mission; print(*sys.modules)")
    assert not {"matplotlib", "pandas", "llvmlite", "typer", "rich"} & set(flown)


def test_every_public_name_is_there_and_says_what_it_is():
    import quadstep

    for name in quadstep.__all__:
        assert getattr(quadstep, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'flyy'"):
        quadstep.flyy  # noqa: B018


def test_it_is_shown_in_a_line_and_in_a_notebook(paper):
    assert repr(paper) == "<Flight 'Line': completed 2 s, position RMSE 4.77 mm, 201 rows>"
    shown = paper._repr_html_().replace("\N{NO-BREAK SPACE}", " ")
    for said in ("Line", "Completed 2 s; position RMSE 4.77 mm.", "largest tilt", "x [mm]", "data:image/png;base64,"):
        assert said in shown
    assert len(shown) < 200_000


def test_names_are_escaped_in_a_notebook():
    shown = fly(Mission(name="<script>alert(1)</script>", path={**LINE, "duration": 0.1}))._repr_html_()
    assert "<script" not in shown


def test_a_flight_that_ends_at_once_is_an_outcome_like_any_other():
    lost = fly(Mission(path=LINE, start={"position": (500.0, 0.0, 0.0)}))
    assert isinstance(lost, Flight)
    assert len(lost.rows) < 2
    assert lost.metrics() == {"outcome": "off_path", "ended[s]": 0.0}
    assert repr(lost) == "<Flight 'Flight': lost (off_path) at 0 s, 0 rows>"
    assert lost.figures() == []
    assert "Lost at 0\N{NO-BREAK SPACE}s" in lost._repr_html_()
    with pytest.raises(UserError, match="ended before its second row"):
        lost.plot()


CORE = """
import sys
from quadstep.io.doors import EXTRAS
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name in EXTRAS:
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Absent())
import quadstep.studies.class_server, quadstep.studies.lessons, quadstep.studies.fly
"""


def test_check_serve_and_fly_need_no_extra():
    ran = subprocess.run([sys.executable, "-c", CORE], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr


BROWSER = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name in ("llvmlite", "multiprocessing.forkserver", "resource"):
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Absent())
from quadstep import Mission, UserError, fly
mission = Mission(path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 0.1})
flight = fly(mission, engine="python")
print(flight.ended, flight.column("x")[-1].hex())
from quadstep.page.laws import Laws
laws = Laws()
laws.add(mission.plan(), quick=True)
print(list(laws.laws), laws.modules)
for use in (lambda: fly(mission), lambda: flight.save("nowhere")):
    try:
        use()
    except UserError as error:
        print(error)
"""


def test_without_a_compiler_and_processes_as_in_a_browser_python_flies():
    ran = subprocess.run([sys.executable, "-c", BROWSER], capture_output=True, text=True, check=True)
    log = fly(Mission(path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 0.1}))
    flown, paged, lanes, saved = ran.stdout.splitlines()
    assert flown == f"0.1 {log.column('x')[-1].hex()}"
    assert paged == "['law0'] {'law0': ''}"
    assert lanes == "engine 'lanes' needs llvmlite, which this Python does not have; engine 'python' works without it"
    assert saved.startswith("could not start a process to draw figures")
