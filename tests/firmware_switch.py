"""What an export does in flight under the real PX4 and ArduCopter: switched in and back, gains changed, logs read."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink import mavutil

from quadstep.identify.logs.read import read_log, read_topics
from quadstep.identify.replay import law_of
from quadstep.mission.listings import load_preset

AUX, SET_INTERVAL, SET_MODE, ARM, TAKE_OFF = 218, 511, 176, 400, 22
"""MAV_CMD."""

GUIDED, PLACE_AND_HEADING = 4, 0b100111111000
"""A mode of ArduCopter, and what of a setpoint counts."""

OFFBOARD, PAYLOAD_PORT = 6, 14030
"""PX4's main mode, and where its instance 0 speaks to an onboard computer of its payload, over UDP."""

ON, CHANGED, OFF = 12.0, 8.0, 8.0
"""Seconds after lift-off at which ArduPilot's switch is used, and from there until gains are halved and it is used again."""

LONGEST = 300.0
"""Seconds of the autopilot's time in which something that is waited for happens."""


class Ground:
    """Somebody on the ground who hears where the vehicle is, by the autopilot's clock."""

    def __init__(self, where: str) -> None:
        for attempt in range(60):
            try:
                self.link: Any = mavutil.mavlink_connection(where, source_system=254)
                break
            except OSError:
                assert attempt < 59
                time.sleep(1.0)
        self.now, self.place, self.mode, self.values = 0.0, np.full(4, np.nan), -1, dict[str, float]()
        self.link.wait_heartbeat(timeout=120.0)
        for message in (mavutil.mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, mavutil.mavlink.MAVLINK_MSG_ID_ATTITUDE):
            self.command(SET_INTERVAL, message, 2e4)

    def command(self, number: int, *parameters: float) -> None:
        target = self.link.target_system, self.link.target_component
        self.link.mav.command_long_send(*target, number, 0, *parameters, *(0.0,) * (7 - len(parameters)))

    def heard(self) -> None:
        """Takes in the next message."""
        message = self.link.recv_match(blocking=True, timeout=60.0)
        assert message, "the autopilot is silent"
        if message.get_type() == "LOCAL_POSITION_NED":
            self.now, self.place = 1e-3 * message.time_boot_ms, np.array([message.x, message.y, message.z, self.place[3]])
        elif message.get_type() == "ATTITUDE":
            self.place = np.append(self.place[:3], message.yaw)
        elif message.get_type() == "HEARTBEAT" and message.autopilot != 8:
            self.mode = message.custom_mode
        elif message.get_type() == "PARAM_VALUE":
            self.values[message.param_id] = message.param_value

    def until(self, what: Callable[[], bool], longest: float = LONGEST) -> np.ndarray:
        """Waits for something; where the vehicle was meanwhile, north, east, down [m], heading [rad], (n, 4)."""
        start, places = self.now, []
        while not what():
            self.heard()
            places.append(self.place)
            assert self.now - start < longest or not start, "it does not happen"
        return np.array(places)

    def at(self, time: float) -> np.ndarray:
        return self.until(lambda: self.now >= time)

    def wait(self, seconds: float) -> np.ndarray:
        return self.at(self.now + seconds)

    def go(self, place: np.ndarray) -> None:
        """A setpoint: north, east, down [m], heading [rad]."""
        target = self.link.target_system, self.link.target_component
        self.link.mav.set_position_target_local_ned_send(
            0, *target, mavutil.mavlink.MAV_FRAME_LOCAL_NED, PLACE_AND_HEADING, *place[:3], *(0.0,) * 6, place[3], 0.0
        )

    def scale(self, name: str, by: float) -> None:
        """Multiplies a parameter, by PARAM_SET; it is asked for again until the autopilot says so."""
        target = self.link.target_system, self.link.target_component
        while name not in self.values:
            self.link.mav.param_request_read_send(*target, name.encode(), -1)
            self.wait(0.3)
        wanted = by * self.values[name]
        while abs(self.values[name] - wanted) > 1e-5 * abs(wanted):
            self.link.mav.param_set_send(*target, name.encode(), wanted, 9)
            self.wait(0.3)


