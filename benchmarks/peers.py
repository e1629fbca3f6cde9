"""Other simulators of very many quadrotors, run by an environment of their own that `make bench-peers` makes."""

import json
import os
import subprocess
from pathlib import Path

from benchmarks.beside_c import Row, in_turn, machine
from benchmarks.campaigns import FLIGHTS
from benchmarks.many_flights import drawn, sweep

HOME = Path(__file__).parent
INTERPRETER = HOME.parent / ".venv-peers" / "bin" / "python"


def rates(script: str, folder: Path) -> dict[str, float]:
    """Steps a second of a peer by what it was asked to fly. folder: where it may leave files."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    command = [INTERPRETER, HOME / script]
    answer = subprocess.run(command, check=False, capture_output=True, text=True, env=environment, cwd=folder)
    if answer.returncode:
        raise RuntimeError(f"{script}: {answer.stderr.strip().splitlines()[-1]}")
    result: dict[str, float] = json.loads(answer.stdout.splitlines()[-1])
    return result


def own_rate() -> float:
    """Steps a second of the paper's closed loop, RK4, in f32."""
    flights, values = sweep(False), drawn(FLIGHTS)
    return FLIGHTS * flights.ticks.last / min(in_turn([lambda: flights.fly(values)])[0])


def beside(folder: Path, peer: str, script: str, settings: str, targets: dict[str, float]) -> Row:
    """A row: how often a peer's rate goes into ours. targets: by what the peer flies."""
    name, wanted = f"closed loop beside {peer}", ", ".join(f"{ratio:g} times {what}" for what, ratio in targets.items())
    if not INTERPRETER.exists():
        return name, "-", wanted, "not installed: make bench-peers", "-"
    before, theirs, after = own_rate(), rates(script, folder), own_rate()
    ours = max(before, after)
    ratios = ", ".join(f"{ours / theirs[what]:.3g} times {what}" for what in targets if what in theirs)
    measured = ", ".join(f"{what} {rate:.2g} steps/s" for what, rate in theirs.items())
    return name, f"{ours:.3g} steps/s in f32 ({machine(False)}): {ratios}", f">= {wanted}", measured, settings


def crazyflow(folder: Path) -> Row:
    """Its best batch on the processor."""
    settings = "theirs: 500 Hz, f32; Euler with attitude commands, RK4 with its state controller; ours: RK4, both nets"
    return beside(
        folder, "Crazyflow", "throughput_crazyflow.py", settings, {"open loop, Euler": 10.0, "closed loop, RK4": 100.0}
    )


def rotorpy(folder: Path) -> Row:
    """Its best batch on the processor, and one vehicle."""
    settings = "theirs: 100 Hz, f64, SE3 controller; batch RK4 on PyTorch, alone RK45; ours: 250 Hz, RK4, both nets"
    return beside(
        folder, "RotorPy", "throughput_rotorpy.py", settings, {"closed loop, batch": 500.0, "closed loop, alone": 1.0}
    )
