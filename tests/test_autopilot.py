"""Flights under an autopilot, here fake ones that speak the protocols of PX4 and ArduPilot."""

import os
import re
import signal
import socket
from functools import partial
from itertools import pairwise

import numpy as np
import pyarrow.parquet as pq
import pytest

from quadstep import Mission
from quadstep.bridges import autopilots
from quadstep.bridges.ardupilot import ArduPilot
from quadstep.bridges.autopilots import KINDS
from quadstep.bridges.link import PilotFunction, SensorSample, address
from quadstep.bridges.px4 import Px4
from quadstep.io.errors import UserError
from quadstep.mission.read import plan_mission, read_mission
from quadstep.numbers import Vector
from quadstep.numbers.rotations import rotation_matrix
from tests.autopilots import FAKES, HOVERING, Hover, free_port, listening
from tests.commands import quadstep, strict_json, without_figures, write
from tests.needs import package

package("pymavlink")

MISSION = HOVERING.format(duration=2.0, period=0.004)


def fake(name, mission, **how):
    kind, socket_kind = FAKES[name]
    pilot = kind(free_port(socket_kind), Hover(plan_mission(read_mission(mission), mission)), **how)
    pilot.start()
    return pilot


def refused(run):
    """After the line on what must match, one on the error."""
    lines = run.err.splitlines()
    return run.code == 2 and lines[-1].startswith("quadstep: error: ") and lines[0].startswith("quadstep: The autopilot's")


@pytest.mark.parametrize("name", FAKES)
def test_an_autopilot_flies_the_vehicle(tmp_path, monkeypatch, name):
    without_figures(monkeypatch)
    monkeypatch.setattr("quadstep.mission.schema.flight_jobs", lambda *_: [])
    mission = write(tmp_path, MISSION)
    pilot = fake(name, mission)
    run = quadstep("fly", mission, "--autopilot", name, "--connect", pilot.port, "--out", tmp_path / "out", "--json")
    pilot.stop.set()
    assert run.code == 0, run.err
    metrics = strict_json(tmp_path / "out" / "metrics.json")
    assert metrics["outcome"] == "completed"
    assert len(pilot.seen) >= 500  # 2 s at 250 Hz
    rows = np.genfromtxt(tmp_path / "out" / "flight.csv", delimiter=",", names=True)
    assert abs(rows["zm"] - 5.0).max() < 0.3
    assert pilot.still  # it stood until the motors lifted it
    assert "SERVO1_FUNCTION 33" in run.err or "CA_ROTOR0_PX" in run.err
    assert 0.01 < abs(rows["xm"][-1]) < 3.0  # the wind takes it along: no autopilot here knows where it is
    if name == "px4":
        for quantity in ("abs_pressure", "xmag", "temperature"):  # PX4 calls a sensor that repeats itself stale
            values = [getattr(one, quantity) for one in pilot.seen]
            assert sum(a == b for a, b in pairwise(values)) < 0.05 * len(values), quantity
        steps = np.diff([one.time_usec for one in pilot.seen])
        assert set(steps[-400:]) == {4000}
        assert pilot.fixes[0].lat == pytest.approx(473977420, abs=10)
    else:
        assert pilot.seen[-1]["position"][2] == pytest.approx(-rows["zm"][-1], abs=0.02)


def test_the_thrust_of_an_output_falls_with_the_battery(tmp_path, monkeypatch):
    """A pilot with no integral sinks as its battery empties: outputs are shares of the present full speed."""
    without_figures(monkeypatch)
    mission = write(tmp_path, f"{MISSION}[vehicle.effects]\nbattery = true\n[vehicle.battery]\ncapacity = 150.0\n")
    pilot = fake("ardupilot", mission)
    run = quadstep("fly", mission, "--autopilot", "ardupilot", "--connect", pilot.port, "--out", tmp_path / "out")
    pilot.stop.set()
    assert run.code == 0, run.err
    rows = np.genfromtxt(tmp_path / "out" / "flight.csv", delimiter=",", names=True)
    assert rows["voltageV"][-1] < 0.95 * rows["voltageV"][0]
    assert rows["zm"][-1] < rows["zm"][0] - 0.05


