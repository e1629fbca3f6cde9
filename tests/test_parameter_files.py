"""Files of an autopilot's parameters: what is read, what is refused in one line, what a mission makes of them, and back."""

import tomllib
from functools import partial

import pytest

from quadstep import Mission, fly
from quadstep.control.registry import STOCK, controller
from quadstep.interfaces.controller import Measured
from quadstep.io.errors import UserError
from quadstep.io.parameter_files import ArduPilotParm, CrazyflieYaml, QgcParams
from quadstep.mission.data_files import under
from quadstep.mission.read import check_mission
from quadstep.studies.flight_report import write_report
from quadstep.studies.tuning.run import tune
from tests.needs import package

yaml = package("yaml")

SAVED = """params:
  pid_attitude.yawMaxDelta:
    default_value: 0.0
    is_stored: true
    stored_value: 30.0
  pid_rate.roll_kp:
    default_value: 250.0
    is_stored: true
    stored_value: 200.0
  posCtlPid.thrustBase:
    default_value: 36000
    is_stored: false
    stored_value: null
  sound.effect:
    default_value: 0
    is_stored: true
    stored_value: 3
type: persistent_param_state
version: '1'
"""

TUNED = """
vehicle.preset = "crazyflie"
path = { type = "step", start = [0.0, 0.0, 1.0], end = [0.5, 0.0, 1.0], time = 0.1, duration = 2.0 }
controller = { type = "crazyflie-pid", parameters = "saved.yaml" }
tune.gains = { "controller.posCtlPid.xKp" = {} }
"""

HOVER = {"type": "step", "end": [0.0, 0.0, 1.0], "time": 0.1, "duration": 0.5}


def mission(folder, text, file="saved.yaml", law="crazyflie-pid", vehicle="crazyflie", **keys):
    (folder / file).write_text(text)
    controller = {"type": law, "parameters": file, **keys}
    return check_mission({"vehicle": {"preset": vehicle}, "path": HOVER, "controller": controller}, "m.toml", folder)


px4 = partial(mission, file="saved.params", law="px4-cascade", vehicle="x500")


def test_what_cfclient_saves_is_read_as_yaml_reads_it():
    found, other = CrazyflieYaml.read(SAVED), yaml.safe_load(SAVED)["params"]
    assert found.defaults == {name: one["default_value"] for name, one in other.items()}
    assert found.values == {name: one["stored_value" if one["is_stored"] else "default_value"] for name, one in other.items()}


def test_what_is_written_is_read_again_and_is_yaml():
    values, defaults = {"pid_rate.roll_kp": 212.5, "ctrlMel.kp_z": 1.5}, {"pid_rate.roll_kp": 250.0, "ctrlMel.kp_z": 1.25}
    text = CrazyflieYaml.write(values, defaults)
    assert CrazyflieYaml.read(text)[:3] == (values, defaults, "")
    assert yaml.safe_load(text)["params"]["ctrlMel.kp_z"] == {"default_value": 1.25, "is_stored": True, "stored_value": 1.5}
    assert CrazyflieYaml.read(CrazyflieYaml.write({}, {})).values == {}


WRONG = {
    "another kind": (SAVED.replace("persistent_param_state", "x"), "is not a parameter file of cfclient"),
    "another version": (SAVED.replace("'1'", "'2'"), "has version '2'; only version 1 is supported"),
    "no version": (SAVED.replace("version: '1'\n", ""), "has version 'none'"),
    "twice": (SAVED.replace("sound.effect", "pid_rate.roll_kp"), "line 14: pid_rate.roll_kp is given twice"),
    "no number": (SAVED.replace("200.0", "much"), "pid_rate.roll_kp: stored_value should be a number, not 'much'"),
    "no value": (SAVED.replace("    stored_value: 200.0\n", ""), "pid_rate.roll_kp: stored_value should be a number, not ''"),
    "neither": (SAVED.replace("is_stored: false", "is_stored: maybe"), "thrustBase: is_stored should be true or false"),
    "a list": ("- 1\n", "line 1 is not from a parameter file of cfclient: '- 1'"),
    "empty": ("", "is not a parameter file of cfclient"),
    "unknown": (SAVED.replace("roll_kp", "rol_kp"),
        "not a parameter of Crazyflie firmware 2026.08; did you mean pid_rate.roll_kp?"),
    "out of range": (SAVED.replace("200.0", "-1.0"), "controller.pid_rate.roll_kp: should be greater than or equal to 0"),
}  # fmt: skip


