"""The adapters of firmware, compiled against headers of our own that say what their documentation says, and run."""

import math
import os
import platform
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml

from quadstep.export.c.compiled import exported
from quadstep.export.firmware import firmware_files, mixer_torque
from quadstep.io.errors import UserError
from quadstep.vehicle.allocation import mixing
from tests.adapters import adapter, flown, numbers
from tests.commands import quadstep, write
from tests.exports import paper_mission, real_mission
from tests.firmware_flights import flown_crazyflie, main
from tests.firmware_trees import VARIABLES, built, lacking, tree
from tests.needs import C_COMPILER, CRAZYFLIE_TREE, CXX_COMPILER, needs


@needs(C_COMPILER, CXX_COMPILER)
@pytest.mark.parametrize("kind", ["pid", "rotation-backstepping"])
def test_the_crazyflie_flies_the_law_in_its_units(tmp_path, kind):
    name, plan = adapter(tmp_path, "crazyflie", kind)
    lines = flown(tmp_path, "crazyflie", name, "fly.c", "controller_quadstep.c")
    assert lines[0] == "idle 0 0 2 0"  # motors off: the firmware's own controller is asked, and has nothing to fly
    samples = numbers(lines, "sample")
    assert len(samples) == 20
    assert sum(line.startswith("changed") for line in lines) == 1  # a gain, at the tenth
    scale = np.abs(samples[:, 4:]).max(axis=0)
    assert np.abs((samples[:, :4] - samples[:, 4:]) / scale).max() < 1e-4  # degrees and back round differently
    check_crazyflie_guards(lines)
    check_crazyflie_yaw(lines)
    check_periods(lines, 0.002)
    if kind == "pid":
        check_crazyflie_entry(lines, plan)


def check_periods(lines, usual):
    """Of samples as usual, missed, repeated, back in time, late and early: a period is never none, nor too long."""
    missed = 2.0 * usual
    np.testing.assert_allclose(numbers(lines, "since")[:, 0], [usual, missed, usual, usual, 0.02, 0.0002], rtol=1e-5)


LAW, STOCK = 1, 0
"""Modes of control: force and torque, or the firmware's own controller."""


def check_crazyflie_guards(lines):
    """A position, a rate and a path that are not finite; a climb asked for; an old gyro sample; more thrust asked for than
    there is.
    """
    held, lost, back = (numbers(lines, word) for word in ("held", "lost", "back"))
    assert (held[:, 1] == [LAW, LAW, LAW, STOCK, LAW]).all()
    assert (held[[0, 1, 2, 4], 2] > 0.0).all()  # the last command, for a while
    assert numbers(lines, "young")[0, 0] == 0  # a sample is old after 0.1 s
    assert (lost[[1, 4], 1] == LAW).all()
    assert (lost[[1, 4], 2] == 0.0).all()  # nothing can fly on these
    assert (lost[[0, 2, 3], 1] == STOCK).all()
    assert (lost[[0, 2, 3], 3:5] == 1).all()  # reset once, then flown
    assert lost[[0, 2, 3], 5].tolist() == [1, 1, 2]  # at a height, or climbing
    assert lost[[0, 2, 3], 6].tolist() == [0.0, 0.0, 0.25]  # in place, or as asked
    assert (back[:, 1] == LAW).all()
    assert (back[:, 2] > 0.0).all()
    status, thrust = numbers(lines, "saturated")[0]
    assert status == 16
    assert thrust == pytest.approx(4 * 0.12, abs=0.025)  # the firmware's ceiling, below the preset's


