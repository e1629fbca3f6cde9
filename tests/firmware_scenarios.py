"""What real autopilots are asked to fly: their simulators, and the scenarios of `make firmware`."""

import os
import signal
import socket
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tests.firmware_estimate import told_of_px4
from tests.firmware_switch import (
    exercised_in_ardupilot,
    in_px4,
    left_by_setpoints,
    switched_in_ardupilot,
    switched_in_px4,
    told,
    told_alone,
    told_of_ardupilot,
)

NUMBER = 3
"""Of an export among ArduPilot's types of controllers, as its page says."""

AFTER = 0.5
"""Seconds from lift-off to what is done in flight: some of the flight's own, where the machine flies eight times as fast."""

WIND = "[wind]\nmean = [5.0, 3.0, 0.0]\n"

ROTOR = '[[events]]\ntype = "rotor"\ntime = 12.0\nrotor = 1\nefficiency = {}\n'

PAYLOAD = '[[events]]\ntype = "payload"\ntime = 12.0\nmass = 0.4\nposition = [0.05, 0.03, -0.1]\n'

SAG = "[vehicle.effects]\nbattery = true\n[vehicle.battery]\ncapacity = {}\n"

KEPT = r"The log up to that point is kept\."


class Sitl(NamedTuple):
    """An autopilot's simulator. program: in its tree; build: the commands that make it. mission: more of the circle's.

    settled: from when on errors count [s]. ports: of instance 0, TCP or UDP, and by how much those of the next are higher; the
    second is MAVLink's, reached as it says, as is one for somebody more.
    """

    title: str
    program: str
    build: tuple[str, ...]
    mission: str
    settled: float
    ports: tuple[tuple[int, int, int], ...]
    reached: str
    parameters: str


STREAM, DATAGRAM = int(socket.SOCK_STREAM), int(socket.SOCK_DGRAM)

SITL = {
    "px4": Sitl(
        "PX4", "build/px4_sitl_default/bin/px4", ("make px4_sitl_default",),
        "period = 10.0\n[simulation]\nduration = 30.0\ncontrol_period = 0.004\n", 10.0,
        ((4560, 1, STREAM), (14540, 1, DATAGRAM)), "udpin:127.0.0.1:{}", "px4.params",
    ),
    "ardupilot": Sitl(
        "ArduPilot", "build/sitl/bin/arducopter", ("./waf configure --board sitl --no-submodule-update", "./waf copter"),
        "period = 8.0\n[simulation]\nduration = 36.0\ncontrol_period = 0.001\nstep = 0.001\n", 20.0,
        ((9002, 10, DATAGRAM), (5760, 10, STREAM), (5762, 10, STREAM)), "tcp:127.0.0.1:{}", "ardupilot.parm",
    ),
}  # fmt: skip


class Flying(NamedTuple):
    """A flight that is under way: its process, its autopilot's, and in a folder its mission. instance: of the autopilot.

    stood: how long it stood on the ground [s]. beside: where the autopilot speaks MAVLink with one more. number: of the export
    among ArduPilot's types of controllers.
    """

    flight: subprocess.Popen[bytes]
    autopilot: subprocess.Popen[bytes]
    program: Path
    instance: int
    stood: float
    beside: str
    number: int = NUMBER


def signalled(number: signal.Signals) -> Callable[[Flying], str]:
    """The flight is asked to end."""

    def act(now: Flying) -> str:
        os.kill(now.flight.pid, number)  # what Popen does would also reap it
        return ""

    return act


def killed(now: Flying) -> str:
    """The autopilot is gone."""
    os.kill(now.autopilot.pid, signal.SIGKILL)  # what Popen does would also reap it, and its processor time is asked for
    return ""


def stopped(now: Flying) -> str:
    """An export's module in PX4, asked to stop in the air: what it says. The flight then ends, however long this took."""
    shell = in_px4(now)
    for word in ("start", "stop"):
        said = shell(CONTROL, word)
    assert "the vehicle is armed" in said, said
    os.kill(now.flight.pid, signal.SIGINT)
    return "told the vehicle is armed end"


def sagged(rows: np.ndarray, _: str, __: Path) -> str:
    """How far the voltage fell, and how well the height was held."""
    left, late = rows["voltageV"][-1] / rows["voltageV"][0], rows["ts"] > 0.5 * rows["ts"][-1]
    lost = 1e3 * float(np.abs(rows["zm"] - rows["z_dm"])[late].max())
    return f"completed; {100 * left:.0f} % of the voltage is left, height within {lost:.0f} mm in the second half"


