"""What an export does in flight under the real PX4 and ArduCopter: switched in and back, gains changed, logs read."""

import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink import mavutil

from quadstep.identify.logs.read import read_log, read_topics
from quadstep.identify.replay import law_of
from quadstep.mission.listings import load_preset

AUX, SET_INTERVAL, LOCAL_POSITION = 218, 511, 32
"""MAV_CMD, and a message's number."""

ON, CHANGED, OFF = 12.0, 20.0, 28.0
"""Seconds after lift-off at which ArduPilot's switch is used, gains are halved, and the switch is used again."""

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
        self.now, self.place, self.mode, self.values = 0.0, np.full(3, np.nan), -1, dict[str, float]()
        self.link.wait_heartbeat(timeout=120.0)
        self.command(SET_INTERVAL, LOCAL_POSITION, 2e4)

    def command(self, number: int, *parameters: float) -> None:
        target = self.link.target_system, self.link.target_component
        self.link.mav.command_long_send(*target, number, 0, *parameters, *(0.0,) * (7 - len(parameters)))

    def heard(self) -> None:
        """Takes in the next message."""
        message = self.link.recv_match(blocking=True, timeout=60.0)
        assert message, "the autopilot is silent"
        if message.get_type() == "LOCAL_POSITION_NED":
            self.now, self.place = 1e-3 * message.time_boot_ms, np.array([message.x, message.y, message.z])
        elif message.get_type() == "HEARTBEAT" and message.autopilot != 8:
            self.mode = message.custom_mode
        elif message.get_type() == "PARAM_VALUE":
            self.values[message.param_id] = message.param_value

    def until(self, what: Callable[[], bool], longest: float = LONGEST) -> np.ndarray:
        """Waits for something; where the vehicle was meanwhile, north, east, down [m], (n, 3)."""
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

    def halve(self, name: str) -> None:
        """Half of a parameter, by PARAM_SET; it is asked for again until the autopilot says so."""
        target = self.link.target_system, self.link.target_component
        while name not in self.values:
            self.link.mav.param_request_read_send(*target, name.encode(), -1)
            self.wait(0.3)
        half = 0.5 * self.values[name]
        while abs(self.values[name] - half) > 1e-5 * abs(half):
            self.link.mav.param_set_send(*target, name.encode(), half, 9)
            self.wait(0.3)


def switched_in_ardupilot(now: Any) -> str:
    """By RC option 109, and gains of the attitude halved in between; when, in a line."""
    ground = Ground(now.beside)
    said = {}
    for name, at in (("on", ON), ("changed", CHANGED), ("off", OFF)):
        ground.at(now.stood + at)
        if name == "changed":
            for axis in "XY":
                ground.halve(f"CC{now.number}_ATT_{axis}")
        else:
            ground.command(AUX, 109, 2 if name == "on" else 0)
        said[name] = round(ground.now - now.stood, 2)
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
    return 1e3 * float(np.linalg.norm(places - start, axis=1).max())


def switched_in_px4(now: Any) -> str:
    """Take-off and hover by PX4 itself; its mode, gains halved, paths that a module publishes, back; and GPS is lost."""
    ground, said = Ground(now.beside), []

    def shell(*words: str) -> str:
        line = [str(now.program.parent / f"px4-{words[0]}"), "--instance", str(now.instance), *words[1:]]
        done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=600.0)
        return " ".join((done.stdout + done.stderr).split())

    def nav() -> tuple[int, int]:
        return ground.mode >> 16 & 255, ground.mode >> 24

    ground.until(lambda: bool(np.isfinite(ground.place).all()))
    ground.wait(12.0)
    shell("quadstep_control", "start")
    for _ in range(20):
        shell("commander", "takeoff")
        ground.wait(2.0)
        if ground.place[2] < -0.3:
            break
    ground.until(lambda: bool(ground.place[2] < -2.2))
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
            said.append(f"{words[0]}: {shell('quadstep_path', *words)[-60:]}")
            ground.wait(0.1)
        for axis in "XY":
            ground.halve(f"QS_POS_{axis}")
        said.append(f"circle with halved position gains: {shell('quadstep_path', 'circle', '2.0', '20')[-60:]}")
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


def told_of_px4(_: np.ndarray, text: str, folder: Path) -> str:
    return f"{re.search(r'told (.*?) end', text)[1]}; {logged(max(folder.rglob('*.ulg')))}"  # type: ignore[index]