def test_a_missing_file_is_named(tmp_path):
    controller = {"type": "crazyflie-pid", "parameters": "none.yaml"}
    with pytest.raises(UserError, match=r"controller.parameters: .*none.yaml"):
        check_mission({"vehicle": {"preset": "crazyflie"}, "path": HOVER, "controller": controller}, "m.toml", tmp_path)


def test_a_mission_flies_with_what_the_file_says_and_its_own_keys_go_before_it(tmp_path):
    read = mission(tmp_path, SAVED)
    gains = read.plan(warn=False).parameters.gains
    assert (gains.rates.roll_kp, gains.rates.pitch_kp, gains.position.hover) == (200.0, 250.0, 36000.0)
    own = mission(tmp_path, SAVED, pid_rate={"roll_kp": 190.0})
    assert own.plan(warn=False).parameters.gains.rates.roll_kp == 190.0
    again = Mission.model_validate(own.model_dump(exclude_unset=True))  # without the file
    assert again.controller.pid_rate.roll_kp == 190.0


def test_what_is_not_modelled_is_listed_and_other_defaults_are_told(tmp_path):
    vehicle = mission(tmp_path, SAVED).modelled
    said = mission(tmp_path, SAVED).controller.warnings(vehicle)
    assert said == ["saved.yaml: crazyflie-pid does not use pid_attitude.yawMaxDelta, sound.effect"]
    other = mission(tmp_path, SAVED.replace("default_value: 250.0", "default_value: 70.0")).controller.warnings(vehicle)
    assert other[1].endswith("firmware 2026.08: it has other defaults for pid_rate.roll_kp")


def test_dotted_keys_are_tables_of_toml():
    text = '[controller]\ntype = "crazyflie-pid"\npid_rate.roll_kp = 210.0\n[controller.posCtlPid]\nxKp = 1.5\n'
    content = {"vehicle": {"preset": "crazyflie"}, "path": HOVER, **tomllib.loads(text)}
    section = check_mission(content, "m.toml").controller
    assert (section.pid_rate.roll_kp, section.posCtlPid.xKp) == (210.0, 1.5)
    content["controller"]["pid_rate"] = {"rol_kp": 1.0}
    with pytest.raises(UserError, match=r"controller.pid_rate.rol_kp: unknown key; did you mean roll_kp\?"):
        check_mission(content, "m.toml")


def test_tuning_writes_the_parameters_that_it_changed_and_no_others(tmp_path):
    (tmp_path / "m.toml").write_text(TUNED)
    (tmp_path / "saved.yaml").write_text(SAVED)
    done = tune(tmp_path / "m.toml", 60, tmp_path / "out")
    wrote = CrazyflieYaml.read((tmp_path / "out" / "tuned.yaml").read_text())
    assert wrote.values == {"posCtlPid.xKp": done.values["controller.posCtlPid.xKp"]} != {"posCtlPid.xKp": 2.0}
    assert wrote.defaults == {"posCtlPid.xKp": 2.0}


QGC = """# Onboard parameters for Vehicle 1
#
# Vehicle-Id\tComponent-Id\tName\tValue\tType
1\t1\tCA_AIRFRAME\t0\t6
1\t1\tMC_AIRMODE\t1\t6
1\t1\tMC_ROLLRATE_P\t0.140000000596046448\t9
1\t1\tMPC_LAND_SPEED\t0.700000000000000000\t9
"""


def test_a_mission_flies_with_what_qgroundcontrol_saved(tmp_path):
    read = px4(tmp_path, QGC)
    rates = read.plan(warn=False).parameters.gains.rates
    assert (rates.airmode, rates.pitch_p) == (1.0, 0.15)
    assert rates.roll_p == pytest.approx(0.14)
    assert px4(tmp_path, QGC, MC_ROLLRATE_P=0.2).plan(warn=False).parameters.gains.rates.roll_p == 0.2
    assert read.controller.warnings(read.modelled) == ["saved.params: px4-cascade does not use MPC_LAND_SPEED"]


