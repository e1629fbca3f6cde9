"""Equation error on averages: thrust, tilt, centre of gravity, drag and flapping from averages over half a second of flight.

Averages are used so that noise in the regressors does not bias the regression, and because an observer that learns slow
forces would hide all of these parameters from prediction errors.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.predictor import Curve, PredictorParameters
from quadstep.identify.starts import voltage_of
from quadstep.numbers import vector
from quadstep.numbers.rotations import from_rotation_vector
from quadstep.vehicle.airframe.allocation import mixing
from quadstep.vehicle.airframe.geometry import Geometry

BLOCK = 0.5
"""Length of an average [s]."""

FEWEST = 12
"""Fewest blocks for an estimate."""

LEAST_SPREAD = 0.008
"""Standard deviation of a command's logarithm below which its exponent cannot be estimated; half of it for a voltage's."""

LEAST_EXPLAINED = 0.5
"""Share of the changes of the lift that the command must explain for its exponent to be estimated."""


MOST_TILT = 0.05
"""Largest angle between the measured axes and those of the rotors that is a mounting's, not a steady wind's [rad]."""


NEVER = "never changes, or was not logged"

GUSTS = 0.005
"""Standard error of the logarithm of a rotor's speed where wind blows, whose gusts lift and press."""


class Told(NamedTuple):
    """A parameter estimated from averages: value and standard error. clusters: number of independent parts behind it.
    pulls: by how much errors that all pull the same way would move it.
    """

    value: float
    error: float
    clusters: int
    pulls: float = 0.0


class HalfSeconds(NamedTuple):
    """n half seconds of flight with their samples. flight, row (n,): index, and first row. gain (n, 3): mean
    acceleration less gravity, world axes [m/s^2]. axes (n, samples, 3, 3): rotation matrices. commands (n, samples, rotors),
    volts (n, samples). velocity (n, samples, 3): body axes [m/s]. rates (n, samples, 3). turning (n, 3): mean angular
    acceleration [rad/s^2].
    """

    flight: Floats
    row: Floats
    gain: Floats
    axes: Floats
    commands: Floats
    volts: Floats
    velocity: Floats
    rates: Floats
    turning: Floats


def matrices(attitude: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) of quaternions."""
    w, x, y, z = attitude.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    found: Floats = np.array(rows).transpose(2, 0, 1)
    return found


def lagged(wanted: Floats, period: float, lag: float) -> Floats:
    """What follows numbers (rows, ...) with a first-order lag [s]."""
    share = 1.0 - math.exp(-period / max(lag, 1e-4))
    found = wanted.copy()
    for row in range(1, len(found)):
        found[row] = found[row - 1] + share * (0.5 * (wanted[row - 1] + wanted[row]) - found[row - 1])
    return found


def followed(flight: FlightRecord, delay: float, lag: float) -> Floats:
    """The commands as the rotors follow them, `delay` [s] later and with a first-order lag [s], shape (n, rotors)."""
    index, shift = np.arange(flight.rows, dtype=float), delay / flight.period
    found = np.stack([np.interp(index - shift, index, column) for column in flight.motors.T], axis=1)
    return lagged(found, flight.period, lag)


def between(column: Floats) -> Floats:
    """Values half-way between each row and the next."""
    found: Floats = 0.5 * (column[:-1] + column[1:])
    return found


def blocks(flights: Sequence[FlightRecord], delay: float, lag: float, gravity: float) -> HalfSeconds | None:
    """Averages of all flights, with rotors that follow their commands in this way; None if there are too few."""
    found: list[tuple[Floats, ...]] = []
    for number, flight in enumerate(flights):
        count = max(2, round(BLOCK / flight.period))
        good, runs = flight.flying & flight.measured, flight.runs()
        before = math.ceil((delay + 8.0 * lag) / flight.period) + 1
        speed, rates = flight.channel("velocity"), flight.channel("rates")
        turn, moving, turning = (between(one) for one in (matrices(flight.channel("attitude")), speed, rates))
        body = np.einsum("nij,ni->nj", turn, moving)
        motors, volts = between(followed(flight, delay, lag)), between(lagged(voltage_of(flight), flight.period, lag))
        for first in range(before, flight.rows - count - 1, count):
            last = first + count
            if not good[first : last + 1].all() or runs[last] < count + before:
                continue
            gain, twist = ((one[last] - one[first]) / (count * flight.period) for one in (speed, rates))
            told = (one[first:last] for one in (turn, motors, volts, body, turning))
            found.append((np.array(number), np.array(first), gain + np.array([0.0, 0.0, gravity]), *told, twist))
    if len(found) < FEWEST:
        return None
    return HalfSeconds(*(np.array(column) for column in zip(*found, strict=True)))


def clusters_of(block: HalfSeconds) -> Floats:
    """A cluster number for each block: one cluster per flight or, if there are few flights, per four blocks."""
    flights = len(np.unique(block.flight))
    return block.flight if flights >= 6 else np.floor(np.arange(len(block.flight)) / 4.0)


def least_squares(matrix: Floats, wanted: Floats, clusters: Floats) -> tuple[Floats, Floats, Floats, int]:
    """Solution, its cluster-robust standard errors (Liang and Zeger 1986), its pulls, and the number of clusters."""
    inverse = np.linalg.pinv(matrix.T @ matrix)
    solution = inverse @ (matrix.T @ wanted)
    rest = wanted - matrix @ solution
    names = np.unique(clusters)
    scores = np.array([matrix[clusters == name].T @ rest[clusters == name] for name in names])
    count = len(names)
    spread = inverse @ (scores.T @ scores) @ inverse * (count / max(count - 1, 1))
    return solution, np.sqrt(np.diag(spread)), np.abs(inverse @ (matrix * rest[:, None]).T).sum(axis=1), count


def in_rotors_axes(block: HalfSeconds, tilt: Floats) -> HalfSeconds:
    """The averages in the axes of the rotors, turned by `tilt` about x and y [rad] from the measured ones."""
    (turn,) = matrices(np.array([list(from_rotation_vector(vector(float(tilt[0]), float(tilt[1]), 0.0)))]))
    axes, velocity, rates, turning = (part @ turn for part in (block.axes, block.velocity, block.rates, block.turning))
    return block._replace(axes=axes, velocity=velocity, rates=rates, turning=turning)


def hubs(block: HalfSeconds, geometry: Geometry) -> Floats:
    """Velocity of every rotor's hub in body axes [m/s], shape (n, samples, rotors, 3)."""
    places = np.array([mount.position for mount in geometry.mounts])
    return block.velocity[:, :, None, :] + np.cross(block.rates[:, :, None, :], places)


