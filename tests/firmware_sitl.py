"""What the real PX4 and ArduCopter fly under `quadstep fly --autopilot ... --pilot`, on loopback: part of `make firmware`."""

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.io.parameter_files import FORMATS
from tests.firmware_scenarios import AFTER, COMPLETED, SCENARIOS, SITL, Flying, Scenario, Sitl

LIMIT = 900.0
"""Seconds that a flight may take on a busy machine."""


class Row(NamedTuple):
    """A scenario's result: FAILED at its beginning where another was expected. rmse [mm]: once settled. speed: the autopilot's
    seconds in one of both programs' processor time, start and figures included.
    """

    result: str
    rmse: str = ""
    speed: str = ""

    def __str__(self) -> str:
        return f"{self.result} | {self.rmse} | {self.speed}"


def rows(target: str, tree: Path, wanted: re.Pattern[str]) -> Iterator[tuple[str, Row]]:
    """The scenarios of an autopilot whose name is wanted, and their results; builds the simulator where it is not built."""
    sitl = SITL[target]
    program = tree / sitl.program
    names = [one for one in SCENARIOS if one.only in ("", target) and wanted.search(f"{target}: {one.name}")]
    if names and not program.is_file():
        for line in sitl.build:
            done = subprocess.run(line.split(), cwd=tree, capture_output=True, text=True, check=False)
            if done.returncode:
                last = (done.stderr.strip() or done.stdout.strip() or "no reason").splitlines()[-1]
                yield "every flight", Row(f"FAILED: `{line}`: {last}")
                return
    for one in names:
        if one.asks and not ((program.parent / one.asks).exists() or one.asks.encode() in program.read_bytes()):
            yield one.name, Row(f"not flown: the tree is built without {one.asks}")
            continue
        with tempfile.TemporaryDirectory() as place:
            yield one.name, flown(target, program, one, Path(place))


def instance(sitl: Sitl) -> tuple[int, list[int]]:
    """An autopilot's number of which all ports are free, from 1 on, and they."""
    for number in range(1, 9):
        ports = [first + number * by for first, by, _ in sitl.ports]
        with contextlib.ExitStack() as stack, contextlib.suppress(OSError):
            for port, (_, _, kind) in zip(ports, sitl.ports, strict=True):
                probe = stack.enter_context(socket.socket(socket.AF_INET, kind))
                if kind == socket.SOCK_STREAM:  # the system keeps the port of a flight that has ended for a minute
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind(("127.0.0.1", port))
            return number, ports
    raise AssertionError(f"no free ports for {sitl.title}")


def started(
    target: str, program: Path, number: int, parameters: Path | None, folder: Path, more: Mapping[str, float]
) -> subprocess.Popen[bytes]:
    """The autopilot, alone in a folder, as docs/autopilot.md says; PX4's parameters are defaults of its airframe."""
    place, environment = folder / "autopilot", dict(os.environ)
    place.mkdir()
    if target == "px4":
        shutil.copytree(program.parent.parent / "etc", folder / "etc")
        airframe = folder / "etc/init.d-posix/airframes/10016_none_iris"
        lines = dict(FORMATS.load("px4").read(parameters.read_text(encoding="utf-8")).values if parameters else {}) | dict(
            more
        )
        with airframe.open("a", encoding="utf-8") as file:
            file.writelines(f"param set-default {name} {value:.9g}\n" for name, value in lines.items())
        line, environment["PX4_SIM_MODEL"] = [str(program), "-d", "-i", str(number), str(folder / "etc")], "none_iris"
    else:
        line = [str(program), "--model", "JSON:127.0.0.1", "-I", str(number)]
        beside = folder / "more.parm"
        beside.write_text("".join(f"{name} {value:g}\n" for name, value in more.items()), encoding="utf-8")
        line += ["--defaults", f"{parameters},{beside}"] if parameters else []
    with (folder / "autopilot.txt").open("wb") as said:
        return subprocess.Popen(line, cwd=place, env=environment, stdin=subprocess.DEVNULL, stdout=said, stderr=said)