def check_crazyflie_entry(lines, plan):
    """What controllerPid commands, by the firmware's mixer: half of roll and pitch, all of yaw, for each motor, in counts."""
    mounts, ratio = plan.loop.plant.geometry.mounts, mixing(plan.loop.plant.geometry, 1.0)[3]
    torque = float(plan.parameters.airframe.rotor.torque / plan.parameters.airframe.rotor.thrust)
    forces = []
    for mount in mounts:
        left, ahead = np.sign(float(mount.position[1])), np.sign(float(mount.position[0]))
        forces.append((45000 + left * 350 - ahead * 250 - left * ahead * 300) / 65535 * 0.12)
    wanted = [
        sum(forces),
        sum(force * float(mount.position[1]) for force, mount in zip(forces, mounts, strict=True)),
        -sum(force * float(mount.position[0]) for force, mount in zip(forces, mounts, strict=True)),
        torque * sum(force * float(sign) for force, sign in zip(forces, ratio, strict=True)),
    ]
    pid, idle, law = numbers(lines, "enters")
    np.testing.assert_allclose(pid, wanted, rtol=1e-3)
    assert idle[0] > 0.25  # on the ground, as ever
    np.testing.assert_allclose(law, [0.3, 1e-4, -2e-4, 3e-5], rtol=1e-3)


def check_crazyflie_yaw(lines):
    """A heading asked for as an angle, by an attitude, by a rate for a while, and by one that the vehicle does not follow."""
    none, angle, attitude, rate, much = numbers(lines, "yaw")[:, 1]
    assert none == 0.0
    assert angle > 0.0
    assert attitude == pytest.approx(angle, rel=1e-5)
    assert 0.5 * angle < rate < 2.0 * angle  # it was there for less long, and turned
    assert much < 0.0


@needs(C_COMPILER, CXX_COMPILER, CRAZYFLIE_TREE)
@pytest.mark.parametrize("law", ["pid", "geometric"])
def test_the_crazyflie_flies_with_its_firmwares_own_code(tmp_path, law):
    """Its headers, controllerPid and power distribution, around a body of our own."""
    found = flown_crazyflie(tmp_path, Path(os.environ["QUADSTEP_CRAZYFLIE"]), law)
    lost, deep, blind, gone = (found.pop(name) for name in ("lost", "deep", "blind", "gone"))
    assert all(one.lowest > 0.85 for one in found.values())  # nothing falls, whatever is asked for
    for one in (lost, deep, blind):  # half a second without x, x and z, position and velocity: from 3 m
        assert one.lowest > 2.75
        assert one.tilt < 5.0
    assert 0.5 < gone.lowest < 2.0  # without an attitude it falls, is caught and comes back
    assert max(one.away for one in (lost, deep, blind, gone)) < 0.1
    for name in ("absolute", "again"):
        assert found[name].away < 0.1
    # 4 s after a step of 0.8 m: with `quadstep fly`, away from there at 0.3 m/s, 12 and 109 mm
    assert found["back"].away < 1.1 * {"pid": 0.0115, "geometric": 0.109}[law]
    assert found["full"].yaw == pytest.approx(90.0, abs=1.0)
    assert abs(found["turned"].yaw) == pytest.approx(180.0, abs=1.0)
    assert found["hover"].away > 0.5  # it moves with the speed asked for
    fly = {"pid": 0.0364, "geometric": 0.1336}[law]  # RMSE of `quadstep fly` on that circle
    assert 0.9 * fly < found["circle"].away < 1.1 * fly
    assert 0.9 * fly < found["gusty"].away < 1.1 * fly
    assert found["off"].height < gone.height
    assert found["entry"].farthest < 0.15  # in a wind; 0.31 m for pid and 0.54 for geometric where they start afresh


@needs(C_COMPILER, CXX_COMPILER)
def test_px4_flies_the_law_in_its_axes(tmp_path):
    name, plan = adapter(tmp_path, "px4", "pid", "x500")
    lines = flown(tmp_path, "px4", name, "fly.cpp", "QuadstepControl.cpp")
    assert lines[:2] == ["asked for Quadstep", "checked 7 1"]
    entry = numbers(lines, "entry")[0]  # at entry the mixer's last output, for this sample: PX4's simulators wait for one
    np.testing.assert_array_equal(entry, [1, 0, 0, 0, 0])
    check_px4_samples(lines, float(plan.parameters.airframe.rotor.fastest))
    listed = yaml.safe_load((tmp_path / "module.yaml").read_text(encoding="utf-8"))["parameters"][0]["definitions"]
    rate = listed["QS_RAT_X"]
    assert rate["description"]["short"] == "gains.rate[0]"
    assert rate["default"] == pytest.approx(float(plan.parameters.gains.rate[0]))
    assert 0.0 < rate["min"] < 1e-3  # 0 is not allowed
    assert listed["QS_RAT_INT_X"]["min"] == 0.0
    assert all(len(name) <= 16 for name in listed)
    check_px4_guards(lines)
    check_px4_setpoints(lines)