def switched_in_ardupilot(now: Any) -> str:
    """By RC option 109, and gains of the attitude halved in between; when, in a line."""
    ground = Ground(now.beside)
    said = {}
    ground.at(now.stood)
    for name, later in (("on", ON), ("changed", CHANGED), ("off", OFF)):
        ground.wait(later)
        if name == "changed":
            for axis in "XY":
                ground.scale(f"CC{now.number}_ATT_{axis}", 0.5)
        else:
            ground.command(AUX, 109, 2 if name == "on" else 0)
        said[name] = round(ground.now - now.stood, 2)
    ground.wait(4.0)
    os.kill(now.flight.pid, signal.SIGINT)
    return f"marks {json.dumps(said)} end"


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def told_of_ardupilot(rows: np.ndarray, text: str, folder: Path) -> str:
    """Distances from the path around the switch, and what the log of the vehicle says."""
    marks = json.loads(re.search(r"marks (.*?) end", text)[1])  # type: ignore[index]
    away = 1e3 * np.sqrt(sum((rows[f"{a}m"] - rows[f"{a}_dm"]) ** 2 for a in "xyz"))

    def within(first: float, last: float) -> np.ndarray:
        found: np.ndarray = away[(rows["ts"] >= first) & (rows["ts"] < last)]
        return found

    on, changed, off = (marks[name] for name in ("on", "changed", "off"))
    log = max(folder.rglob("*.BIN"))
    topics = read_topics(log, ["ATT.DesRoll", "ATT.Roll", "ATT.DesPitch", "ATT.Pitch", "QSTP.TX"]).columns
    clock, flew = topics["ATT.Roll"].time, topics["QSTP.TX"].time
    gaps = np.flatnonzero(np.diff(flew) > 1.0)
    assert not len(gaps), "the law did not fly throughout"
    start = flew[0] - on
    errors = np.stack([topics[f"ATT.Des{a}"].value - topics[f"ATT.{a}"].value for a in ("Roll", "Pitch")], axis=1)

    def attitude(first: float, last: float) -> float:
        return rms(errors[(clock >= start + first) & (clock < start + last)])

    before, after = attitude(on + 2.0, changed), attitude(changed + 1.0, off)
    assert after > 1.3 * before, f"the gains changed nothing: {before:.2f}, {after:.2f} degrees"
    return (
        f"ArduPilot's own before {rms(within(on - 4.0, on)):.0f} mm, first 2 s {rms(within(on, on + 2.0)):.0f} (largest "
        f"{within(on, on + 2.0).max():.0f}), then {rms(within(on + 2.0, changed)):.0f}, gains of attitude halved "
        f"{rms(within(changed + 1.0, off)):.0f}, first 2 s back {rms(within(off, off + 2.0)):.0f} (largest "
        f"{within(off, off + 2.0).max():.0f}); attitude error {before:.2f} deg, {after:.2f} with halved gains; {logged(log)}"
    )


def logged(log: Path) -> str:
    """What `replay` says of the law in a log. Fails where it logged nothing."""
    said = law_of(read_log(log), load_preset("x500"))
    assert said, "the law is not in the log"
    return said


def farthest(places: np.ndarray, start: np.ndarray) -> float:
    """In millimetres."""
    return 1e3 * float(np.linalg.norm((places - start)[:, :3], axis=1).max())


def exercised_in_ardupilot(now: Any) -> str:
    """Hover, a step, a turn, by ArduPilot's own controller and by the export; then GPS is lost."""
    ground, said = Ground(now.beside), []
    for _ in range(60):
        for command in ((SET_MODE, 1, GUIDED), (ARM, 1), (TAKE_OFF, 0, 0, 0, 0, 0, 0, 2.5)):
            ground.command(*command)
        ground.wait(2.0)
        if ground.place[2] < -0.3:
            break
    ground.until(lambda: bool(ground.place[2] < -2.3))
    ground.wait(5.0)
    for switch, who in ((0, "ArduPilot's own"), (2, "the export")):
        ground.command(AUX, 109, switch)
        goal = ground.place
        ground.go(goal)
        said.append(f"{who}: hover for 15 s within {farthest(ground.wait(15.0), goal):.0f} mm")
        for what, change in (("step", (1.0, 0.0, 0.0, 0.0)), ("turn", (0.0, 0.0, 0.0, 0.5 * np.pi))):
            goal = goal + change
            ground.go(goal)
            ground.wait(3.0)
            errors = ground.wait(3.0) - goal
            heading = np.degrees(rms(np.remainder(errors[:, 3] + np.pi, 2.0 * np.pi) - np.pi))
            said.append(f"{what} {1e3 * np.sqrt(3.0) * rms(errors[:, :3]):.0f} mm, {heading:.1f} deg")
    ground.scale("SIM_GPS1_ENABLE", 0.0)
    lost = ground.now
    ground.until(lambda: ground.mode != GUIDED, 120.0)
    said.append(f"GPS off: ArduPilot left GUIDED for mode {ground.mode} after {ground.now - lost:.1f} s")
    start = ground.place
    places = ground.wait(3.0)
    said.append(f"in the next 3 s it sank by {places[-1, 2] - start[2]:.1f} m and went {farthest(places, start):.0f} mm")
    os.kill(now.flight.pid, signal.SIGINT)
    return f"told {'; '.join(said)} end"


def in_px4(now: Any) -> Callable[..., str]:
    """What PX4's shell says to a command."""

    def shell(*words: str) -> str:
        line = [str(now.program.parent / f"px4-{words[0]}"), "--instance", str(now.instance), *words[1:]]
        done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=600.0)
        return " ".join((done.stdout + done.stderr).split())

    return shell


def taken_off(ground: Ground, shell: Callable[..., str]) -> None:
    """By PX4 itself, to its take-off height."""
    for _ in range(40):
        shell("commander", "takeoff")
        ground.wait(2.0)
        if ground.place[2] < -0.3:
            break
    ground.until(lambda: bool(ground.place[2] < -2.2))


