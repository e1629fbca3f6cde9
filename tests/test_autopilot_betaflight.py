"""Flights under Betaflight, here a fake one that speaks its protocols; under the real one where a tree is named."""

import contextlib
import shutil

import numpy as np
import pytest

from quadstep.bridges import autopilots, betaflight
from quadstep.bridges.betaflight import Betaflight, Sticks, listens_everywhere
from quadstep.bridges.link import address
from quadstep.io.errors import UserError
from quadstep.studies.tuning.run import tune
from tests.autopilots import FakeBetaflight, free_port
from tests.betaflight_flight import real_answers, real_flight
from tests.commands import quadstep, without_figures, write
from tests.needs import BETAFLIGHT_SITL, needs

MISSION = """
vehicle = { preset = "x500" }
path = { type = "circle", centre = [0.0, 0.0, 5.0], radius = 0.3, period = 5.0 }
simulation = { duration = 1.5, control_period = 0.001, step = 0.001 }
"""


@pytest.fixture
def mission(tmp_path, monkeypatch):
    without_figures(monkeypatch)
    monkeypatch.setattr("quadstep.mission.schema.flight_jobs", lambda *_: [])
    return write(tmp_path, MISSION)


def led(mission, **how):
    """A flight under a fake."""
    fake = FakeBetaflight(free_port(), **how)
    fake.start()
    console = f"tcp:127.0.0.1:{fake.console.getsockname()[1]}"
    where = ("--connect", fake.port, "--pilot", "--pilot-connect", console, "--connect-timeout", "0.4")
    run = quadstep("fly", mission, "--autopilot", "betaflight", *where, "--out", mission.parent / "out")
    fake.stop.set()
    fake.join()
    return run, fake


def test_betaflight_is_armed_tried_lifted_and_led_along_the_path(mission):
    run, fake = led(mission)
    assert run.code == 0, run.err
    assert "it controls the rates, and quadstep's position and attitude loops move its sticks" in " ".join(run.err.split())
    rows = np.genfromtxt(mission.parent / "out" / "flight.csv", delimiter=",", names=True)
    assert np.hypot(rows["xm"] - rows["x_dm"], rows["ym"] - rows["y_dm"]).max() < 0.1
    assert abs(rows["zm"] - 5.0).max() < 0.1
    assert not fake.armings[0]
    assert not fake.armings[-1]  # disarmed after the flight
    said = (mission.parent / "betaflight.txt").read_text(encoding="utf-8")
    assert "aux 0 0 0 1700 2100 0 0" in said
    assert "set pid_process_denom = 8\nset yaw_motors_reversed = OFF\nsave" in said


@pytest.mark.parametrize(("how", "said"), [
    ({"settings": [(90, 1, 1), (42, 1, 1)]}, "pid_process_denom is 1, should be 8, yaw_motors_reversed is 1, should be 0"),
    ({"settings": [(111, 22, 0)]}, "rates_type should be ACTUAL, without expo"),
    ({"settings": [(1, 2, 45)]}, "Betaflight speaks MSP 1.45; should be 4.5 or later, MSP 1.46"),
    ({"off": True}, "answers one packet only, so its motors are off"),
    ({"silent_after": 0}, "nothing from Betaflight on 127.0.0.1:"),
    ({"arms": False}, "Betaflight did not arm within 2 s"),
    ({"places": (2, 3, 0, 1)}, "Betaflight, asked to roll right, changed its motors by"),
    ({"places": (1, 0, 3, 2)}, "Betaflight, asked to roll right, changed its motors by"),
    ({"places": (3, 2, 1, 0)}, "Betaflight, asked to pitch down, changed its motors by"),
], ids=["settings", "rates", "old", "off", "silent", "unarmed", "left for right", "turned", "front for back"])  # fmt: skip
def test_what_keeps_betaflight_on_the_ground_is_told_in_one_line(mission, monkeypatch, how, said):
    monkeypatch.setattr(betaflight, "READY", 2.0)
    run, _ = led(mission, **how)
    assert run.code == 2
    assert said in run.err.splitlines()[-1]
    assert not (mission.parent / "out").exists()