def exponents(
    flight: NDArray[np.int64], commands: Floats, volts: Floats, lift: Floats, speeds: bool
) -> tuple[list[str], dict[str, str]]:
    """The exponents that logarithms of commands, voltages and lift (n,) determine, and why they do not determine the others.

    Commands under feedback also answer to noise and to disturbances. Where these are most of what moves them, the slope of
    lift on commands tells of the autopilot, not of the rotors.
    """
    if speeds:
        return [], {f"command.{name}": "rotor speeds were logged, no commands" for name in ("exponent", "voltage_exponent")}
    means = np.array([[one[flight == i].mean() for one in (commands, volts, lift)] for i in range(int(flight.max()) + 1)])
    command, voltage, raised = (np.stack([commands, volts, lift], axis=1) - means[flight]).T
    free: list[str] = []
    why: dict[str, str] = {}
    for name, what, values, least in (
        ("exponent", "command", command, LEAST_SPREAD), ("voltage_exponent", "voltage", voltage, 0.5 * LEAST_SPREAD)
    ):  # fmt: skip
        spread = float(np.sqrt(np.mean(values**2)))
        if spread < least:
            varies = f"varies by {100 * spread:.2g} % only within a flight" if spread > 1e-9 else NEVER
            why[f"command.{name}"] = f"the {what} {varies}"
        else:
            free.append(name)
    if "exponent" in free:
        known = np.stack([voltage, np.ones(len(voltage))], axis=1)
        x, y = (one - known @ np.linalg.lstsq(known, one, rcond=None)[0] for one in (command, raised))
        explained = float(x @ y) ** 2 / max(float((x @ x) * (y @ y)), 1e-300)
        if explained < LEAST_EXPLAINED:
            free.remove("exponent")
            why["command.exponent"] = f"the command explains {100 * explained:.0f} % only of how the thrust changes"
    return free, why