def check_px4_samples(lines, fastest):
    """Of samples at uneven times, with a gain that is changed in between: thrust, which PX4 linearises."""
    samples = numbers(lines, "sample")
    assert len(samples) == 12
    np.testing.assert_allclose(samples[:, :4], (samples[:, 4:] / fastest) ** 2, atol=4e-4)


def check_px4_guards(lines):
    """A position that is old, not valid, not finite; a rate that is not finite; more thrust asked for than there is."""
    young, told, lost, back = (numbers(lines, word) for word in ("young", "told", "lost", "back"))
    assert len(young) == 4
    assert (young[:, 1] == 1).all()  # a position is old after 0.1 s; one bad sample does not end the mode
    assert (told[:, 1] == 0).all()  # PX4 leaves the mode; it is told without having asked
    for place in (0, 1, 3):
        assert (lost[place, 2:] == told[place, 2:]).all()  # the last command, until PX4 has left: the motors are never stopped
    assert (lost[:, 2:] > 0.0).all()
    assert (young[:, 2:] > 0.0).all()
    assert (numbers(lines, "latched")[:, 1] == 0).all()  # PX4 does not come back by itself
    assert (numbers(lines, "able")[:, 1] == 1).all()
    assert (back[:, 1] == 1).all()
    assert (back[:, 2:] > 0.0).all()
    logged = numbers(lines, "logged")
    assert len(logged) == 3  # of the twelve samples
    assert (logged[:, 0] == 20819).all()
    assert (logged[:, 2] == 0).all()
    np.testing.assert_allclose(logged[:, 3], [0.002, 0.004, 0.02], rtol=1e-5)  # the longest period since the last
    np.testing.assert_allclose(logged[:, 5:], 0.0, atol=2e-3)
    saturated = numbers(lines, "saturated")[0]
    assert (saturated[2:] <= 1.0).all()
    assert saturated[2:].max() > 0.99


def check_px4_setpoints(lines):
    """Where it holds, what it follows, and how it ends."""
    thrust = {word: numbers(lines, word)[0, 2:] for word in ("entered", "climbs", "sinks", "holds", "reset", "low", "flies")}
    hover = thrust["entered"].mean()
    assert 0.3 < hover < 0.6
    assert np.ptp(thrust["entered"]) < 1e-6  # where it is, whatever was asked before
    assert thrust["climbs"].mean() > 1.1 * hover
    assert thrust["sinks"].mean() < 0.95 * hover
    assert np.ptp(thrust["holds"]) < 1e-3
    assert abs(thrust["holds"].mean() - hover) < 0.1 * hover  # up to what was integrated meanwhile
    for word in ("reset", "flies"):
        assert np.abs(thrust[word] - thrust["holds"]).max() < 0.05 * hover, word  # a turned north shakes the yaw loop a little
    np.testing.assert_allclose(thrust["low"], 1.1**2 * thrust["flies"], rtol=0.01)
    assert [line for line in lines if line.startswith("stop")] == ["stop -1", "stop 0"]
    assert "left" in lines
    assert "gone 1 23 -1 Quadstep" in lines