HOVER = """vehicle = { preset = "x500" }
path = { type = "circle", centre = [0.0, 0.0, 10.0], radius = 0.001, period = 10.0 }
simulation = { duration = 5.0 }
"""


def left_by_setpoints(now: Any) -> str:
    """Offboard by `quadstep serve-setpoints`, and what PX4 does once it has ended, by its parameters."""
    ground, said, shell = Ground(now.beside), [], in_px4(now)
    ground.until(lambda: bool(np.isfinite(ground.place).all()))
    ground.wait(12.0)
    taken_off(ground, shell)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "hover.toml").write_text(HOVER, encoding="utf-8")
        line = [sys.executable, "-m", "quadstep", "serve-setpoints", "hover.toml", "--hold", "2"]
        line += ["--connect", f"udpin:127.0.0.1:{PAYLOAD_PORT + now.instance}"]
        for action, speed in ((5, 0.7), (0, 0.7), (0, 0.4)):
            shell("param", "set", "COM_OBL_RC_ACT", str(action))
            shell("param", "set", "MPC_LAND_SPEED", str(speed))
            with subprocess.Popen(line, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as served:
                while served.poll() is None:
                    if ground.mode >> 16 & 255 != OFFBOARD:
                        shell("commander", "mode", "offboard")
                    ground.wait(0.5)
            ground.until(lambda: ground.mode >> 16 & 255 != OFFBOARD, 10.0)
            mode = shell("listener", "vehicle_status", "1").partition("nav_state: ")[2].split()[0]
            ground.wait(2.0)
            places = ground.wait(4.0)
            sank, went = (places[-1] - places[0])[2] / 4.0, np.linalg.norm((places[-1] - places[0])[:2])
            said.append(
                f"COM_OBL_RC_ACT {action}, MPC_LAND_SPEED {speed}: nav_state {mode}, in 4 s it sank at {sank:.2f} m/s and "
                f"went {1e3 * went:.0f} mm"
            )
            shell("commander", "mode", "auto:loiter")
    os.kill(now.flight.pid, signal.SIGINT)
    return f"told {'; '.join(said)} end"


def switched_in_px4(now: Any) -> str:
    """Take-off and hover by PX4 itself; its mode, gains halved, paths that a module publishes, back; and GPS is lost."""
    ground, said, shell = Ground(now.beside), [], in_px4(now)

    def flown_path(*words: str) -> str:
        return shell("quadstep_path", *words).split("half: ")[-1]

    def nav() -> tuple[int, int]:
        return ground.mode >> 16 & 255, ground.mode >> 24

    ground.until(lambda: bool(np.isfinite(ground.place).all()))
    ground.wait(12.0)
    shell("quadstep_control", "start")
    taken_off(ground, shell)
    ground.wait(10.0)
    own = nav()
    start = ground.place
    shell("commander", "mode", "ext1")
    places = ground.wait(15.0)
    assert nav() != own, "the mode was not entered"
    ours = nav()
    said.append(f"largest distance in 15 s from where it was at entry {farthest(places, start):.0f} mm")
    if (now.program.parent / "px4-quadstep_path").exists():
        for words in (("step", "1.0", "6"), ("yaw", "90", "6"), ("circle", "2.0", "20")):
            said.append(f"{words[0]}: {flown_path(*words)}")
            ground.wait(0.1)
        for axis in "XY":
            ground.scale(f"QS_POS_{axis}", 0.5)
        said.append(f"circle with halved position gains: {flown_path('circle', '2.0', '20')}")
        ground.wait(3.0)
    ground.wait(5.0)
    said.append(f"stop: {'refused' if 'armed' in shell('quadstep_control', 'stop') else 'NOT REFUSED'}")
    assert nav() == ours
    start = ground.place
    shell("commander", "mode", "auto:loiter")
    places = ground.wait(8.0)
    assert nav() != ours
    said.append(f"in 8 s back {farthest(places, start):.0f} mm")
    shell("commander", "mode", "ext1")
    ground.wait(4.0)
    assert nav() == ours
    shell("failure", "gps", "off")
    lost = ground.now
    ground.until(lambda: nav() != ours, 60.0)
    said.append(f"GPS off: PX4 left the mode after {ground.now - lost:.1f} s, {-ground.place[2]:.1f} m high")
    os.kill(now.flight.pid, signal.SIGINT)
    return f"told {'; '.join(said)} end"


def told_alone(_: np.ndarray, text: str, __: Path) -> str:
    """What was said in flight."""
    said = re.search(r"told (.*?) end", text)
    assert said, text
    return said[1]


def told(rows: np.ndarray, text: str, folder: Path) -> str:
    """What was said in flight, and what the log says of the law."""
    return f"{told_alone(rows, text, folder)}; {logged(max([*folder.rglob('*.ulg'), *folder.rglob('*.BIN')]))}"