def forces(
    block: HalfSeconds, p: PredictorParameters, geometry: Geometry, speeds: bool, rounds: int = 10, wind: bool = False
) -> tuple[dict[str, Told], dict[str, str]]:
    """Thrust curve, tilt and drag from mean forces, all at once, in `rounds` rounds; undetermined ones with the reason.

    m (mean acceleration - g) = mean R ((tilt_y, -tilt_x, 1) thrust - K sum w_i v_i), thrust = k_f sum w_i^2, v_i: of a hub,
    w = speed c^a (V / V_n)^b. Thrust differs from flight to flight by more than it does within one, so each flight has a speed
    of its own, and the exponents come from variation within flights.

    wind: whether a steady wind blows in each flight; then the tilt stays, as either leans the vehicle. It is assumed where the
    tilt without it would be larger than any mounting's.
    """
    commands = np.maximum(block.commands, 1e-3)
    logs, volts = np.log(commands), np.log(block.volts / p.curve.nominal)
    flight = np.unique(block.flight, return_inverse=True)[1].astype(np.int64)
    count = int(flight.max()) + 1
    factor = float(p.airframe.rotor.thrust / p.airframe.mass)
    lift = np.log(np.maximum((block.gain * block.axes[..., 2].mean(axis=1)).sum(axis=1), 1e-3))
    free, why = exponents(flight, logs.mean(axis=(1, 2)), volts.mean(axis=1), lift, speeds)
    a, b = (1.0, 0.0) if speeds else (float(p.curve.exponent), float(p.curve.voltage_exponent))
    levels = np.full(count, math.log(p.curve.speed))
    names = [*free, "flat", "axial", *(() if wind else ("x", "y"))]
    tilt, drag = np.array([float(one) for one in p.tilt]), np.array([float(p.airframe.drag.rotor[i]) for i in (0, 2)])
    for _ in range(rounds):
        turned = in_rotors_axes(block, tilt)
        air = hubs(turned, geometry)
        turning = np.exp(levels[flight][:, None, None] + a * logs + b * volts[..., None])
        thrusts, flow = factor * turning**2, (turning[..., None] * air).sum(axis=2) / float(p.airframe.mass)
        level = turned.axes * flow[:, :, None, :]
        thrust = thrusts.sum(axis=2)
        leaning = turned.axes[..., 2]
        lifted = (thrust[..., None] * leaning).mean(axis=1)
        by_command = (2.0 * (thrusts * logs).sum(axis=2)[..., None] * leaning).mean(axis=1)
        by_volts = (2.0 * (thrust * volts)[..., None] * leaning).mean(axis=1)
        flat = (level[..., 0] + level[..., 1]).mean(axis=1)
        axial = level[..., 2].mean(axis=1)
        columns = [2.0 * lifted * (flight == i)[:, None] for i in range(count)]
        columns += [{"exponent": by_command, "voltage_exponent": by_volts}[name] for name in free]
        columns += [-flat, -axial]
        columns += sideways(thrust, turned.axes, flight, wind)
        rest = block.gain - unfitted(turned, p, air) - (lifted - drag[0] * flat - drag[1] * axial)
        matrix = np.stack([one.reshape(-1) for one in columns], axis=1)
        step, errors, pulls, clusters = least_squares(matrix, rest.reshape(-1), np.repeat(clusters_of(block), 3))
        levels += step[:count]
        named = dict(zip(names, step[count:], strict=False))
        a, b = min(max(a + named.get("exponent", 0.0), 0.3), 2.0), min(max(b + named.get("voltage_exponent", 0.0), 0.0), 3.0)
        tilt += np.array([named.get("x", 0.0), named.get("y", 0.0)])
        drag += np.array([named["flat"], named["axial"]])
    if np.hypot(*tilt) > MOST_TILT and not wind:
        return forces(block, p, geometry, speeds, rounds, wind=True)
    error, pull = (dict(zip(names, map(float, some[count:]), strict=False)) for some in (errors, pulls))
    known = {f"command.{name}": Told(a if name == "exponent" else b, error[name], clusters, pull[name]) for name in free}
    middle = float(levels.mean())
    scatter = float(levels.std(ddof=1)) / math.sqrt(count) if count > 1 else 0.0
    own = math.hypot(float(np.sqrt((errors[:count] ** 2).mean() / count)), GUSTS * wind)
    known["command.speed"] = Told(
        math.exp(middle), math.exp(middle) * math.hypot(scatter, own), clusters if count < 3 else count,
        math.exp(middle) * float(pulls[:count].mean()),
    )  # fmt: skip
    if wind:
        keys = [f"{name}[{place}]" for name in ("imu.tilt", "centre_of_gravity") for place in (0, 1)]
        why.update(dict.fromkeys(keys, "it cannot be told from the wind that blew"))
    else:
        known.update(
            {f"imu.tilt[{i}]": Told(float(tilt[i]), error[name], clusters, pull[name]) for i, name in enumerate("xy")}
        )
    known["drag.rotor[0]"] = Told(max(float(drag[0]), 1e-12), error["flat"], clusters, pull["flat"])
    known["drag.rotor[2]"] = Told(max(float(drag[1]), 1e-12), error["axial"], clusters, pull["axial"])
    return known, why


