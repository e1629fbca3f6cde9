"""`fly --pilot`: a ground station of ours leads fake autopilots that have to be armed, lifted and sent a path."""

import contextlib
import math
import os
import re
import signal
import socket
import subprocess
import sys
from functools import partial

import numpy as np
import pytest

from quadstep.bridges.autopilots import KINDS
from quadstep.mission.read import plan_mission, read_mission
from tests.autopilots import CIRCLE, FAKES, FakeMavlink, Hover, free_port
from tests.commands import quadstep, strict_json, without_figures, write
from tests.needs import ARDUCOPTER, COPTER, needs, package

package("pymavlink")

MISSION = """
vehicle = { preset = "x500" }
path = { type = "circle", centre = [0.0, 0.0, 5.0], radius = 0.1, period = 5.0 }
simulation = { duration = 4.0, control_period = 0.004 }
"""


@pytest.fixture
def mission(tmp_path, monkeypatch):
    without_figures(monkeypatch)
    return write(tmp_path, MISSION)


def led(name, mission, frame=None, silent_after=math.inf, **how):
    """A fake that waits for a ground station, and the arguments with which ours finds it. frame: parameters that it has."""
    plan = plan_mission(read_mission(mission), mission)
    found = KINDS[name].matching(plan.parameters, plan.loop.plant.geometry)
    kind, socket_kind = FAKES[name]
    hover = Hover(plan)
    hover.above = 1.5 if name == "ardupilot" else hover.above
    pilot = kind(
        free_port(socket_kind),
        hover,
        silent_after=silent_after,
        mavlink=FakeMavlink(name, {**found.parameters, **(frame or {})}, **how),
    )
    pilot.start()
    out = mission.parent / "out"
    where = ("--connect", pilot.port, "--pilot", "--pilot-connect", pilot.mavlink.address)
    return pilot, ("fly", mission, "--autopilot", name, *where, "--out", out)


def flown(pilot, arguments):
    try:
        return quadstep(*arguments)
    finally:
        pilot.stop.set()
        pilot.join()


@pytest.mark.parametrize("name", FAKES)
def test_an_autopilot_is_armed_lifted_and_sent_the_path(mission, name):
    pilot, arguments = led(name, mission)
    run = flown(pilot, arguments)
    assert run.code == 0, run.err
    out = mission.parent / "out"
    assert strict_json(out / "metrics.json")["outcome"] == "completed"
    assert "which the autopilot flies only if someone sends it" not in run.out
    assert "warning" not in run.err
    assert re.search(r"lifted off after \d+\.\d s of simulated time$", run.err.strip())
    asked = pilot.mavlink.asked
    assert asked == sorted(asked, key=[511, 176, 400, 22].index)
    assert {*asked} == {511, 176, 400} | ({22} if name == "ardupilot" else set())
    plan = plan_mission(read_mission(mission), mission)
    everything = np.array([one.time_boot_ms for one in pilot.mavlink.setpoints])
    lift_off = int(np.argmax(np.diff(everything, prepend=0) < 0))  # the clock of the flight begins
    assert (lift_off > 0) is (name == "px4")  # it wants some before it changes its mode
    sent = pilot.mavlink.setpoints[lift_off:]
    assert len(sent) > 50
    for one in sent:
        wanted = plan.loop.path.reference(1e-3 * one.time_boot_ms, plan.parameters.path)
        x, y, z = wanted.position
        origin = FakeMavlink.ORIGIN
        assert (one.x, one.y, one.z) == pytest.approx((x - origin[0], -y - origin[1], -z - origin[2]), abs=1e-3)
        assert one.vz == pytest.approx(-wanted.velocity[2], abs=1e-6)
    stamps = np.array([one.time_boot_ms for one in sent])
    assert set(np.diff(stamps)) == {20}  # 50 Hz of the flight's clock
    assert stamps[-1] > 3900
    if name == "ardupilot":  # whose take-off would end with a setpoint
        rows = np.genfromtxt(out / "flight.csv", delimiter=",", names=True)
        first = np.searchsorted(rows["ts"], 1e-3 * stamps[0])
        assert rows["zm"][first] - 5.0 == pytest.approx(0.9, abs=0.05)
        assert (mission.parent / "ardupilot.parm").read_text().count("FRAME_TYPE 1\n") == 1
    else:
        first = pilot.mavlink.setpoints[0]
        assert first.z == pytest.approx(-6.0 - FakeMavlink.ORIGIN[2])  # 1 m above
        assert (first.vx, first.vy, first.vz) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", FAKES)