def test_a_whole_file_is_a_short_warning_and_a_list_in_the_report(tmp_path):
    header = "# Onboard parameters for Vehicle 1\n#\n# Stack: PX4 Pro\n# Vehicle: Multi-Rotor\n# Version: 1.14.3 \n"
    others = "".join(f"1\t1\tNAV_{i:03}\t1\t9\n" for i in range(1000)) + "1\t154\tMNT_RC\t1\t2\n"  # the last: a gimbal's
    read = px4(tmp_path, header + QGC + others)
    assert read.controller.warnings(read.modelled) == [
        "saved.params: is from version 1.14; px4-cascade is PX4 v1.15's",
        "saved.params: px4-cascade does not use 1001 of 1004 parameters: MPC_LAND_SPEED, NAV_000, NAV_001, NAV_002, NAV_003 "
        "and 996 more",
    ]
    assert len(read.controller.left) == 1001
    file = tmp_path / "report.html"
    write_report(file, read, fly(read), {}, (), {})
    assert "1001 parameters of its file that px4-cascade does not use" in file.read_text()
    assert "NAV_999" in file.read_text()


WRONG_QGC = {
    "of ArduPilot": ("ATC_RAT_RLL_P 0.1\n", "line 1 is not from a parameter file of QGroundControl: 'ATC_RAT_RLL_P 0.1'"),
    "a mission": ('{\n    "fileType": "Plan"\n}\n', "QGroundControl: '{'; save one there: Vehicle Configuration, Parameters"),
    "another vehicle's": (
        "1\t1\tFW_RR_P\t0.05\t9\n",
        "has none of PX4 v1.15's parameters that px4-cascade uses, such as MC_ROLLRATE_P; save those of a multirotor",
    ),
    "another type": (QGC.replace("\t9\n", "\tfloat\n"), "line 6 is not from a parameter file of QGroundControl"),
    "twice": (QGC + "1\t1\tMC_AIRMODE\t0\t6\n", "line 8: MC_AIRMODE is given twice"),
    "no number": (QGC.replace("0.140000000596046448", "nan"), "line 6: MC_ROLLRATE_P should be a number, not 'nan'"),
    "by its name": (QGC.replace("Onboard", "Stack: ArduPilot\n# Onboard"), "has parameters of ArduPilot, not of PX4"),
    "from another release": (
        QGC + "1\t1\tIMU_GYRO_NF_FREQ\t80\t9\n",
        "IMU_GYRO_NF_FREQ is from another release; PX4 v1.15 calls it IMU_GYRO_NF0_FRQ",
    ),
    "a choice": (QGC.replace("MC_AIRMODE\t1", "MC_AIRMODE\t3"), "controller.MC_AIRMODE: should be less than or equal to 2"),
    "empty": ("# Stack: PX4 Pro\n", "is not a parameter file of QGroundControl: it has no parameters"),
    "a frame": (QGC.replace("CA_AIRFRAME\t0", "CA_AIRFRAME\t2"), "CA_AIRFRAME is 2, and px4-cascade flies only 0"),
    "out of range": (QGC.replace("MC_ROLLRATE_P\t0", "MC_ROLLRATE_P\t-0"), "controller.MC_ROLLRATE_P: should be greater"),
}


