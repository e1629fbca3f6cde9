"""Equation error on averages: what half a second of flight says of thrust, tilt, centre of gravity, drag and flapping.

Averages are taken so that noise in what a regression starts from does not bias it, and because an observer that learns slow
forces would hide all of these numbers from prediction errors.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.airframe.allocation import mixing
from quadstep.airframe.geometry import Geometry
from quadstep.identify.predictor import PredictorParameters
from quadstep.identify.starts import voltage_of
from quadstep.logs.flight import FlightRecord, Floats

BLOCK = 0.5
"""Length of an average [s]."""

FEWEST = 12
"""Blocks without which nothing is said."""

LEAST_SPREAD = 0.004
"""Standard deviation of a logarithm (of command, of voltage) below which its exponent cannot be told."""


class Told(NamedTuple):
    """A number that averages tell: value and standard error. clusters: how many independent parts stand behind it."""

    value: float
    error: float
    clusters: int


class Block(NamedTuple):
    """Averages over blocks. flight (n,): index. lift (n,): specific force along the mean thrust axis [m/s^2]. commands
    (n, samples, rotors), voltage (n,). force (n, 3): specific force in body axes [m/s^2], velocity (n, 3): likewise [m/s].
    turning (n, 3): mean angular acceleration [rad/s^2].
    """

    flight: Floats
    lift: Floats
    commands: Floats
    voltage: Floats
    force: Floats
    velocity: Floats
    turning: Floats


def matrices(attitude: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) of quaternions."""
    w, x, y, z = attitude.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def blocks(flights: Sequence[FlightRecord], late: float, gravity: float) -> Block | None:
    """Averages of all flights, commands `late` [s] before; None where there are too few."""
    found: list[tuple[Floats, ...]] = []
    for number, flight in enumerate(flights):
        count, shift = max(2, round(BLOCK / flight.period)), late / flight.period
        good, runs = flight.flying & flight.measured, flight.runs()
        before = math.ceil(shift) + 1
        index = np.arange(flight.rows, dtype=float)
        motors = np.stack([np.interp(index - shift, index, column) for column in flight.motors.T], axis=1)
        turn, speed = matrices(flight.channel("attitude")), flight.channel("velocity")
        rates, volts = flight.channel("rates"), voltage_of(flight)
        for first in range(before, flight.rows - count - 1, count):
            last = first + count
            if not good[first : last + 1].all() or runs[last] < count + before:
                continue
            part = slice(first, last + 1)
            gain = (speed[last] - speed[first]) / (count * flight.period) + np.array([0.0, 0.0, gravity])
            axes = turn[part].mean(axis=0)
            up = axes[:, 2] / np.linalg.norm(axes[:, 2])
            body = np.einsum("nij,ni->nj", turn[part], speed[part]).mean(axis=0)
            twist = (rates[last] - rates[first]) / (count * flight.period)
            middle = volts[part].mean()
            found.append((np.array(number), gain @ up, motors[first:last], middle, axes.T @ gain, body, twist))
    if len(found) < FEWEST:
        return None
    return Block(*(np.array(column) for column in zip(*found, strict=True)))


def clusters_of(block: Block) -> Floats:
    """A number for each block that says which blocks belong together: those of a flight, or where these are few, four each."""
    flights = len(np.unique(block.flight))
    return block.flight if flights >= 6 else np.arange(len(block.flight)) // 4


def least_squares(matrix: Floats, wanted: Floats, clusters: Floats) -> tuple[Floats, Floats, int]:
    """Solution, its standard errors robust to clusters (Liang and Zeger 1986), and the number of these."""
    inverse = np.linalg.pinv(matrix.T @ matrix)
    solution = inverse @ (matrix.T @ wanted)
    rest = wanted - matrix @ solution
    names = np.unique(clusters)
    scores = np.array([matrix[clusters == name].T @ rest[clusters == name] for name in names])
    count = len(names)
    spread = inverse @ (scores.T @ scores) @ inverse * (count / max(count - 1, 1))
    return solution, np.sqrt(np.diag(spread)), count