class Scenario(NamedTuple):
    """code: with which `fly` ends. said: by whom it ends, or in flight. more: of the mission. act: AFTER lift-off.

    loaded: whether the autopilot has the parameters that must match. only: of one autopilot. asks: what the autopilot's
    program must contain, or stand beside it. pilot: whether quadstep leads it; otherwise `act` does, from the start.
    parameters: more of the autopilot's, by name. lasts: until `act` ends it, as flights without a pilot do. tell: the result,
    from the flight's rows, what was said, and the folder.
    """

    name: str
    code: int
    said: str
    more: str = ""
    radius: float = 2.0
    act: Callable[[Flying], str] = lambda _: ""
    loaded: bool = True
    only: str = ""
    asks: str = ""
    pilot: bool = True
    parameters: Mapping[str, float] = MappingProxyType({})
    lasts: bool = False
    tell: Callable[[np.ndarray, str, Path], str] | None = None


ALONE = {"COM_RC_IN_MODE": 4, "NAV_RCL_ACT": 0, "NAV_DLL_ACT": 0, "SDLOG_PROFILE": 33, "SYS_FAILURE_EN": 1}
"""PX4's, so that it flies without a remote control, logs what an export says, and loses its GPS when it is told to."""

SWITCHED = {"CC_TYPE": NUMBER, "CC_AXIS_MASK": 7}
"""ArduPilot's, so that RC option 109 switches an export in."""

GONE = "PX4 closed the connection|ArduPilot stopped sending"

OTHER = r"has a different frame from the mission's vehicle: \S+ is \S+, should be [^,\s]+"

CONTROL = "quadstep_control"

COMPLETED = r"Completed .* s; position RMSE"

AIRS = (("calm", ""), ("wind of 5.8 m/s", WIND))

SCENARIOS = (
    Scenario("hover, calm", 0, COMPLETED, radius=1e-3),
    Scenario("circle, calm", 0, COMPLETED),
    Scenario("circle, wind of 5.8 m/s", 0, COMPLETED, WIND),
    Scenario("circle, battery that sags", 0, COMPLETED, SAG.format(900.0), tell=sagged),
    Scenario("circle, payload of 0.4 kg off centre at 12 s", 0, COMPLETED, PAYLOAD),
    Scenario("circle, rotor 1 loses 20 % at 12 s", 0, COMPLETED, ROTOR.format(0.8)),
    Scenario("circle, rotor 1 is lost at 12 s", 3, rf"Lost at \S+ s: .*?\. {KEPT}", ROTOR.format(0.0)),
    Scenario("Ctrl-C in flight", 3, rf"Interrupted at \S+ s\. {KEPT}", act=signalled(signal.SIGINT)),
    Scenario("SIGTERM in flight", 3, rf"Interrupted at \S+ s\. {KEPT}", act=signalled(signal.SIGTERM)),
    Scenario("autopilot killed in flight", 3, rf"({GONE}) at \S+ s\. {KEPT}", act=killed),
    Scenario("parameters not loaded", 2, OTHER, loaded=False),
    Scenario(
        "`quadstep_control stop` in flight", 3, rf"Interrupted at \S+ s\. {KEPT}", act=stopped, only="px4",
        asks=f"px4-{CONTROL}", lasts=True, tell=told_alone,
    ),
    Scenario(
        "`serve-setpoints` ends, wind of 5.8 m/s", 3, rf"Interrupted at \S+ s\. {KEPT}", WIND, act=left_by_setpoints,
        only="px4", pilot=False, tell=told_alone, parameters=ALONE,
    ),
    *(
        Scenario(
            f"export switched in and back, {name}", 3, rf"Interrupted at \S+ s\. {KEPT}", more, act=switched_in_px4,
            only="px4", asks=f"px4-{CONTROL}", pilot=False, tell=told_of_px4, parameters=ALONE,
        )
        for name, more in (*AIRS, ("battery that sags", SAG.format(4000.0)))
    ),
    *(
        Scenario(
            f"export switched in and back, {name}", 3, rf"Interrupted at \S+ s\. {KEPT}", more, act=switched_in_ardupilot,
            only="ardupilot", asks="QSTP", tell=told_of_ardupilot, parameters=SWITCHED, lasts=True,
        )
        for name, more in (*AIRS, ("battery that sags", SAG.format(900.0)))
    ),
    *(
        Scenario(
            f"export: hover, step, turn, loss of GPS, {name}", 3, rf"Interrupted at \S+ s\. {KEPT}", more,
            act=exercised_in_ardupilot, only="ardupilot", asks="QSTP", pilot=False, tell=told, parameters=SWITCHED,
        )
        for name, more in AIRS
    ),
)  # fmt: skip
