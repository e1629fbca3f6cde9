"""How many seconds a second of this process's computing time flies in lockstep, at the autopilots' usual rates.

The fake autopilots of the tests fly, in a process of their own, whose time does not count: `python -m tests.lockstep`.
"""

import multiprocessing
import socket
import sys
import tempfile
import time
from pathlib import Path

from quadstep.autopilot.flight import meet, opened, under
from quadstep.flight.engines import fly
from quadstep.mission.read import plan_mission, read_mission
from tests.autopilots import FakeArduPilot, FakePx4, Hover, free_port

MISSION = """
[vehicle]
preset = "x500"
[path]
type = "step"
start = [0.0, 0.0, 5.0]
end = [0.0, 0.0, 5.0]
duration = 5.0
[wind]
mean = [1.0, 0.0, 0.0]
[simulation]
control_period = {period}
step = {step}
"""

FAKES = {
    "ardupilot": (FakeArduPilot, socket.SOCK_DGRAM, 0.001, 0.001),
    "px4": (FakePx4, socket.SOCK_STREAM, 0.004, 0.002),
}
"""The fake, its kind of socket, its period and the step of the flight [s]."""


def lockstep(name, folder):
    """Seconds flown by a second of computing, once everything is compiled."""
    fake, kind, period, step = FAKES[name]
    path = folder / f"{name}.toml"
    path.write_text(MISSION.format(period=period, step=step), encoding="utf-8")
    mission, port = read_mission(path), free_port(kind)
    link = opened(name, str(port))
    pilot = fake(port, Hover(plan_mission(mission, path)))
    other = multiprocessing.get_context("fork").Process(target=pilot.run, daemon=True)
    other.start()
    try:
        with under(link, mission) as piloted:
            plan = plan_mission(piloted.mission, path)
            began = []
            exchange = link.exchange

            def timed(sample):
                if not began:
                    began.append(time.process_time())
                return exchange(sample)

            link.exchange = timed
            meet(link, plan)
            fly(plan)
            taken = time.process_time() - began[0]
    finally:
        other.terminate()
    return plan.ticks.last * plan.ticks.step / taken


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        for autopilot in FAKES:
            sys.stdout.write(f"{autopilot}: {lockstep(autopilot, Path(place)):.1f} s flown by a second of computing\n")