def test_a_betaflight_that_stops_or_disarms_loses_the_flight(mission, monkeypatch):
    kind = autopilots.KINDS["betaflight"]._replace(link=lambda where, first: Betaflight(where, first, 0.3))
    monkeypatch.setitem(autopilots.KINDS, "betaflight", kind)
    run, _ = led(mission, silent_after=3500)
    assert run.code == 3, run.err
    assert "Betaflight stopped sending at" in " ".join(run.out.split())
    fly = Sticks.fly

    def dropped(self, sample):
        fly(self, sample)
        if sample.time > 0.5:
            self._send(betaflight.vector(0.0, 0.0, 0.0), 0.0, armed=False)

    monkeypatch.setattr(Sticks, "fly", dropped)
    shutil.rmtree(mission.parent / "out")
    run, _ = led(mission)
    assert run.code == 3, run.err
    assert "Betaflight disarmed at 0.5" in " ".join(run.out.split())


def test_betaflight_is_refused_where_another_machine_reaches_it(tmp_path, monkeypatch):
    head = "sl local_address\n"
    (tmp_path / "udp").write_text(f"{head} 1042: 00000000:232B 00000000:0000 07\n", encoding="ascii")
    (tmp_path / "route").write_text("Iface\n", encoding="ascii")
    assert not listens_everywhere(9003, tmp_path)  # in a namespace of its own
    (tmp_path / "route").write_text("Iface\neth0 0000\n", encoding="ascii")
    assert listens_everywhere(9003, tmp_path)
    assert not listens_everywhere(9004, tmp_path)
    assert not listens_everywhere(9003, tmp_path / "none")
    monkeypatch.setattr(betaflight, "listens_everywhere", lambda _: True)
    link = Betaflight(address(str(free_port()), 1), 0.1)
    with contextlib.closing(link), pytest.raises(UserError, match=r"listens on every address of this .*: unshare -rn"):
        link.meet(None)
    with pytest.raises(UserError, match=r"flown on this machine alone; allowed: 127\.0\.0\.1:PORT"):
        Betaflight(address("0.0.0.0:9002", 1))


def test_missions_with_another_period_are_refused(mission):
    mission.write_text(MISSION.replace("control_period = 0.001", "control_period = 0.002"), encoding="utf-8")
    run, _ = led(mission)
    assert run.code == 2
    assert "simulation.control_period: should be 0.001 s for Betaflight" in run.err


@needs(BETAFLIGHT_SITL)
def test_the_real_betaflight_flies_a_circle_once_it_has_its_settings(tmp_path):
    run = real_flight(tmp_path, MISSION.replace("duration = 1.5", "duration = 6.0"))
    assert run.returncode == 0, run.stderr
    assert "Betaflight lifted off" in " ".join(run.stderr.split())
    rows = np.genfromtxt(tmp_path / "out" / "flight.csv", delimiter=",", names=True)
    assert np.hypot(rows["xm"] - rows["x_dm"], rows["ym"] - rows["y_dm"]).max() < 0.1


SET = """set p_roll = 60
set dterm_lpf1_type = BIQUAD
profile 1
set p_roll = 33
profile 0
rateprofile 2
set roll_rc_rate = 12
save
"""

TUNED = """
vehicle.preset = "x500"
path = { type = "step", end = [0.5, 0.0, 0.0], time = 0.1, duration = 2.0 }
controller = { type = "betaflight-rates", parameters = "diff.txt" }
tune.gains = { "controller.p_roll" = {}, "controller.p_pitch" = {} }
"""


@needs(BETAFLIGHT_SITL)
def test_what_tune_writes_changes_that_and_nothing_else_in_the_real_betaflight(tmp_path):
    _, before = real_answers(tmp_path, SET, "diff all\n")
    (tmp_path / "diff.txt").write_text(before, encoding="utf-8")
    mission = write(tmp_path, TUNED)
    done = tune(mission, 30, tmp_path / "out")
    _, after = real_answers(tmp_path, (tmp_path / "out" / "tuned.txt").read_text(encoding="utf-8"), "diff all\n")
    roll, pitch = (f"set p_{axis} = {done.values[f'controller.p_{axis}']:.0f}" for axis in ("roll", "pitch"))
    assert {roll, pitch}.isdisjoint(before.splitlines())
    assert set(before.splitlines()) - set(after.splitlines()) == {"set p_roll = 60"}  # in profile 0
    assert set(after.splitlines()) - set(before.splitlines()) == {roll, pitch}