@pytest.mark.parametrize("name", FAKES)
def test_an_autopilot_is_compared_with_our_own_laws(tmp_path, monkeypatch, name):
    without_figures(monkeypatch)
    monkeypatch.setattr("quadstep.studies.comparison.cost.SAMPLES", 100)
    gusty = '[wind]\nturbulence = {intensity = "moderate"}'
    short = HOVERING.format(duration=1.5, period=0.004).replace("[wind]", gusty)
    ours = write(tmp_path, f'{short}[controller]\ntype = "pid"\n', "ours.toml")
    pilot = fake(name, ours, flights=3)
    theirs = write(tmp_path, f'{short}[controller]\ntype = "{name}"\nconnect = "{pilot.port}"\n', "theirs.toml")
    run = quadstep("compare", ours, theirs, "--seeds", "3", "--out", tmp_path / "out")
    pilot.stop.set()
    assert run.code == 0, run.err
    tables = [pq.read_table(path) for path in (tmp_path / "out" / "flights").iterdir()]
    flights = sorted((one for table in tables for one in table.to_pylist()), key=lambda one: one["controller"])
    assert [one["controller"] for one in flights] == ["ours"] * 3 + ["theirs"] * 3
    assert {one["outcome"] for one in flights} == {"completed"}
    assert len({one["position_rmse[m]"] for one in flights if one["controller"] == "theirs"}) == 3
    said = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "rotor speeds" in said  # what it commands
    assert (tmp_path / "out" / "page.html").exists()  # of ours


@pytest.mark.parametrize("name", FAKES)
def test_a_silent_autopilot_loses_the_flight(tmp_path, monkeypatch, name):
    monkeypatch.setattr("quadstep.mission.schema.flight_jobs", lambda *_: [])
    monkeypatch.setattr(f"quadstep.bridges.{name}.WAIT", 0.3)
    mission = write(tmp_path, MISSION)
    pilot = fake(name, mission, silent_after=500)
    link = {"ardupilot": ArduPilot, "px4": Px4}[name]
    said = autopilots.KINDS[name]._replace(link=lambda where, _: link(where, wait=0.3))
    monkeypatch.setitem(autopilots.KINDS, name, said)
    run = quadstep("fly", mission, "--autopilot", name, "--connect", pilot.port, "--out", tmp_path / "out")
    pilot.stop.set()
    assert run.code == 3, run.err
    assert re.search(r"stopped sending at [01]\.\d", run.out)
    assert "The log up to that point is kept" in " ".join(run.out.split())
    assert len((tmp_path / "out" / "flight.csv").read_text(encoding="utf-8").splitlines()) > 70


def test_a_closed_connection_loses_the_flight(tmp_path, monkeypatch):
    monkeypatch.setattr("quadstep.mission.schema.flight_jobs", lambda *_: [])
    mission = write(tmp_path, MISSION)
    pilot = fake("px4", mission, silent_after=300)
    wait = pilot.stop.wait
    monkeypatch.setattr(pilot.stop, "wait", lambda seconds: seconds < 1.0 and wait(seconds))  # it hangs up at once
    run = quadstep("fly", mission, "--autopilot", "px4", "--connect", pilot.port, "--out", tmp_path / "out")
    pilot.stop.set()
    assert run.code == 3, run.err
    assert re.search(r"PX4 closed the connection at [01]\.\d", run.out)
    assert len((tmp_path / "out" / "flight.csv").read_text(encoding="utf-8").splitlines()) > 70


@pytest.mark.parametrize("name", FAKES)
def test_what_is_no_autopilot_is_refused(tmp_path, name):
    mission = write(tmp_path, MISSION)
    pilot = fake(name, mission, garbage=True)
    run = quadstep("fly", mission, "--autopilot", name, "--connect", pilot.port, "--out", tmp_path / "out")
    pilot.stop.set()
    assert refused(run), run
    assert "malformed packet" in run.err or "does not speak MAVLink" in run.err
    assert not (tmp_path / "out").exists()