@pytest.mark.parametrize(("how", "said"), [
    ({"refuses": "Arm: Gyros not calibrated"}, "still not armed after 3 s of simulated time: Arm: Gyros not calibrated"),
    ({"stuck": True}, "still not in mode {mode} after 3 s of simulated time: the mode was denied"),
    ({"deaf": True}, "still not heard after 3 s of simulated time"),
    ({"frame": "plus"}, "{name} has a different frame from the mission's vehicle: {parameter}"),
], ids=lambda one: next(iter(one)) if isinstance(one, dict) else "")  # fmt: skip
def test_what_keeps_an_autopilot_on_the_ground_is_told_in_one_line(mission, monkeypatch, name, how, said):
    monkeypatch.setattr("quadstep.bridges.pilot.READY", 3.0)
    parameter, value = {"ardupilot": ("FRAME_TYPE", 0.0), "px4": ("CA_ROTOR0_PX", -0.1)}[name]
    frame = {parameter: value} if "frame" in how else {}
    pilot, arguments = led(name, mission, frame, **{key: one for key, one in how.items() if key != "frame"})
    run = flown(pilot, arguments)
    assert run.code == 2, run
    title, mode = {"ardupilot": ("ArduPilot", "GUIDED"), "px4": ("PX4", "OFFBOARD")}[name]
    wrong = f"{parameter} is {value:g}, should be"
    assert said.format(name=title, mode=mode, parameter=wrong) in run.err.splitlines()[-1]
    assert len(run.err.splitlines()) == 2
    assert not (mission.parent / "out").exists()
    assert not pilot.mavlink.lifted
    assert 400 not in pilot.mavlink.asked or "refuses" in how


def test_another_thrust_curve_is_told_of_and_flown(mission):
    pilot, arguments = led("ardupilot", mission, {"MOT_THST_EXPO": 0.65}, leaves=0.5)
    run = flown(pilot, arguments)
    assert "warning: ArduPilot's thrust curve is not the vehicle's: MOT_THST_EXPO is 0.65, should be 1" in run.err
    assert run.code == 3
    assert "ArduPilot left mode GUIDED: Radio failsafe at 0." in run.out  # wherever it goes then, it is not the path
    assert "The log up to that point is kept." in " ".join(run.out.split())
    assert (mission.parent / "out" / "flight.csv").exists()


@pytest.mark.parametrize(("name", "how", "said"), [
    ("px4", {"silent_after": 500}, "PX4 closed the connection at"),
    ("ardupilot", {"hangs_up": 0.3}, "ArduPilot closed the MAVLink connection tcp:127.0.0.1:"),
])  # fmt: skip
def test_an_autopilot_that_goes_is_told_of_at_once(mission, monkeypatch, name, how, said):
    pilot, arguments = led(name, mission, **how)
    wait = pilot.stop.wait
    monkeypatch.setattr(pilot.stop, "wait", lambda seconds: seconds < 1.0 and wait(seconds))  # it hangs up
    run = flown(pilot, arguments)
    assert run.code == 3, run
    assert said in " ".join(run.out.split())
    assert len((mission.parent / "out" / "flight.csv").read_text(encoding="utf-8").splitlines()) > 10


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_flight_that_is_led_keeps_its_log(mission, monkeypatch, request, number):
    request.addfinalizer(partial(signal.signal, number, signal.getsignal(number)))
    signal.signal(number, signal.default_int_handler)  # where the tests run in the background it may be ignored
    pilot, arguments = led("ardupilot", mission)
    poll, sent = pilot.mavlink.poll, []

    def interrupting(time, position):
        poll(time, position)
        if time - pilot.mavlink.lifted_at > 1.0 and not sent:  # from this thread: the other may be anywhere
            sent.append(time)
            os.kill(os.getpid(), number)

    monkeypatch.setattr(pilot.mavlink, "poll", interrupting)
    run = flown(pilot, arguments)
    assert run.code == 3, run
    assert re.search(r"Interrupted at [01]\.\d", run.out)
    assert len((mission.parent / "out" / "flight.csv").read_text(encoding="utf-8").splitlines()) > 50


