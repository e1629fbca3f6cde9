"""Steps a second of RotorPy on this machine's cores; run as a file by an interpreter that has it. Prints JSON.

Closed loop, its SE3 controller on a Crazyflie: alone with its adaptive solver, and in a batch with its RK4 on PyTorch, if
that is installed. 10 ms a step, as its examples have it.
"""

import contextlib
import json
import time
from typing import Any

import numpy as np
from rotorpy.controllers.quadrotor_control import BatchedSE3Control, SE3Control
from rotorpy.trajectories.hover_traj import HoverTraj
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import BatchedMultirotor, BatchedMultirotorParams, Multirotor

STEP, BATCHES = 0.01, (1000, 10000)
START: dict[str, Any] = {
    "x": np.array([0.1, 0.0, 1.0]),
    "v": np.zeros(3),
    "q": np.array([0.0, 0.0, 0.0, 1.0]),
    "w": np.zeros(3),
    "wind": np.zeros(3),
    "rotor_speeds": np.full(4, 1788.53),
}


def alone(steps: int = 200) -> float:
    """One vehicle."""
    vehicle, controller = Multirotor(quad_params, START), SE3Control(quad_params)
    wanted, state = HoverTraj(x0=np.array([0.0, 0.0, 1.0])).update(0.0), dict(START)
    start = time.perf_counter()
    for step in range(steps):
        state = vehicle.step(state, controller.update(step * STEP, state, wanted), STEP)
    return steps / (time.perf_counter() - start)


def batch(count: int, steps: int = 5, repeats: int = 2) -> float:
    """Many vehicles."""
    import torch  # noqa: PLC0415 (only where it is installed)

    double, device = torch.double, torch.device("cpu")
    parameters = BatchedMultirotorParams([quad_params] * count, count, device)
    state = {name: torch.tensor(np.tile(value, (count, 1)), dtype=double) for name, value in START.items()}
    vehicle = BatchedMultirotor(parameters, count, state, device, integrator="rk4")
    controller = BatchedSE3Control(parameters, count, device)
    flat = HoverTraj(x0=np.array([0.0, 0.0, 1.0])).update(0.0)
    wanted = {name: torch.tensor(np.tile(value, (count, 1)), dtype=double).squeeze(-1) if np.ndim(value) == 0
              else torch.tensor(np.tile(value, (count, 1)), dtype=double) for name, value in flat.items()}  # fmt: skip
    best = 0.0
    for _ in range(repeats):
        now, start = dict(state), time.perf_counter()
        for step in range(steps):
            now = vehicle.step(now, controller.update(step * STEP, now, wanted), STEP)
        best = max(best, count * steps / (time.perf_counter() - start))
    return best


rates = {"closed loop, alone": alone()}
with contextlib.suppress(NameError):  # its modules leave out what PyTorch would have brought
    rates["closed loop, batch"] = max(batch(count) for count in BATCHES)
print(json.dumps(rates))