def test_bad_connections_are_one_line(tmp_path):
    mission = write(tmp_path, MISSION)
    out = ("--out", tmp_path / "out")
    for arguments, said in (
        (("--autopilot", "inav"), "--autopilot: unknown value 'inav'; allowed: px4, ardupilot, betaflight"),
        (("--autopilot", "px4", "--connect", "here:99999"), "the port should be a number from 1 to 65535"),
        (("--autopilot", "px4", "--connect", "::1"), "::1: IPv6 is not supported; allowed: PORT or HOST:PORT"),
        (("--autopilot", "px4", "--connect", "[::1]:4560"), "[::1]:4560: IPv6 is not supported"),
        (("--autopilot", "ardupilot", "--connect", "4560 "), "'4560 ': should have no spaces; allowed: PORT or HOST:PORT"),
        (("--connect", "4560"), "--connect: requires --autopilot"),
    ):
        run = quadstep("fly", mission, *arguments, *out)
        assert run.refused
        assert said in run.err
    run = quadstep("fly", mission, "--engine", "c", "--autopilot", "px4", "--connect", free_port(), *out)
    assert refused(run)  # at once: nothing listens there
    assert "is another program, which has no equations to export" in run.err
    for name, (_, kind) in FAKES.items():
        with socket.socket(socket.AF_INET, kind) as taken:
            taken.bind(("127.0.0.1", 0))
            port = taken.getsockname()[1]
            if kind is socket.SOCK_STREAM:
                taken.listen(1)
            run = quadstep("fly", mission, "--autopilot", name, "--connect", port, *out)
        assert refused(run)
        assert "cannot listen there: Address already in use" in run.err
    with pytest.raises(UserError, match="nothing from ArduPilot on 127"):
        ArduPilot(address(str(free_port()), 1), first_wait=0.1).meet(None)
    planar = write(
        tmp_path, '[vehicle]\ntype = "planar"\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 2.0\n', "p.toml"
    )
    run = quadstep("fly", planar, "--autopilot", "ardupilot", "--connect", free_port(), *out)
    assert run.refused
    assert not (tmp_path / "out").exists()
    assert address("", 9002) == ("127.0.0.1", 9002)
    assert address("0.0.0.0:1", 9002) == ("0.0.0.0", 1)


# On the ground, and what must match


class Scripted:
    """A link that answers with what a function makes of the sample's time; it keeps the samples."""

    period = 0.01

    def __init__(self, answer):
        self.answer, self.told, self.closed = answer, [], False

    def meet(self, sample):
        self.told.append(sample)

    def exchange(self, sample):
        self.told.append(sample)
        return self.answer(sample.time)

    def close(self):
        self.closed = True


MOVING = SensorSample(0.0, (1.0, 2.0, -3.0), (4.0, 0.0, 0.0), (0.6, 0.5, 0.4, 0.48), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))


def piloted(answer):
    link = Scripted(answer)
    return PilotFunction(lambda _: link), link


