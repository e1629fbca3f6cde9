"""Steps a second of Crazyflow on this machine's cores; run as a file by an interpreter that has it. Prints JSON.

Open loop: Euler, attitude commands, which its inner loop follows. Closed loop: its state controller and RK4. Both in f32,
500 Hz, the whole of many steps compiled by JAX, which uses all cores; what compiles is not timed.
"""

import json
import time
from typing import Any

import jax
import numpy as np
from crazyflow.control import Control
from crazyflow.sim import Sim
from crazyflow.sim.integration import Integrator

STEPS, WORLDS = 100, (1000, 4000, 16000)


def rate(worlds: int, control: Any, integrator: Any, repeats: int = 5) -> float:
    """The best of several runs."""
    sim = Sim(n_worlds=worlds, control=control, integrator=integrator)
    sim.reset()
    if control == Control.attitude:
        command = np.zeros((worlds, 1, 4), np.float32)
        command[..., 3] = 0.3
        sim.attitude_control(command)
    else:
        state = np.zeros((worlds, 1, 16), np.float32)  # position, velocity, acceleration, quaternion (x, y, z, w), rates
        state[..., 2] = state[..., 12] = 1.0
        sim.state_control(state)
    best = float("inf")
    for run in range(repeats + 1):
        start = time.perf_counter()
        sim.step(STEPS)
        jax.block_until_ready(sim.data.states.pos)
        if run:
            best = min(best, time.perf_counter() - start)
    return worlds * STEPS / best


print(
    json.dumps(
        {
            "open loop, Euler": max(rate(worlds, Control.attitude, Integrator.euler) for worlds in WORLDS),
            "closed loop, RK4": max(rate(worlds, Control.state, Integrator.rk4) for worlds in WORLDS),
        }
    )
)
