"""What Betaflight answers to `diff all`: the profiles that it chooses are flown, what is not modelled is listed, and back."""

import math

import pytest

from quadstep.io.errors import UserError
from quadstep.io.parameter_files import CHOICES, BetaflightDiff
from quadstep.mission.read import check_mission
from quadstep.studies.what_if import answer, changes_of
from quadstep.studies.what_if_report import Question

DIFF = """
Entering CLI Mode, type 'exit' to return, or 'help'

# diff all

# version
# Betaflight / STM32F7X2 (S7X2) 4.5.1 Jul 27 2024 / 20:17:34 (77d01ba3b) MSP API: 1.46
# config rev: 5566d66

# start the command batch
batch start

defaults nosave
board_name MATEKF722
feature -AIRMODE
serial 0 64 115200 57600 0 115200

# master
set gyro_lpf1_static_hz = 0
set acc_calibration = 12,-3,5,1
set motor_pwm_protocol = DSHOT600
set dshot_idle_value = 600

profile 0

# profile 0
set p_roll = 60
set dterm_lpf1_type = PT3

profile 1
set p_roll = 33
set simplified_master_multiplier = 90

# restore original profile selection
profile {profile}

rateprofile 0
set roll_rc_rate = 12

save
"""

HOVER = {"type": "step", "end": [0.0, 0.0, 1.0], "time": 0.1, "duration": 0.5}


def mission(folder, text, **keys):
    (folder / "diff.txt").write_text(text)
    controller = {"type": "betaflight-rates", "parameters": "diff.txt", **keys}
    return check_mission({"vehicle": {"preset": "x500"}, "path": HOVER, "controller": controller}, "m.toml", folder)


def test_the_profile_that_is_chosen_is_flown(tmp_path):
    first, second = (mission(tmp_path, DIFF.replace("{profile}", one)) for one in "01")
    assert (first.controller.p_roll, first.controller.dterm_lpf1_type) == (60.0, 3.0)
    assert (second.controller.p_roll, second.controller.dterm_lpf1_type) == (33.0, 0.0)
    for one in (first, second):
        assert (one.controller.gyro_lpf1_static_hz, one.controller.dshot_idle_value, one.controller.airmode) == (
            0.0,
            600.0,
            0.0,
        )
    assert mission(tmp_path, DIFF.replace("{profile}", "0"), p_roll=45.0).controller.p_roll == 45.0


def test_what_is_not_modelled_is_listed(tmp_path):
    read = mission(tmp_path, DIFF.replace("{profile}", "1"))
    said = read.controller.warnings(read.modelled)
    left = "motor_pwm_protocol, acc_calibration, roll_rc_rate, simplified_master_multiplier"
    assert said == [f"diff.txt: betaflight-rates does not use {left}"]


def test_what_is_written_is_read_again():
    values = {"p_roll": 52.0, "dterm_lpf1_type": 2.0, "iterm_relax": 4.0, "airmode": 0.0}
    text = BetaflightDiff.write(values, {})
    assert text.splitlines() == [
        "feature -AIRMODE", "set dterm_lpf1_type = PT2", "set iterm_relax = RPY_INC", "set p_roll = 52", "save"
    ]  # fmt: skip
    assert BetaflightDiff.read("# Betaflight / X 4.5.0\n" + text).values == values
    assert "set p_roll = 53" in BetaflightDiff.write({"p_roll": 52.6}, {})
    assert all(len(set(one)) == len(one) for one in CHOICES.values())


def test_what_is_no_number_is_none():
    found = BetaflightDiff.read(DIFF.replace("{profile}", "0")).values
    assert math.isnan(found["acc_calibration"])


@pytest.mark.parametrize("comment", ["motors / props 5.1.2", "motors / props 5.1", "quad / battery 4.2.1 of May"])
def test_a_comment_of_ones_own_is_no_firmware(comment):
    assert BetaflightDiff.read(f"# {comment}\nset p_roll = 60\n").values == {"p_roll": 60.0}
    assert BetaflightDiff.read(f"# {comment}\n{DIFF}".replace("{profile}", "0")).values["p_roll"] == 60.0
    with pytest.raises(UserError, match=r"is from INAV 7\.1"):
        BetaflightDiff.read(f"# {comment}\n# INAV/MATEKF405 7.1.2 Jun  5 2024\nset mc_p_pitch = 44\n")


WRONG = {
    "another version": (DIFF.replace("4.5.1", "4.3.2"), "is from Betaflight 4.3; only Betaflight 4.5 is supported"),
    "INAV": ("# INAV/MATEKF405 7.1.2 Jun 2024\nset mc_p_pitch = 44\n", "is from INAV 7.1; only Betaflight 4.5 is supported"),
    "no such choice": (DIFF.replace("PT3", "PT4"), "dterm_lpf1_type is 'PT4'; allowed: PT1, BIQUAD, PT2, PT3"),
    "another file": ("params:\n", "line 1 is not output of Betaflight's `diff all`: 'params:'"),
    "empty": ("", "is not output of Betaflight's `diff all`"),
    "no number": (DIFF.replace("= 60", "= much"), "controller.p_roll"),
    "out of reach": (DIFF.replace("= 60", "= -6"), "controller.p_roll: should be greater than or equal to 0"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_text_that_cannot_be_used_is_refused_in_one_line(tmp_path, wrong):
    text, said = WRONG[wrong]
    with pytest.raises(UserError) as error:
        mission(tmp_path, text.replace("{profile}", "0"))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_two_texts_differ_by_what_changes_between_them(tmp_path):
    files = [tmp_path / f"{one}.txt" for one in "01"]
    for one in files:
        one.write_text(DIFF.replace("{profile}", one.stem))
    assert changes_of([str(files[1])], str(files[0])).values == {"p_roll": 33.0, "dterm_lpf1_type": 0.0}
    assert changes_of(["betaflight-rates"], str(files[1])).values == {
        "p_roll": 45.0, "gyro_lpf1_static_hz": 250.0, "dshot_idle_value": 550.0, "airmode": 1.0
    }  # fmt: skip


@pytest.mark.thorough
def test_a_change_is_answered(tmp_path):
    asked = Question("betaflight-rates", {"p_roll": 1.0, "p_pitch": 1.0, "d_roll": 0.0, "d_pitch": 0.0}, "crazyflie", 3.0, 4)
    found = answer(asked, tmp_path / "out").record
    assert found["grades"]["before"] != found["grades"]["after"]
    assert found["before"]["p_roll"] == 45.0