@needs(C_COMPILER, CXX_COMPILER)
def test_ardupilot_turns_the_way_it_wants(tmp_path):
    name, plan = adapter(tmp_path, "ardupilot", "pid", "x500")
    lines = flown(tmp_path, "ardupilot", name, "fly.cpp", "AC_CustomControl_Quadstep.cpp")
    mixed = np.array([[float(one) for one in line.split()] for line in lines[:4]])
    np.testing.assert_allclose(mixed[0], 0.0, atol=1e-6)
    for axis in range(3):  # to the right, nose up, to the right: each about its own axis, positive
        assert mixed[1 + axis, axis] > 0.02
        assert np.abs(np.delete(mixed[1 + axis], axis)).max() < 0.2 * mixed[1 + axis, axis]
    assert math.isfinite(mixed.sum())
    check_ardupilot_guards(lines)
    logged = numbers(lines, "logged")[0]
    assert logged[2] == 2  # of the four samples
    full = mixer_torque(exported(plan, False))
    np.testing.assert_allclose(logged[4:7] / full * [1, -1, -1], logged[7:] * [1, -1, -1], rtol=1e-4, atol=1e-7)
    assert logged[7] > 0.02


@pytest.mark.skipif(platform.machine() != "x86_64" or not shutil.which("gcc"), reason=C_COMPILER.reason)
def test_ardupilots_flags_do_not_contract_the_law(tmp_path):
    """Its build gives every file the same ones, and gcc's own contract."""
    name, _ = adapter(tmp_path, "ardupilot", "pid", "x500")
    line = ["gcc", "-std=gnu11", "-O2", "-mfma", "-S", "-o", "-"]

    def code():
        run = subprocess.run([*line, f"{name}.c"], cwd=tmp_path, capture_output=True, text=True, check=True)
        return run.stdout

    assert "mulss" in code()
    assert "vfm" not in code()
    text = (tmp_path / f"{name}.c").read_text(encoding="utf-8")
    (tmp_path / f"{name}.c").write_text(text.replace("#pragma GCC", "// "), encoding="utf-8")
    assert "vfm" in code()


@needs(C_COMPILER, CXX_COMPILER)
def test_ardupilot_turns_with_the_attitude_that_it_wants(tmp_path):
    """It turns to the right, nose up, to the right; of a law that uses the rates of its path."""
    name, _ = adapter(tmp_path, "ardupilot", "geometric", "x500")
    lines = flown(tmp_path, "ardupilot", name, "fly.cpp", "AC_CustomControl_Quadstep.cpp")
    turning = numbers(lines, "turning")[:, 1:]
    for axis in range(3):
        assert turning[axis, axis] > 0.01
        assert np.abs(np.delete(turning[axis], axis)).max() < 0.7 * turning[axis, axis]  # of turning while tilted


def check_ardupilot_guards(lines):
    """On the ground; an old gyro sample; a rate, an attitude and a wanted attitude that are not finite; more roll asked for
    than there is; a gain changed in flight.
    """
    flown = numbers(lines, "flown")[0]
    np.testing.assert_array_equal(numbers(lines, "idle")[0], 0.0)
    first = [float(one) for one in lines[1].split()]
    np.testing.assert_allclose(flown[:3], first, atol=1e-6)
    for word in ("young", "back"):  # a sample is old after 0.1 s
        assert numbers(lines, word)[0, 0] > 0.02
        assert numbers(lines, word)[0, 3] == 0
    refused, left = numbers(lines, "refused"), numbers(lines, "left")
    assert refused[0, 0] > 0.02  # the last output
    assert refused[0, 3] == 0
    assert len(left) == 4
    assert (left[:, 3] >= 1).all()  # ArduPilot's own controller takes over
    assert 0.9 < numbers(lines, "saturated")[0, 0] <= 1.0  # what is left at hover, of half of each rotor's thrust
    np.testing.assert_allclose(numbers(lines, "enters")[0, :3], [0.05, -0.04, 0.06], atol=1e-3)
    found, roll = numbers(lines, "halved")[0, :2]
    check_periods(lines, 0.0025)
    assert found == 1
    assert 0.4 * first[0] < roll < 0.6 * first[0]