def flown(target: str, program: Path, one: Scenario, folder: Path) -> Row:
    """A scenario, and its result."""
    sitl = SITL[target]
    number, (port, mavlink, *more) = instance(sitl)
    reached = sitl.reached.format(mavlink)
    beside = sitl.reached.format(*more) if more and one.pilot else reached  # ArduPilot waits for the first to be called
    text = '[vehicle]\npreset = "x500"\n[path]\ntype = "circle"\ncentre = [0.0, 0.0, 10.0]\n'
    mission, out = folder / "mission.toml", folder / "out"
    text = f"{text}radius = {one.radius:g}\n{sitl.mission}{one.more}"
    lasting = one.lasts or not one.pilot
    mission.write_text(re.sub(r"duration = \S+", "duration = 600.0", text) if lasting else text, encoding="utf-8")
    line = [sys.executable, "-m", "quadstep", "fly", mission, "--autopilot", target, "--out", out, "--connect", port]
    line += ["--connect-timeout", LIMIT, *(["--pilot", "--pilot-connect", reached] if one.pilot else [])]
    flight = subprocess.Popen(
        list(map(str, line)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heeding,  # noqa: PLW1509
        env={**os.environ, "COLUMNS": "10000"},
    )  # fmt: skip
    timer = threading.Timer(LIMIT, flight.kill)
    timer.start()
    over = threading.Event()
    autopilot, told, extra, stood = None, [], "", 0.0
    try:
        assert flight.stderr
        assert flight.stdout
        for raw in flight.stderr:
            told.append(raw.decode())
            if autopilot is None:  # its first line: what the parameters must be; they are written by then, or soon
                parameters = mission.parent / sitl.parameters
                while not (parameters.exists() or gone(flight.pid)):
                    time.sleep(0.05)
                if not parameters.exists():  # it is refused
                    continue
                autopilot = started(target, program, number, parameters if one.loaded else None, folder, one.parameters)
                threading.Thread(target=ended, args=(over, out, autopilot.pid), daemon=True).start()
                if not one.pilot:
                    extra = acted(one, Flying(flight, autopilot, program, number, 0.0, beside))
            lifted = re.search(r"lifted off after (\S+) s", told[-1])
            if lifted:
                stood = float(lifted[1])
                time.sleep(AFTER)
                extra = acted(one, Flying(flight, autopilot, program, number, stood, beside))
        told.append(flight.stdout.read().decode())
        _, status, spent = os.wait4(flight.pid, 0)
        flight.returncode = os.waitstatus_to_exitcode(status)
        seconds = spent.ru_utime + spent.ru_stime
    finally:
        timer.cancel()
        flight.kill()
        over.set()
        if autopilot:
            os.kill(autopilot.pid, signal.SIGKILL)
            _, _, spent = os.wait4(autopilot.pid, 0)
            autopilot.returncode = -signal.SIGKILL
    return judged(
        one, flight.returncode, "".join(told) + extra, folder, sitl.settled, stood, seconds + spent.ru_utime + spent.ru_stime
    )


def acted(one: Scenario, now: Flying) -> str:
    """What is done in flight; where it fails, why, and the flight ends."""
    try:
        return one.act(now)
    except AssertionError as wrong:
        os.kill(now.flight.pid, signal.SIGINT)
        return f"in flight: {wrong}"


def gone(process: int) -> bool:
    """Whether a process has ended, which is still to be waited for."""
    return os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def ended(over: threading.Event, out: Path, autopilot: int) -> None:
    """Kill the autopilot once the flight is over and its figures are begun: PX4 never sleeps where its simulator has gone."""
    while not over.wait(0.02):
        with contextlib.suppress(FileNotFoundError):  # the folder goes where the flight is refused
            if any(out.glob(".writing-*/figures")):
                os.kill(autopilot, signal.SIGKILL)
                return


def heeding() -> None:
    """A process started in the background may be deaf to Ctrl-C."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def judged(one: Scenario, code: int, told: str, folder: Path, settled: float, stood: float, seconds: float) -> Row:
    """The row. seconds: of both programs' processor time."""
    text = " ".join(told.split())
    said = re.search(one.said, text)
    rows = np.genfromtxt(folder / "out" / "flight.csv", delimiter=",", names=True) if code in (0, 3) else None
    if code != one.code or not said or (code == 3 and (rows is None or not rows.shape)):
        words = folder / "autopilot.txt"
        lines = words.read_text(encoding="utf-8", errors="replace").split("\n") if words.exists() else []
        last = [line.strip() for line in lines if line.strip()][-1:]
        return Row(f"FAILED: exit code {code}: {text[-300:]}{''.join(f'; the autopilot said last: {one}' for one in last)}")
    rmse = speed = ""
    if rows is not None:
        speed = f"{(stood + rows['ts'][-1]) / seconds:.1f}"
        kept = rows["ts"] >= settled
        if code == 0:
            rmse = f"{1e3 * np.sqrt(sum(np.mean((rows[f'{a}m'] - rows[f'{a}_dm'])[kept] ** 2) for a in 'xyz')):.0f}"
    result = "completed" if one.said == COMPLETED else f'"{said[0]}"'
    if one.tell:
        assert rows is not None
        try:
            return Row(one.tell(rows, text, folder), rmse, speed)
        except (AssertionError, ValueError, TypeError) as wrong:
            return Row(f"FAILED: {wrong}: {text[-300:]}")
    return Row(result + (f", exit code {code}" if code else ""), rmse, speed)