@pytest.mark.parametrize(
    ("made", "text", "said"),
    [(made, *case) for made, cases in ((mission, WRONG), (px4, WRONG_QGC)) for case in cases.values()],
    ids=[*WRONG, *(f"px4: {name}" for name in WRONG_QGC)],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(tmp_path, made, text, said):
    with pytest.raises(UserError) as error:
        made(tmp_path, text)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_autopilots_files_are_written_as_they_are_read():
    values = {"MPC_XY_P": 0.95, "MC_AIRMODE": 1.0}
    text = QgcParams.write(values, {})
    assert text.splitlines()[1:] == ["1\t1\tMC_AIRMODE\t1\t6", "1\t1\tMPC_XY_P\t0.95\t9"]
    assert QgcParams.read(text).values == values
    assert ArduPilotParm.write({"B": 1.0, "A_1": 0.25}, {}) == "A_1 0.25\nB 1\n"
    assert ArduPilotParm.read("#NOTE: x\r\nB,1 @READONLY\r\nA_1 \t 0.25 # mine\r\n").values == {"B": 1.0, "A_1": 0.25}
    for text in ("B\n", "b 1\n", "B 1 2\n", "B x\n", "B 1\nB 1\n", ""):
        with pytest.raises(UserError):
            ArduPilotParm.read(text)


def test_a_mission_flies_with_what_a_ground_station_saved_of_ardupilot(tmp_path):
    def read(text, encoding="utf-8-sig"):
        (tmp_path / "saved.param").write_text(text, encoding)
        controller = {"type": "ardupilot-cascade", "parameters": "saved.param"}
        return check_mission({"vehicle": {"preset": "x500"}, "path": HOVER, "controller": controller}, "m.toml", tmp_path)

    found = read("ATC_RAT_RLL_P,0.15\nANGLE_MAX 4500\nATC_RAT_RLL_SMAX 0\nFRAME_CLASS 1\n")
    gains = found.plan(warn=False).parameters.gains
    assert (gains.roll.p, gains.pitch.p, gains.position.copter_lean) == (0.15, 0.135, 4500.0)
    assert found.controller.warnings(found.modelled) == ["saved.param: ardupilot-cascade does not use ATC_RAT_RLL_SMAX"]
    with pytest.raises(UserError, match="FRAME_CLASS is 6, and ardupilot-cascade flies only 1, 2, 3, 4, 5, 7, 12 or 14"):
        read("FRAME_CLASS 6\n")
    for other in ("RLL2SRV_TCONST 0.5\nQ_ENABLE 0\n", "Q_A_RAT_RLL_P 0.25\n", "CRUISE_SPEED,2\nFRAME_CLASS,1\n"):
        with pytest.raises(UserError, match=r"saved.param: has none of ArduPilot Copter 4.6's .*; save those of a multirotor"):
            read(other)
    with pytest.raises(UserError, match=r"not a text file in UTF-8; text in another encoding has to be saved as UTF-8"):
        read("ATC_RAT_RLL_P,0.15\n", "utf-16")
    with pytest.raises(UserError, match=r"PSC_D_ACC_FLTE is from another release; .* Copter 4.6 calls it PSC_ACCZ_FLTE"):
        read("PSC_D_ACC_FLTE 20\n")


STOCK_LAWS = {name: controller(Measured, name) for name in STOCK}


@pytest.mark.parametrize("name", STOCK_LAWS)
def test_parameters_that_contradict_each_other_are_refused_by_their_names(name):
    law = STOCK_LAWS[name]
    keys = law.by_key()
    defaults = {key: gain.fixed for key, (_, gain) in keys.items() if gain.fixed is not None}

    def mission(**values):
        table = under({"type": name}, values)
        return check_mission({"vehicle": {"preset": "crazyflie"}, "path": HOVER, "controller": table}, "m.toml")

    assert mission().controller.warnings(mission().modelled) == []
    assert all(here in keys and other not in keys for other, here in law.renamed.items())
    for text in law.ordered:
        lower, relation, upper = text.split()
        above = keys[upper][1].high or 2.0 * (defaults[upper] or 1.0)
        values = {lower: above, upper: 0.5 * above}
        with pytest.raises(UserError) as error:
            mission(**values)
        assert f"controller.{lower} = {above:g} and {upper} = {0.5 * above:g} contradict each other" in str(error.value)
        if relation == "<":
            with pytest.raises(UserError, match=f"{lower} = .* contradict"):
                mission(**{lower: 0.5 * above, upper: 0.5 * above})
        elif all(other == text or not {lower, upper} & set(other.split()) for other in law.ordered):
            mission(**{lower: 0.5 * above, upper: 0.5 * above})
    for key, (_, gain) in keys.items():
        if gain.only:
            with pytest.raises(UserError, match=f"controller.{key}: should be less than or equal to {gain.high:g}"):
                mission(**{key: gain.high + 1.0})
        if gain.only == "whole":
            with pytest.raises(UserError, match=f"controller.{key}: .*multiple of 1"):
                mission(**{key: 0.5})


def test_what_px4_takes_but_does_not_advise_is_flown_and_said(tmp_path):
    read = px4(tmp_path, QGC, MC_ROLLRATE_P=0.6)
    assert (
        "controller.MC_ROLLRATE_P = 0.6 is outside the range documented by PX4 v1.15, from 0.01 to 0.5"
        in read.controller.warnings(read.modelled)
    )