def unfitted(block: HalfSeconds, p: PredictorParameters, air: Floats) -> Floats:
    """Mean accelerations by parasitic drag and translational lift, which no fit changes, in world axes (n, 3)."""
    drag, speed = p.airframe.drag, np.linalg.norm(block.velocity, axis=-1, keepdims=True)
    body = -speed * block.velocity * np.array([float(one) for one in drag.parasitic])
    body[..., 2] += float(drag.translational_lift) * (air[..., 0] ** 2 + air[..., 1] ** 2).sum(axis=2)
    found: Floats = np.einsum("nsij,nsj->nsi", block.axes, body).mean(axis=1) / float(p.airframe.mass)
    return found


def sideways(thrust: Floats, axes: Floats, flight: NDArray[np.int64], wind: bool) -> list[Floats]:
    """What a tilt about x and y does to the mean forces, or a steady wind of each flight along world x and y."""
    if wind:
        return [np.eye(3)[axis] * (flight == i)[:, None] for i in range(int(flight.max()) + 1) for axis in (0, 1)]
    return [sign * (thrust[..., None] * axes[..., axis]).mean(axis=1) for sign, axis in ((-1.0, 1), (1.0, 0))]


def rotor_speeds(commands: Floats, volts: Floats, curve: Curve, measured: bool) -> Floats:
    """Speeds (..., rotors) [rad/s] of commands, or of measured speeds, at voltages (...) [V]."""
    return cast(Floats, curve.speeds(cast(float, commands), cast(float, volts[..., None]), measured))


def torques(block: HalfSeconds, p: PredictorParameters, geometry: Geometry, measured: bool) -> dict[str, Told]:
    """Centre of gravity and flapping from mean torques, with a known thrust curve.

    I alpha + w x I w = torque - c x thrust + k_flap W v x e_z: about x torque - c_y T + k W v_y, about y torque + c_x T - k W
    v_x. The inertia is found too, but not used: predictions determine it better.
    """
    airframe, curve = p.airframe, p.curve
    block = in_rotors_axes(block, np.array([float(one) for one in p.tilt]))
    speeds = rotor_speeds(block.commands, block.volts, curve, measured)
    thrusts = airframe.rotor.thrust * (speeds**2).mean(axis=1)
    flows = (speeds[..., None] * hubs(block, geometry)).mean(axis=1)
    flow, pushes = flows.sum(axis=1), -flows * np.array([float(one) for one in airframe.drag.rotor])
    rows = np.array([list(row) for row in mixing(geometry, airframe.rotor.torque / airframe.rotor.thrust)])
    thrust, roll, pitch, _ = rows @ thrusts.T
    inertia = np.array([float(one) for one in airframe.inertia])
    spin = float(airframe.rotor.inertia) * (speeds @ np.array([float(mount.spin) for mount in geometry.mounts]))
    momentum = block.rates * inertia
    momentum[..., 2] += spin
    levers = np.cross([mount.position for mount in geometry.mounts], pushes).sum(axis=1)
    given = np.stack([roll, pitch], axis=1) + (levers - np.cross(block.rates, momentum).mean(axis=1))[:, :2]
    thrust = thrust + pushes[:, :, 2].sum(axis=1)
    nothing = np.zeros(len(thrust))
    about_x = np.stack([thrust, nothing, -flow[:, 1], block.turning[:, 0], nothing], axis=1)
    about_y = np.stack([nothing, -thrust, flow[:, 0], nothing, block.turning[:, 1]], axis=1)
    together = clusters_of(block)
    solution, errors, pulls, count = least_squares(
        np.concatenate([about_x, about_y]), given.T.reshape(-1), np.concatenate([together, together])
    )
    return {
        "centre_of_gravity[1]": Told(float(solution[0]), float(errors[0]), count, float(pulls[0])),
        "centre_of_gravity[0]": Told(float(solution[1]), float(errors[1]), count, float(pulls[1])),
        "drag.flapping": Told(float(solution[2]), float(errors[2]), count, float(pulls[2])),
    }