def test_what_cannot_be_led_is_refused_before_anything_is_waited_for(mission, monkeypatch):
    for arguments, said in (
        (("--pilot",), "--pilot: requires --autopilot"),
        (("--autopilot", "px4", "--pilot-connect", "tcp:127.0.0.1:1"), "--pilot-connect: requires --pilot"),
        (("--autopilot", "px4", "--pilot", "--pilot-connect", "here"), "--pilot-connect here: cannot be opened; allowed"),
        (("--autopilot", "px4", "--pilot", "--pilot-connect", "tcp:::1:5760"), "IPv6 is not supported"),
    ):
        run = quadstep("fly", mission, *arguments)
        assert run.refused
        assert said in run.err
    monkeypatch.setitem(sys.modules, "pymavlink", None)
    monkeypatch.delitem(sys.modules, "pymavlink.mavutil", raising=False)
    run = quadstep("fly", mission, "--autopilot", "ardupilot", "--pilot")
    assert run.refused
    assert "`quadstep fly --pilot` needs pymavlink; install it" in run.err


def test_parameters_of_somebody_else_are_left_alone(mission):
    (mission.parent / "ardupilot.parm").write_text("ATC_RAT_RLL_P 0.2\n")
    pilot, arguments = led("ardupilot", mission, {"FRAME_TYPE": 0.0})
    run = flown(pilot, arguments)
    assert "ardupilot.parm: was not written by quadstep, and is left as it is" in run.err
    assert (mission.parent / "ardupilot.parm").read_text() == "ATC_RAT_RLL_P 0.2\n"


def test_nobody_listens_where_the_pilot_calls(mission):
    port = free_port(socket.SOCK_STREAM)
    where = ("--connect", free_port(), "--pilot", "--pilot-connect", f"tcp:127.0.0.1:{port}")
    run = quadstep("fly", mission, "--autopilot", "ardupilot", *where, "--connect-timeout", "0.5")
    assert run.code == 2
    assert f"start its simulator with --model JSON; --pilot-connect tcp:127.0.0.1:{port}: cannot be opened" in run.err


@contextlib.contextmanager
def arducopter(folder, *parameters):
    """ArduPilot's own simulator, in its usual place."""
    folder.mkdir()
    line = [str(COPTER), "--model", "JSON:127.0.0.1", "--defaults", ",".join(map(str, parameters))]
    with (folder / "said.txt").open("w") as said, subprocess.Popen(line, cwd=folder, stdout=said, stderr=said) as started:
        try:
            yield started
        finally:
            started.kill()


@needs(ARDUCOPTER)
def test_the_real_arducopter_flies_a_circle_and_is_refused_with_another_frame(tmp_path, monkeypatch):
    without_figures(monkeypatch)
    mission, out = write(tmp_path, CIRCLE), tmp_path / "out"
    plan = plan_mission(read_mission(mission), mission)
    found = KINDS["ardupilot"].matching(plan.parameters, plan.loop.plant.geometry)
    plus = write(tmp_path, found.text().replace("FRAME_TYPE 1", "FRAME_TYPE 0"), "plus.parm")
    with arducopter(tmp_path / "plus", plus):
        run = quadstep("fly", mission, "--autopilot", "ardupilot", "--pilot", "--out", out)
    assert run.code == 2
    assert run.err.endswith("another frame than the mission's vehicle: FRAME_TYPE is 0, should be 1\n")
    with arducopter(tmp_path / "x", tmp_path / "ardupilot.parm"):
        run = quadstep("fly", mission, "--autopilot", "ardupilot", "--pilot", "--out", out)
    assert run.code == 0, run.err
    rows = np.genfromtxt(out / "flight.csv", delimiter=",", names=True)
    rows = rows[rows["ts"] > 15.0]  # it has caught up with its path
    assert np.hypot(rows["xm"] - rows["x_dm"], rows["ym"] - rows["y_dm"]).max() < 0.5
    assert abs(rows["zm"] - rows["z_dm"]).max() < 0.1
