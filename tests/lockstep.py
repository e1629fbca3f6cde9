"""How many seconds a second of this process's computing time flies in lockstep, at the autopilots' usual rates.

The fake autopilots of the tests fly, in a process of their own, whose time does not count: `python -m tests.lockstep`.
"""

import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

from quadstep.bridges.autopilots import CONNECTIONS
from quadstep.engines.fly import fly
from quadstep.mission.read import plan_mission, read_mission
from tests.autopilots import FAKES, HOVERING, Hover, free_port

TIMES = {"ardupilot": (0.001, 0.001), "px4": (0.004, 0.002)}
"""The autopilot's period and the step of the flight [s]."""


def lockstep(name, folder):
    """Seconds flown by a second of computing, once everything is compiled."""
    (fake, kind), (period, step) = FAKES[name], TIMES[name]
    path, port = folder / f"{name}.toml", free_port(kind)
    text = HOVERING.format(duration=5.0, period=period) + f"step = {step}\n"
    path.write_text(f'{text}[controller]\ntype = "{name}"\nconnect = "{port}"\n', encoding="utf-8")
    plan = plan_mission(read_mission(path), path)
    pilot = fake(port, Hover(plan))
    other = multiprocessing.get_context("fork").Process(target=pilot.run, daemon=True)
    other.start()
    try:
        began = []
        piloted = CONNECTIONS[int(plan.parameters.gains.handle)]
        connect = piloted.connect

        def timed(wait):
            link = connect(wait)
            exchange = link.exchange

            def first(sample):
                link.exchange = exchange
                began.append(time.process_time())
                return exchange(sample)

            link.exchange = first
            return link

        piloted.connect = timed
        fly(plan)
        taken = time.process_time() - began[0]
    finally:
        other.terminate()
    return plan.ticks.last * plan.ticks.step / taken


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        for autopilot in FAKES:
            sys.stdout.write(f"{autopilot}: {lockstep(autopilot, Path(place)):.1f} s flown by a second of computing\n")