def test_a_vehicle_stands_until_the_rotors_carry_it():
    pilot, link = piloted(lambda time: [0.4] * 4 if time < 2.995 else [0.5] * 4)
    stages = []
    pilot.say = stages.append
    pilot.begin(MOVING, 4, 0.99)
    assert pilot.stood == pytest.approx(3.01)
    times = [one.time for one in link.told[1:]]
    np.testing.assert_allclose(times, 0.01 * np.arange(301))
    for one in link.told:
        assert (one.position, one.velocity, one.rates) == (MOVING.position, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        assert one.force == (0.0, 0.0, -9.80665)
        assert np.hypot(one.attitude[0], one.attitude[3]) == pytest.approx(1.0)
        assert one.attitude[3] / one.attitude[0] == pytest.approx(0.8)  # the heading stays
    assert stages[:2] == ["waiting for the autopilot", "standing until the autopilot takes off: 0 s of simulated time"]
    assert len(stages) == 5
    assert pilot(np.array([0.5] + [0.0] * 16)) == [0.5] * 4
    assert link.told[-1].time == pytest.approx(3.51)  # the autopilot's clock goes on


def test_an_autopilot_that_never_takes_off_is_told_of(monkeypatch):
    monkeypatch.setattr("quadstep.bridges.link.STANDING", 1.0)
    pilot, link = piloted(lambda _: [0.4] * 4)
    with pytest.raises(UserError, match="did not take off within 1 s of simulated time"):
        pilot.begin(MOVING, 4, 0.99)
    assert link.closed


def test_an_interrupted_flight_keeps_its_log(request):
    """Ctrl-C is told of wherever it comes: an exception in a call from compiled code would be lost."""
    pilot, _ = piloted(lambda _: [0.5] * 4)
    request.addfinalizer(partial(signal.signal, signal.SIGINT, signal.getsignal(signal.SIGINT)))
    signal.signal(signal.SIGINT, before := signal.default_int_handler)  # where tests run in the background it may be ignored
    pilot.kept = True
    pilot.begin(MOVING, 4, 0.99)
    assert pilot(np.array([0.5] + [0.0] * 16)) == [0.5] * 4
    os.kill(os.getpid(), signal.SIGINT)
    assert np.isnan(pilot(np.array([2.5] + [0.0] * 16))).all()
    assert pilot.lost == "Interrupted at 2.5 s"
    assert np.isnan(pilot(np.array([2.6] + [0.0] * 16))).all()
    assert pilot.lost == "Interrupted at 2.5 s"
    pilot.end()
    assert signal.getsignal(signal.SIGINT) is before


def around(*rotors):
    """Rotors at angles to the right of the nose [deg], with their spins."""
    at = [(0.25 * np.cos(np.radians(angle)), -0.25 * np.sin(np.radians(angle)), spin) for angle, spin in rotors]
    return {"preset": "x500", "rotors": [{"position": [float(x), float(y), 0.0], "spin": spin} for x, y, spin in at]}


@pytest.mark.parametrize(("vehicle", "frame", "motors"), [
    ({"preset": "x500"}, 1, [33, 34, 35, 36]),
    ({"preset": "crazyflie"}, 1, [33, 36, 34, 35]),
    (around((0, "cw"), (90, "ccw"), (180, "cw"), (270, "ccw")), 0, [35, 33, 36, 34]),
    (around((45, "cw"), (135, "ccw"), (225, "cw"), (315, "ccw")), 18, [34, 33, 35, 36]),
])  # fmt: skip
def test_frame_and_motors_of_the_vehicle_are_named(vehicle, frame, motors):
    plan = Mission(vehicle=vehicle, path={"type": "step", "end": [0.0, 0.0, 5.0], "duration": 2.0}).plan()
    found = KINDS["ardupilot"].matching(plan.parameters, plan.loop.plant.geometry)
    assert found.parameters["MOT_THST_EXPO"] == 1.0
    assert found.parameters["FRAME_TYPE"] == frame
    assert [found.parameters[f"SERVO{i}_FUNCTION"] for i in range(1, 5)] == motors
    assert f"FRAME_TYPE {frame:g}\n" in found.text()
    px4 = KINDS["px4"].matching(plan.parameters, plan.loop.plant.geometry)
    for i, mount in enumerate(plan.loop.plant.geometry.mounts):
        assert px4.parameters[f"CA_ROTOR{i}_PX"] == mount.position[0]
        assert px4.parameters[f"CA_ROTOR{i}_PY"] == -mount.position[1]
        assert np.sign(px4.parameters[f"CA_ROTOR{i}_KM"]) == mount.spin  # positive: counter-clockwise
    assert "1\t1\tCA_ROTOR_COUNT\t4\t6\n" in px4.text()
    assert "1\t1\tTHR_MDL_FAC\t1\t9\n" in px4.text()


# Setpoints

ORBIT = """
vehicle = { preset = "x500" }
path = { type = "circle", centre = [0.0, 0.0, 5.0], radius = 2.0, period = 6.0 }
simulation = { duration = 0.5 }
"""


@pytest.mark.parametrize("kind", ["position", "attitude", "rates"])
def test_a_path_is_sent_and_nothing_else(tmp_path, kind):
    mission, port = write(tmp_path, ORBIT), free_port()
    vehicle, stop = listening(port)
    where = f"udpin:127.0.0.1:{port}"
    run = quadstep("serve-setpoints", mission, "--connect", where, "--kind", kind, "--rate", "40", "--hold", "0.25")
    stop.set()
    assert run.code == 0, run.err
    assert "arming and switching to offboard or guided mode are up to you" in run.err
    assert "Sent 31 setpoints over 0.5 s, and the path's last point for 0.25 s. No more setpoints follow" in " ".join(
        run.out.split()
    )
    heard = []
    while (message := vehicle.recv_match(blocking=True, timeout=0.3)) is not None:
        heard.append(message)
    vehicle.close()
    wanted = "SET_POSITION_TARGET_LOCAL_NED" if kind == "position" else "SET_ATTITUDE_TARGET"
    assert {one.get_type() for one in heard} == {wanted}
    assert len(heard) == 31
    assert {one.target_system for one in heard} == {7}
    first, last, held = heard[0], heard[20], heard[-1]
    plan = plan_mission(read_mission(mission), mission)
    if kind == "position":
        reference = plan.loop.path.reference(0.5, plan.parameters.path)
        x, y, z = reference.position
        assert (last.x, last.y, last.z) == pytest.approx((x, -y, -z), abs=1e-5)
        assert last.yaw == pytest.approx(-reference.yaw, abs=1e-5)
        assert last.type_mask == 0
        assert (held.x, held.y, held.z, held.yaw) == (last.x, last.y, last.z, last.yaw)
        assert (held.vx, held.vy, held.vz, held.afx, held.afy, held.afz, held.yaw_rate) == (0.0,) * 7
        assert np.hypot(last.vx, last.vy) > 0.05
    else:
        mass, gravity = plan.parameters.airframe.mass, plan.parameters.airframe.gravity
        full = 4 * plan.parameters.allocation.most
        x, y, z = plan.loop.path.reference(0.5, plan.parameters.path).acceleration
        pull = np.array([x, -y, -(z + gravity)])  # north, east, down
        assert last.thrust == pytest.approx(mass * np.linalg.norm(pull) / full, rel=1e-5)
        down = np.array(list(rotation_matrix(Vector(last.q)) @ Vector((0.0, 0.0, 1.0))))
        np.testing.assert_allclose(down, -pull / np.linalg.norm(pull), atol=1e-5)
        assert held.thrust == pytest.approx(mass * gravity / full, rel=1e-5)
        assert first.type_mask == (7 if kind == "attitude" else 128)


@pytest.mark.parametrize("kind", ["attitude", "rates"])
def test_an_ardupilot_that_takes_thrust_for_a_climb_rate_is_sent_none(tmp_path, kind, monkeypatch):
    """Hover's share of x500 is 0.46: half a climb rate is 0.5, so it would sink."""
    monkeypatch.setattr("quadstep.bridges.setpoints.HEARTBEAT_WAIT", 1.0)
    mission = write(tmp_path, ORBIT)
    for options, said in (
        (1, f"--kind {kind}: ArduPilot takes the thrust for a climb rate, as GUID_OPTIONS is 1; set it to 9, or use --kind"),
        (None, f"--kind {kind}: ArduPilot did not say its GUID_OPTIONS"),
        (9, None),
    ):
        port = free_port()
        vehicle, stop = listening(port, 3, options)
        line = ("serve-setpoints", mission, "--connect", f"udpin:127.0.0.1:{port}", "--hold", "0.1", "--kind")
        run = quadstep(*line, kind)
        assert (said is None) == (run.code == 0), run.err
        assert said is None or said in run.err
        stop.set()
        vehicle.close()


def test_setpoints_refuse_bad_input(tmp_path, monkeypatch):
    monkeypatch.setattr("quadstep.bridges.setpoints.HEARTBEAT_WAIT", 0.2)
    mission = write(tmp_path, ORBIT)
    for arguments, said in (
        (("--kind", "jerk"), "--kind: unknown value 'jerk'; allowed: position, attitude, rates"),
        (("--rate", "1"), "--rate: should be from 2 to 200, not 1"),
        (("--rate", "nan"), "--rate: should be from 2 to 200, not nan"),
        (("--hold", "-1"), "--hold: should be from 0 to 3600, not -1"),
        (("--connect", f"udpin:127.0.0.1:{free_port()}"), "no heartbeat from a vehicle within 0.2 s"),
        (("--connect", "nonsense:"), "cannot be opened"),
        (("--connect", "udpin:::1:14540"), "--connect udpin:::1:14540: IPv6 is not supported; allowed: udpin:HOST:PORT"),
        (("--connect", "udpin:127.0.0.1:14540 "), "--connect 'udpin:127.0.0.1:14540 ': should have no spaces"),
        (("--connect", "tcp:127.0.0.1:1"), "cannot be opened: Connection refused"),
    ):
        run = quadstep("serve-setpoints", mission, *arguments)
        assert run.refused
        assert said in run.err