def thrust_curve(block: Block, p: PredictorParameters, speeds: bool) -> tuple[dict[str, Told], dict[str, str]]:
    """Speed at the full command, and the exponents of command and voltage; what cannot be told, with the reason.

    Thrust differs from flight to flight by more than it does within one, so the exponents come from within flights.
    """
    known: dict[str, Told] = {}
    why: dict[str, str] = {}
    factor = p.airframe.rotor.thrust / p.airframe.mass
    commands = np.maximum(block.commands, 1e-3)
    volts = np.log(block.voltage / p.curve.nominal)
    flight = np.unique(block.flight, return_inverse=True)[1]
    middle = np.log(commands).mean(axis=(1, 2))
    free = []
    for name, values in (("exponent", middle), ("voltage_exponent", volts)):
        spread = float(np.sqrt(np.mean([values[flight == i].var() for i in np.unique(flight)])))
        if speeds:
            why[f"command.{name}"] = "rotor speeds were logged, no commands"
        elif spread < LEAST_SPREAD:
            what = "command" if name == "exponent" else "voltage"
            why[f"command.{name}"] = f"the {what} varies by {100 * spread:.2g} % only within a flight"
        else:
            free.append(name)
    a, b = (1.0, 0.0) if speeds else (p.curve.exponent, p.curve.voltage_exponent)
    groups = np.eye(flight.max() + 1)[flight]
    for _ in range(8):
        powers = commands ** (2.0 * a)
        lift = powers.mean(axis=1).sum(axis=1)
        slope = 2.0 * (powers * np.log(commands)).mean(axis=1).sum(axis=1) / lift
        rest = np.log(block.lift / (factor * lift)) - 2.0 * b * volts
        columns = {"exponent": slope, "voltage_exponent": 2.0 * volts}
        within = np.column_stack([groups, *(columns[name] for name in free)])
        solution, errors, count = least_squares(within, rest, clusters_of(block))
        steps = dict(zip(free, solution[groups.shape[1] :], strict=True))
        a, b = a + steps.get("exponent", 0.0), b + steps.get("voltage_exponent", 0.0)
        a, b = min(max(a, 0.3), 2.0), min(max(b, 0.0), 3.0)
    for name, error in zip(free, errors[groups.shape[1] :], strict=True):
        known[f"command.{name}"] = Told(a if name == "exponent" else b, float(error), count)
    powers = (commands ** (2.0 * a)).mean(axis=1).sum(axis=1)
    level = 0.5 * (np.log(block.lift / (factor * powers)) - 2.0 * b * volts)
    means = np.array([level[flight == i].mean() for i in np.unique(flight)])
    if len(means) >= 6:
        speed, error, count = float(means.mean()), float(means.std(ddof=1) / math.sqrt(len(means))), len(means)
    else:
        solution, errors, count = least_squares(np.ones((len(level), 1)), level, clusters_of(block))
        speed, error = float(solution[0]), float(errors[0])
    known["command.speed"] = Told(math.exp(speed), math.exp(speed) * error, count)
    return known, why


def balance(block: Block, p: PredictorParameters, geometry: Geometry) -> dict[str, Told]:
    """Tilt, centre of gravity, drag in the disc and flapping, from mean forces and torques with a known thrust curve."""
    airframe, curve = p.airframe, p.curve
    shift = (block.voltage / curve.nominal) ** curve.voltage_exponent
    speeds = curve.speed * np.maximum(block.commands, 1e-3) ** curve.exponent * shift[:, None, None]
    thrusts = airframe.rotor.thrust * (speeds**2).mean(axis=1)
    turning = speeds.mean(axis=1).sum(axis=1)
    rows = np.array([list(row) for row in mixing(geometry, airframe.rotor.torque / airframe.rotor.thrust)])
    thrust, roll, pitch, _ = rows @ thrusts.T
    together = clusters_of(block)
    found: dict[str, Told] = {}
    # in measured axes the thrust leans by the tilt: R(tilt) e_z = (tilt_y, -tilt_x, 1)
    drags = []
    for axis, name, sign in ((0, "imu.tilt[1]", 1.0), (1, "imu.tilt[0]", -1.0)):
        matrix = np.column_stack([sign * thrust / airframe.mass, -turning * block.velocity[:, axis] / airframe.mass])
        solution, errors, count = least_squares(matrix, block.force[:, axis], together)
        found[name] = Told(float(solution[0]), float(errors[0]), count)
        drags.append((float(solution[1]), float(errors[1]), count))
    best = [1.0 / error**2 for _, error, _ in drags]
    value = sum(w * d[0] for w, d in zip(best, drags, strict=True)) / sum(best)
    found["drag.rotor[0]"] = Told(max(value, 1e-12), 1.0 / math.sqrt(sum(best)), drags[0][2])
    # I alpha = torque - c x thrust + flapping: torque_x = c_y T - k w v_y + I alpha, torque_y = -c_x T + k w v_x + I alpha
    flaps = []
    for axis, torque, name, lean, flow in (
        (0, roll, "centre_of_gravity[1]", thrust, -turning * block.velocity[:, 1]),
        (1, pitch, "centre_of_gravity[0]", -thrust, turning * block.velocity[:, 0]),
    ):
        wanted = torque - airframe.inertia[axis] * block.turning[:, axis]
        solution, errors, count = least_squares(np.column_stack([lean, flow]), wanted, together)
        found[name] = Told(float(solution[0]), float(errors[0]), count)
        flaps.append((float(solution[1]), float(errors[1]), count))
    best = [1.0 / error**2 for _, error, _ in flaps]
    value = sum(w * d[0] for w, d in zip(best, flaps, strict=True)) / sum(best)
    found["drag.flapping"] = Told(value, 1.0 / math.sqrt(sum(best)), flaps[0][2])
    return found
