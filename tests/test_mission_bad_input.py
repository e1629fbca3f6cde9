"""Every kind of bad mission is refused with one line that names the file, the key, and what is allowed."""

import json
import pickle
import re
import traceback

import pytest

from quadstep import UserError, read_mission
from tests.commands import quadstep, write
from tests.missions import refusal, refusals

LINE = '[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 0.0]\nduration = 1.0\n'
WAYPOINTS = '[path]\ntype = "waypoints"\nwaypoints = [{times}]\n'
BACKSTEPPING = LINE + '[controller]\ntype = "backstepping"\n'
NESTED = LINE + '[controller]\ntype = "nested-saturation"\n'


def waypoints(*times: float) -> str:
    return WAYPOINTS.format(times=", ".join(f"{{ t = {t}, position = [{i}.0, 0.0, 0.0] }}" for i, t in enumerate(times)))


CASES = {
    "unit in a text": (
        '[path]\ntype = "circle"\nradius = "5 m"\nperiod = 9.0\n',
        "should be a number in m, not '5 m'",
    ),
    "misspelt key": (LINE + "[vehicle]\nmas = 1.0\n", "; did you mean mass?"),
    "misspelt radius": (
        '[path]\ntype = "circle"\nradus = 1.0\nperiod = 9.0\n',
        "path.radus: unknown key; did you mean radius? Allowed here: ",
    ),
    "misspelt vehicle of a mission with wind": (
        LINE + '[vehicl]\npreset = "x500"\n[wind]\nmean = [1.0, 0.0, 0.0]\n',
        ": vehicl: unknown key; did you mean vehicle? Allowed here: ",
    ),
    "misspelt preset of a mission with wind": (
        LINE + '[vehicle]\nprset = "x500"\n[wind]\nmean = [1.0, 0.0, 0.0]\n',
        ": vehicle.prset: unknown key; did you mean preset? Allowed here: ",
    ),
    "unknown section": (LINE + "[vehicel]\nmass = 1.0\n", "vehicel", "unknown", "Allowed", "vehicle"),
    "unknown key": (LINE + "[vehicle]\nmas = 1.0\n", "vehicle.mas", "unknown", "mass"),
    "unknown key of the path": (LINE + "speed = 1.0\n", "path.speed", "unknown", "duration"),
    "unknown key of the nets": (BACKSTEPPING + "nets.nuerons = 8\n", "controller.nets.nuerons", "neurons"),
    "unknown key of a waypoint": (
        WAYPOINTS.format(times="{ t = 0.0, place = [0, 0, 0], position = [0, 0, 0] }, { t = 1.0, position = [1, 0, 0] }"),
        "path.waypoints[0].place",
        "position",
    ),
    "unknown key of the columns": (
        '[path]\ntype = "recorded"\nfile = "p.csv"\ncolumns = { time = "t" }\n',
        "path.columns.time",
        "psi",
    ),
    "key of the other controller": (NESTED + "K_r1 = 3.0\n", "controller.K_r1", "a_z"),
    "no path": ('name = "nothing"\n', "path", "is required"),
    "empty file": ("", "path", "is required"),
    "path without a type": ("[path]\nend = [1.0, 0.0, 0.0]\n", "path.type", "minimum-jerk", "recorded"),
    "unknown path": ('[path]\ntype = "spiral"\n', "path.type", "spiral", "figure-eight"),
    "controller without a type": (LINE + "[controller]\nK_r1 = 3.0\n", "controller.type", "backstepping"),
    "unknown controller": (LINE + '[controller]\ntype = "smc"\n', "controller.type", "smc", "nested-saturation"),
    "controller without its vehicle": (
        LINE + '[controller]\ntype = "lqr"\n',
        "controller.type = 'lqr' needs a real vehicle",
        "[vehicle]",
        'preset = "x500"',
    ),
    "wind without a vehicle": (LINE + "[wind]\nmean = [1.0, 0.0, 0.0]\n", "[wind] needs a real vehicle", "[vehicle]"),
    "type is a list": ("[path]\ntype = [1]\n", "path.type", "minimum-jerk"),
    "path is a number": ("path = 3\n", "path", "3"),
    "vehicle is a list": ("vehicle = [1]\n" + LINE, "vehicle", "[1]"),
    "path without an end": ('[path]\ntype = "minimum-jerk"\nduration = 1.0\n', "path.end", "is required"),
    "number as text": (LINE + '[vehicle]\nmass = "1.0"\n', "vehicle.mass", "number", "'1.0'"),
    "number as bool": (LINE + "[vehicle]\nmass = true\n", "vehicle.mass", "number", "True"),
    "gain as bool": (BACKSTEPPING + "K_r1 = true\n", "controller.K_r1", "True"),
    "gain as text": (BACKSTEPPING + 'K_r1 = "3"\n', "controller.K_r1", "'3'"),
    "entry as bool": (LINE + "[start]\nposition = [0.0, true, 0.0]\n", "start.position[1]", "number"),
    "text as number": ("name = 3\n" + LINE, "name", "should be text", "3"),
    "bool as number": (BACKSTEPPING + "nets.enabled = 1\n", "controller.nets.enabled", "should be true or false"),
    "bool as text": (
        '[path]\ntype = "circle"\nradius = 1.0\nperiod = 9.0\nclockwise = "no"\n',
        "path.clockwise",
        "true or false",
    ),
    "whole number as float": (BACKSTEPPING + "nets.neurons = 8.5\n", "controller.nets.neurons", "a whole number"),
    "date as number": (LINE + "[vehicle]\nmass = 2020-01-01\n", "vehicle.mass", "number"),
    "list as number": (LINE + "[vehicle]\nmass = [1.0]\n", "vehicle.mass", "number"),
    "name too long": (f'name = "{"x" * 201}"\n' + LINE, "name", "200"),
    "nan": (LINE + "[vehicle]\nmass = nan\n", "vehicle.mass", "finite", "nan"),
    "inf": (LINE + "[vehicle]\ngravity = inf\n", "vehicle.gravity", "finite", "inf"),
    "nan entry": (LINE + "[start]\nvelocity = [0.0, nan, 0.0]\n", "start.velocity[1]", "finite"),
    "nan limit": (LINE + "[limits]\npitch = nan\n", "limits.pitch", "nan"),
    "infinite disturbance": (LINE + "[disturbance]\nforce = [inf, 0.0, 0.0]\n", "disturbance.force[0]", "finite"),
    "endless path": ('[path]\ntype = "minimum-jerk"\nend = [1, 0, 0]\nduration = inf\n', "path.duration", "finite"),
    "mass zero": (LINE + "[vehicle]\nmass = 0.0\n", "vehicle.mass", "greater than 0"),
    "mass negative": (LINE + "[vehicle]\nmass = -1.0\n", "vehicle.mass", "greater than 0", "-1"),
    "controller's mass zero": (BACKSTEPPING + "mass = 0\n", "controller.mass", "greater than 0"),
    "gravity zero": (LINE + "[vehicle]\ngravity = 0\n", "vehicle.gravity", "greater than 0"),
    "inertia zero": (LINE + "[vehicle]\ninertia = [0.0, 5.0, 5.0]\n", "vehicle.inertia", "greater than 0"),
    "inertia negative": (LINE + "[vehicle]\ninertia = -5.0\n", "vehicle.inertia", "greater than 0"),
    "triangle inequality, first": (LINE + "[vehicle]\ninertia = [3.0, 1.0, 1.5]\n", "vehicle", "inertia", "triangle", "2.5"),
    "triangle inequality, last": (LINE + "[vehicle]\ninertia = [1.0, 1.0, 2.1]\n", "vehicle", "inertia", "triangle", "2.1"),
    "kinematics": (LINE + '[vehicle]\nkinematics = "quaternion"\n', "vehicle.kinematics", "standard", "printed"),
    "position too short": (LINE + "[start]\nposition = [1.0, 2.0]\n", "start.position"),
    "position too long": (LINE + "[start]\nposition = [1.0, 2.0, 3.0, 4.0]\n", "start.position", "3"),
    "position a number": (LINE + "[start]\nposition = 1.0\n", "start.position", "list"),
    "inertia too short": (LINE + "[vehicle]\ninertia = [5.0]\n", "vehicle.inertia"),
    "gain too short": (BACKSTEPPING + "Lambda2 = [15.0, 15.0]\n", "controller.Lambda2"),
    "gain empty": (BACKSTEPPING + "K_r2 = []\n", "controller.K_r2"),
    "nested bounds too short": (NESTED + "bounds = [2.0, 1.0, 0.2]\n", "controller.bounds"),
    "nested gains too long": (NESTED + "a_z = [3.0, 0.5, 0.1]\n", "controller.a_z", "2"),
    "gain zero": (BACKSTEPPING + "K_r1 = [3.0, 0.0, 3.0]\n", "controller.K_r1", "greater than 0"),
    "integral gain negative": (BACKSTEPPING + "K_i1 = -0.1\n", "controller.K_i1", "zero or more"),
    "filter zero": (BACKSTEPPING + "filter_frequency = 0\n", "controller.filter_frequency", "greater than 0"),
    "no neurons": (BACKSTEPPING + "nets.neurons = 0\n", "controller.nets.neurons", "1"),
    "too many neurons": (BACKSTEPPING + "nets.neurons = 65\n", "controller.nets.neurons", "64"),
    "seed negative": (BACKSTEPPING + "nets.seed = -1\n", "controller.nets.seed", "0"),
    "seed too large": (BACKSTEPPING + f"nets.seed = {2**63}\n", "controller.nets.seed", "2^63"),
    "learning rate negative": (BACKSTEPPING + "nets.F1 = -5.0\n", "controller.nets.F1", "0"),
    "learning before the flight": (BACKSTEPPING + "nets.start = -1.0\n", "controller.nets.start", "0"),
    "rotor limits reversed": (
        LINE + "[vehicle]\nrotors.limits = [8.0, 2.0]\n",
        "vehicle.rotors",
        "limits",
        "smallest, largest",
    ),
    "rotor limits equal": (LINE + "[vehicle]\nrotors.limits = [2.0, 2.0]\n", "vehicle.rotors", "limits", "smallest, largest"),
    "rotor limit negative": (LINE + "[vehicle]\nrotors.limits = [-1.0, 8.0]\n", "vehicle.rotors.limits[0]", "0"),
    "one rotor limit": (LINE + "[vehicle]\nrotors.limits = [8.0]\n", "vehicle.rotors.limits"),
    "rotor arm zero": (LINE + "[vehicle]\nrotors.arm = 0.0\n", "vehicle.rotors.arm", "greater than 0"),
    "start at 90 deg": (LINE + "[start]\nattitude = [0.0, 1.5707963267948966, 0.0]\n", "start", "theta", "pi/2"),
    "start beyond -90 deg": (LINE + "[start]\nattitude = [0.0, -2.0, 0.0]\n", "start", "theta", "pi/2", "-2"),
    "pitch limit at 90 deg": (LINE + "[limits]\npitch = 1.5707963267948966\n", "limits.pitch", "less than"),
    "distance limit zero": (LINE + "[limits]\ndistance = 0\n", "limits.distance", "greater than 0"),
    "one waypoint": (waypoints(0.0), "path.waypoints", "2"),
    "no waypoints": ('[path]\ntype = "waypoints"\nwaypoints = []\n', "path.waypoints", "2"),
    "waypoints a number": ('[path]\ntype = "waypoints"\nwaypoints = 3\n', "path.waypoints", "list"),
    "waypoint a number": ('[path]\ntype = "waypoints"\nwaypoints = [1, 2]\n', "path.waypoints[0]"),
    "waypoints too many": (waypoints(*range(201)), "path.waypoints", "200"),
    "waypoints not from zero": (waypoints(1.0, 2.0), "path", "t = 0", "1"),
    "waypoints repeat": (waypoints(0.0, 2.0, 2.0), "path", "times of waypoints must increase", "2"),
    "waypoints go back": (waypoints(0.0, 2.0, 1.0), "path", "times of waypoints must increase", "2 is followed by 1"),
    "waypoint before zero": (waypoints(-1.0, 2.0), "path.waypoints[0].t", "0"),
    "waypoint without a place": (
        WAYPOINTS.format(times="{ t = 0.0 }, { t = 1.0 }"),
        "path.waypoints[0].position",
        "is required",
    ),
    "circle without a radius": ('[path]\ntype = "circle"\nperiod = 9.0\n', "path.radius", "is required"),
    "circle of no size": ('[path]\ntype = "circle"\nradius = 0.0\nperiod = 9.0\n', "path.radius", "greater than 0"),
    "circle with a negative ramp": ('[path]\ntype = "circle"\nradius = 1.0\nperiod = 9.0\nramp = -1.0\n', "path.ramp", "0"),
    "figure eight in no plane": (
        '[path]\ntype = "figure-eight"\nlength = 1.0\nwidth = 1.0\nperiod = 9.0\nplane = "tilted"\n',
        "path.plane",
        "horizontal",
        "vertical",
    ),
    "duration zero": (LINE.replace("duration = 1.0", "duration = 0.0"), "path.duration", "greater than 0"),
    "smoothing too small": ('[path]\ntype = "recorded"\nfile = "p.csv"\nsmoothing = 0.001\n', "path.smoothing", "0.01"),
    "unit of psi": ('[path]\ntype = "recorded"\nfile = "p.csv"\npsi_unit = "turns"\n', "path.psi_unit", "rad", "deg"),
    "recording without a name": ('[path]\ntype = "recorded"\nfile = ""\n', "path.file", "1"),
    "step zero": (LINE + "[simulation]\nstep = 0.0\n", "simulation.step", "greater than 0"),
    "control period no multiple": (
        LINE + "[simulation]\ncontrol_period = 0.003\n",
        "simulation",
        "control_period",
        "multiple",
    ),
    "control period below a step": (
        LINE + "[simulation]\nstep = 0.01\ncontrol_period = 0.004\n",
        "simulation",
        "control_period",
        "multiple",
        "0.01",
    ),
    "periods no multiple": (
        LINE + "[simulation]\nlog_period = 0.011\ncontrol_period = 0.003\n",
        "simulation",
        "log_period = 0.011 s and control_period = 0.003 s must be whole multiples of step = 0.002 s",
    ),
    "log period no multiple": (LINE + "[simulation]\nlog_period = 0.011\n", "simulation", "log_period", "multiple"),
    "duration below one row": (LINE + "[simulation]\nduration = 0.001\n", "simulation.duration", "allowed", "1"),
    "duration above the rows": (LINE + "[simulation]\nduration = 1e6\n", "simulation.duration", "allowed", "500000"),
    "duration above the steps": (
        LINE + "[simulation]\nduration = 1e6\nlog_period = 100.0\n",
        "simulation.duration",
        "allowed",
        "200000000",
    ),
    "not TOML": ("[path\n", "not valid TOML", "line 1", "the line: [path"),
    "not TOML's true": (LINE + "reversed = True\n", "not valid TOML", "line 5", "the line: reversed = True"),
    "table given twice": (LINE + LINE, "not valid TOML: Cannot declare path twice"),
    "key given twice": (LINE + "duration = 2.0\n", "not valid TOML", "line 5"),
    "not UTF-8": (b"name = '\xff\xfe'\n", "UTF-8"),
    "binary junk": (bytes(range(256)), "UTF-8"),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_named_by_file_key_and_what_is_allowed(tmp_path, case):
    content, *needed = CASES[case]
    message = refusal(tmp_path, content)
    for part in needed:
        assert part in message


LIMITS_OF_ARITHMETIC = {
    "step": LINE + "[simulation]\nstep = 1e-320\n",
    "control period": LINE + "[simulation]\ncontrol_period = 1e300\n",
    "path duration": LINE.replace("duration = 1.0", "duration = 1e-200") + "[simulation]\nduration = 1.0\n",
    "ramp": '[path]\ntype = "circle"\nradius = 1.0\nperiod = 9.0\nramp = 1e-200\n[simulation]\nduration = 1.0\n',
    "mass": LINE + f"[vehicle]\nmass = {10**400}\n",
    "gain": BACKSTEPPING + f"Lambda1 = {10**400}\n",
    "digits": LINE + f"[vehicle]\nmass = {'1' * 5000}\n",
    "nested lists": LINE + "[vehicle]\nmass = " + "[" * 5000,
    "file name with a zero byte": '[path]\ntype = "recorded"\nfile = "a\\u0000b.csv"\n',
}


@pytest.mark.parametrize("case", LIMITS_OF_ARITHMETIC)
def test_numbers_and_texts_beyond_what_a_computer_holds_are_refused_too(tmp_path, case):
    refusal(tmp_path, LIMITS_OF_ARITHMETIC[case])


def test_a_key_with_a_line_break_still_gives_one_line(tmp_path):
    assert "unknown" in refusal(tmp_path, '"a\\nb" = 1\n' + LINE)


WRONG = (
    LINE + "[vehicle]\nmass = -1.0\ngravity = 0.0\ncolour = 1\n[controller]\ntype = 'backstepping'\nK_r1 = nan\nK_r3 = 1.0\n"
)


def test_each_of_several_mistakes_is_a_line_and_unknown_keys_come_first(tmp_path):
    lines = refusals(tmp_path, WRONG)
    assert [re.match(": (.*?): ", line)[1] for line in lines] == [
        "vehicle.colour", "controller.K_r3", "vehicle.mass", "vehicle.gravity", "controller.K_r1[0]",
    ]  # fmt: skip
    assert lines[2:4] == [
        ": vehicle.mass: should be greater than 0, not -1.0 kg", ": vehicle.gravity: should be greater than 0, not 0.0 m/s^2",
    ]  # fmt: skip


def test_the_command_line_prints_each_mistake_and_python_too(tmp_path):
    path = write(tmp_path, WRONG)
    run = quadstep("fly", path)
    said = run.err.splitlines()
    assert (run.code, run.out) == (2, "")
    assert len(said) == 5
    assert all(line.startswith(f"quadstep: error: {path}: ") for line in said)
    with pytest.raises(UserError) as raised:
        read_mission(path)
    text = "".join(traceback.format_exception_only(raised.value))
    assert [line.removeprefix("quadstep: error: ") for line in said] == text.removeprefix(
        "quadstep.io.errors.UserError: "
    ).splitlines()
    assert pickle.loads(pickle.dumps(raised.value)).lines == raised.value.lines


def test_of_very_many_mistakes_ten_are_named(tmp_path):
    lines = refusals(tmp_path, LINE + "".join(f"strange{i} = 1\n" for i in range(14)))
    assert len(lines) == 11
    assert lines[-1] == ": and 4 more"


def test_a_misspelt_key_is_one_mistake_and_not_a_missing_key_besides(tmp_path):
    lines = refusals(tmp_path, '[path]\ntype = "circle"\nradus = 1.0\n')
    assert [line.split(": ")[1] for line in lines] == ["path.radus", "path.period is required"]
    assert [line.split(": ")[1] for line in refusals(tmp_path, "[pth]\n")] == ["pth"]


def test_a_very_long_value_is_cut(tmp_path):
    assert len(refusal(tmp_path, LINE + f'[vehicle]\nmass = "{"x" * 5000}"\n')) < 300


def test_a_missing_mission_file_is_named(tmp_path):
    with pytest.raises(UserError, match=r"nowhere\.toml: file not found"):
        read_mission(tmp_path / "nowhere.toml")
    (tmp_path / "log.csv").write_text("t,x\n0,1\n")
    with pytest.raises(UserError, match=r"log\.csv: a TOML file is needed, not one that ends in \.csv$"):
        read_mission(tmp_path / "log.csv")


def test_a_folder_is_no_mission(tmp_path):
    with pytest.raises(UserError, match=rf"^{re.escape(str(tmp_path))}: cannot be read: it is a folder; a TOML file must be"):
        read_mission(tmp_path)


WEIGHTS = {"neurons": 2, "seed": 7, "W1": [[0.1, 0.2, 0.3]] * 2, "W2": [[0.0, 0.0, 1.0]] * 2}
WARM = BACKSTEPPING + 'nets.neurons = 2\nnets.seed = 7\nnets.weights = "w.json"\n'

BAD_WEIGHTS = {
    "missing entry": {key: value for key, value in WEIGHTS.items() if key != "W2"},
    "extra entry": {**WEIGHTS, "W3": []},
    "too few rows": {**WEIGHTS, "W1": [[0.1, 0.2, 0.3]]},
    "too short a row": {**WEIGHTS, "W2": [[0.1, 0.2], [0.1, 0.2]]},
    "text": {**WEIGHTS, "W1": [["a", "b", "c"]] * 2},
    "a list": [1, 2],
    "nan": {**WEIGHTS, "W1": [[float("nan"), 0.2, 0.3]] * 2},
}


@pytest.mark.parametrize("case", BAD_WEIGHTS)
def test_weights_of_the_wrong_form_are_refused(tmp_path, case):
    (tmp_path / "w.json").write_text(json.dumps(BAD_WEIGHTS[case]), encoding="utf-8")
    message = refusal(tmp_path, WARM)
    assert "w.json" in message
    assert ("NaN is not a number" if case == "nan" else "neurons x 3") in message


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe\x00", b"null", b"[" * 100_000])
def test_a_weights_file_that_is_no_json_is_refused(tmp_path, content):
    (tmp_path / "w.json").write_bytes(content)
    assert "w.json" in refusal(tmp_path, WARM)


@pytest.mark.parametrize("changed", [{"seed": 8}, {"neurons": 3, "W1": [[0.0] * 3] * 3, "W2": [[0.0] * 3] * 3}])
def test_weights_of_other_nets_are_refused(tmp_path, changed):
    (tmp_path / "w.json").write_text(json.dumps({**WEIGHTS, **changed}), encoding="utf-8")
    message = refusal(tmp_path, WARM)
    assert "w.json" in message
    assert "neurons = 2, seed = 7" in message


def test_missing_weights_and_a_folder_for_weights_are_refused(tmp_path):
    assert "w.json: file not found" in refusal(tmp_path, WARM)
    (tmp_path / "w.json").mkdir()
    assert "it is a folder" in refusal(tmp_path, WARM)