BROKEN = {
    "crazyflie": (
        (
            "crazyflie",
            "fly.c",
            "controller_quadstep.c",
            lambda lines: (check_crazyflie_guards(lines), check_crazyflie_yaw(lines), check_periods(lines, 0.002)),
        ),
        (
            ("if (refused > HOLD)", "if (false)"),
            ("(refused + 1u)", "0u"),
            ("!= modeAbs))\n", "> 99))\n"),
            ("status |= pid_made", "(void)pid_made"),
            ("usecTimestamp() - sensors->interruptTimestamp)", "0)"),
            ("1e-6f * (float)(usec", "2e-6f * (float)(usec"),
            ("if (stock_flies == 0u)", "if (false)"),
            ("&& upright(", "&& !upright("),
            ("isfinite(sum) && ", ""),
            ("(old <= mission.most_age)", "true"),
            ("fminf(mission.vehicle.allocation.most, THRUST_MAX)", "mission.vehicle.allocation.most"),
            ("setpoint->mode.quat == modeAbs", "false"),
            ("yaw = here +", "yaw = here -"),
            ("(now > last)", "(now != last)"),
            ("fmaxf(since, LEAST_PERIOD)", "since"),
            ("fminf(fmaxf(", "fmaxf(fmaxf("),
            ("    last = now;", ""),
        ),
    ),
    "px4": (
        ("x500", "fly.cpp", "QuadstepControl.cpp", lambda lines: (check_px4_guards(lines), check_px4_setpoints(lines))),
        (
            ("age(sampled(_position), present)", "0.0f"),
            ("_position.z_valid &&", ""),
            ("can_arm_and_run = able;", "can_arm_and_run = true;"),
            ("else if (able == _able)", "else"),
            ("status.nav_state_user_intention != _mode_id", "true"),
            ("_setpoint.timestamp > _entered", "true"),
            ("+ SETPOINT_OLD", "+ 100 * SETPOINT_OLD"),
            ("if (_follows && !follows)", "if (false)"),
            ("_hold.position[1] -=", "_hold.position[1] +="),
            ("_hold.position[2] -=", "_hold.position[2] +="),
            ("_hold.yaw -=", "_hold.yaw +="),
            ("gone.name, MODE", 'gone.name, ""'),
            ("&& instance->_armed", "&& false"),
            ("_scale * _scale", "_scale"),
            ("std::fmax(_longest, period)", "period"),
            ("sign[i] * command.torque[i]", "command.torque[i]"),
        ),
    ),
    "ardupilot": (
        ("x500", "fly.cpp", "AC_CustomControl_Quadstep.cpp", check_ardupilot_guards),
        (
            ("_frontend.set_custom_controller(false)", "(void)0"),
            ("case AP_Motors::SpoolState::GROUND_IDLE:", ""),
            ("constrain_float(_made.torque[0] / FULL[0], -1.0f, 1.0f)", "2.0f * _made.torque[0] / FULL[0]"),
            ("AP_HAL::micros() - sampled)", "0)"),
            ("1e-6f * static_cast<float>(AP", "2e-6f * static_cast<float>(AP"),
            ("    take_gains();", ""),
            ("since > 0)", "since != 0)"),
            ("LEAST_PERIOD, MOST_PERIOD)", "0.0f, MOST_PERIOD)"),
            ("LEAST_PERIOD, MOST_PERIOD)", "LEAST_PERIOD, 1.0f)"),
            ("pid_enter(&_params, &_state, &measured, &present)", "pid_start(&_params, &_state, &measured)"),
        ),
    ),
}
"""By target: vehicle, program, adapter, what should hold, and what a guard may lack as a change of the adapter."""


@needs(C_COMPILER, CXX_COMPILER)
@pytest.mark.parametrize("rest", [False, pytest.param(True, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("target", BROKEN)
def test_a_guard_that_an_adapter_lacks_is_seen(tmp_path, target, rest):
    """An ordinary run takes away every third."""
    (vehicle, program, unit, check), changes = BROKEN[target]
    changes = [one for place, one in enumerate(changes) if (place % 3 > 0) == rest]
    name, _ = adapter(tmp_path, target, "pid", vehicle)
    text = (tmp_path / unit).read_text(encoding="utf-8")
    check(flown(tmp_path, target, name, program, unit))
    for old, new in changes:
        assert old in text
        (tmp_path / unit).write_text(text.replace(old, new, 1), encoding="utf-8")
        with pytest.raises((AssertionError, subprocess.CalledProcessError)):
            check(flown(tmp_path, target, name, program, unit, level="-O0"))  # sooner compiled


def test_what_a_target_cannot_fly_is_said(tmp_path):
    law = exported(paper_mission({"type": "backstepping"}).plan(), False)
    with pytest.raises(UserError, match="needs a mission for a real vehicle"):
        firmware_files("px4", law, {})
    with pytest.raises(UserError, match="uses f32"):
        firmware_files("px4", exported(real_mission({"type": "pid"}).plan(), True), {})
    slow = real_mission({"type": "pid"}, simulation={"step": 0.0005, "control_period": 0.0025}).plan()
    with pytest.raises(UserError, match=r"law runs every 0\.0025 s, not a multiple of 1 ms"):
        firmware_files("crazyflie", exported(slow, False), {})
    text = '[vehicle]\npreset = "crazyflie"\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 2.0\n'
    run = quadstep("export", write(tmp_path, text), "--target", "crazyflie", "--precision", "f64", "--out", tmp_path / "o")
    assert run.refused
    assert not (tmp_path / "o").exists()


@needs(C_COMPILER, CXX_COMPILER)
@pytest.mark.parametrize(("target", "unit"), [(target, BROKEN[target][0][2]) for target in BROKEN])
def test_an_adapter_is_built_in_its_firmwares_tree(tmp_path, target, unit):
    """In the tree that a variable of `VARIABLES` names, or in one that looks so."""
    folder = tmp_path / "exported"
    folder.mkdir()
    adapter(folder, target, "pid", BROKEN[target][0][0])
    place = tree(target, tmp_path)
    before = sorted(path for path in place.rglob("AC_CustomControl*/*"))
    run = built(target, folder, place)
    assert run.returncode == 0, run.stderr
    assert sorted(path for path in place.rglob("AC_CustomControl*/*")) == before
    (folder / unit).write_text((folder / unit).read_text(encoding="utf-8") + "\nthis is not C;\n", encoding="utf-8")
    if not os.environ.get(VARIABLES[target]):
        shutil.rmtree(tmp_path / "external", ignore_errors=True)
        assert built(target, folder, place).returncode != 0


def test_a_submodules_file_that_a_tree_lacks_is_named_with_what_fetches_it(tmp_path):
    (tmp_path / ".gitmodules").write_text('[submodule "vendor/CMSIS"]\n\tpath = vendor/CMSIS\n', encoding="utf-8")
    said = "make[3]: *** No rule to make target 'vendor/CMSIS/DSP/arm_common_tables.o', needed by 'vendor/built-in.o'.  Stop."
    wanted = "not built: no vendor/CMSIS/DSP/{} in the tree; `git submodule update --init --recursive vendor/CMSIS` fetches it"
    assert lacking(said, tmp_path) == wanted.format("arm_common_tables.c")
    header = f"src/a.c:1:10: fatal error: {tmp_path}/vendor/CMSIS/DSP/arm_math.h: No such file or directory"
    assert lacking(header, tmp_path) == wanted.format("arm_math.h")
    assert lacking("No rule to make target 'src/main.o'", tmp_path) == ""
    assert lacking(said, tmp_path / "elsewhere") == ""


def test_make_firmware_names_what_is_missing_before_it_builds(tmp_path, monkeypatch, capsys):
    for variable in VARIABLES.values():
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("QUADSTEP_PX4", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main() == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "px4: python3, make, cmake" in said.err
    (tmp_path / "cmake").write_text("#!/bin/sh\necho cmake version 4.4.5\n")
    (tmp_path / "cmake").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    monkeypatch.delenv("CMAKE_POLICY_VERSION_MINIMUM", raising=False)
    assert main() == 2
    assert "a CMake below 4, or CMAKE_POLICY_VERSION_MINIMUM=3.5 for CMake 4.4.5" in capsys.readouterr().err
