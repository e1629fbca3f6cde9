"""Equation error of mean forces: thrust curve, tilt, drag in the plane of the rotors and across it, and the wind."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.averages import AverageEstimate, HalfSeconds, clusters_of, hubs, in_rotors_axes, least_squares
from quadstep.identify.logs.flight import Floats
from quadstep.identify.prediction import PredictorParameters
from quadstep.vehicle.rigid_body import Geometry

LEAST_SPREAD = 0.008
"""Standard deviation of a command's logarithm below which its exponent cannot be estimated; half of it for a voltage's."""

LEAST_EXPLAINED = 0.5
"""Share of the changes of the lift that the command must explain for its exponent to be estimated."""

MOST_WIND = 30.0
"""Fastest wind along an axis [m/s]."""

EXPONENTS = 0.3, 2.0
"""Least and largest exponent of a command."""

LEAST_DRAG = 0.02
"""Least share of the airspeed that drag in the plane of the rotors takes off in a second, where a wind is fitted: without any
drag no wind could be seen [1/s].
"""

MOST_TILT = 0.05
"""Largest angle between the measured axes and those of the rotors that is a mounting's, not a steady wind's [rad]."""

NEVER = "never changes, or was not logged"

KEYS = {
    "exponent": "command.exponent", "voltage_exponent": "command.voltage_exponent", "x": "imu.tilt[0]", "y": "imu.tilt[1]",
    "flat": "drag.rotor[0]", "axial": "drag.rotor[2]",
}  # fmt: skip

GUSTS = 0.005
"""Standard error of the logarithm of a rotor's speed where wind blows, whose gusts lift and press."""


class Variant(NamedTuple):
    """Another structure of the mean forces, which a log seldom tells from the plain one: what numbers differ by with it, their
    intervals must hold.

    drifting: thrust changes with time, as where a battery sags and no voltage was logged. parasitic: drag also grows with the
    square of the airspeed. axial: whether axial drag is fitted. answering: what commands do not explain of the lift moves
    them, so that the exponent is that of the reverse regression (Frisch 1934). other: wind where tilt would be taken, or tilt.
    given: keys of exponents not fitted.
    """

    drifting: bool = False
    parasitic: bool = False
    axial: bool = True
    answering: bool = False
    other: bool = False
    given: tuple[str, ...] = ()


PLAIN = Variant()
VARIANTS = (
    Variant(drifting=True), Variant(parasitic=True), Variant(axial=False), Variant(answering=True), Variant(other=True),
)  # fmt: skip


class ForceNumbers(NamedTuple):
    """What decides mean forces. levels: logarithm of each flight's speed of rotors at a full command [log rad/s]; exponents of
    the command and of the voltage; tilt about x and y [rad]; drag in the plane of the rotors and across it [N s^2/(m rad)];
    pressing: drag in the plane times each flight's level wind, shape (flights, 2) [N s/rad].
    """

    levels: Floats
    exponent: float
    voltage_exponent: float
    tilt: Floats
    drag: Floats
    pressing: Floats

    @property
    def wind(self) -> Floats:
        """Along world x and y in each flight, shape (flights, 2) [m/s]."""
        return (self.pressing / max(float(self.drag[0]), 1e-12)).clip(-MOST_WIND, MOST_WIND)

    def moved(self, step: dict[str, float], levels: Floats, pressing: Floats) -> "ForceNumbers":
        a, b = self.exponent + step.get("exponent", 0.0), self.voltage_exponent + step.get("voltage_exponent", 0.0)
        return ForceNumbers(
            self.levels + levels.clip(-1.0, 1.0), min(max(a, EXPONENTS[0]), EXPONENTS[1]), min(max(b, 0.0), 3.0),
            self.tilt + np.array([step.get("x", 0.0), step.get("y", 0.0)]),
            self.drag + np.array([step["flat"], step.get("axial", 0.0)]), self.pressing + pressing,
        )  # fmt: skip


def exponents(
    flight: NDArray[np.int64], commands: Floats, volts: Floats, lift: Floats, speeds: bool
) -> tuple[list[str], dict[str, str], float]:
    """The exponents that logarithms of commands, voltages and lift (n,) determine, why they do not determine the others, and
    the share of the lift's changes that the commands explain.

    Commands under feedback also answer to noise and to disturbances. Where these are most of what moves them, the slope of
    lift on commands tells of the autopilot, not of the rotors.
    """
    if speeds:
        keys = ("command.exponent", "command.voltage_exponent")
        return [], dict.fromkeys(keys, "rotor speeds were logged, no commands"), 1.0
    means = np.array([[one[flight == i].mean() for one in (commands, volts, lift)] for i in range(int(flight.max()) + 1)])
    command, voltage, raised = (np.stack([commands, volts, lift], axis=1) - means[flight]).T
    free: list[str] = []
    why: dict[str, str] = {}
    explained = 1.0
    for name, what, values, least in (
        ("exponent", "command", command, LEAST_SPREAD), ("voltage_exponent", "voltage", voltage, 0.5 * LEAST_SPREAD)
    ):  # fmt: skip
        spread = float(np.sqrt(np.mean(values**2)))
        if spread < least:
            varies = f"varies by {100 * spread:.2g} % within a flight" if spread > 1e-9 else NEVER
            why[f"command.{name}"] = f"the {what} {varies}"
        else:
            free.append(name)
    if "exponent" in free:
        known = np.stack([voltage, np.ones(len(voltage))], axis=1)
        x, y = (one - known @ np.linalg.lstsq(known, one, rcond=None)[0] for one in (command, raised))
        explained = float(x @ y) ** 2 / max(float((x @ x) * (y @ y)), 1e-300)
        if explained < LEAST_EXPLAINED:
            free.remove("exponent")
            why["command.exponent"] = f"the command explains only {100 * explained:.0f} % of the changes in thrust"
    return free, why, explained


class Balance(NamedTuple):
    """Mean forces fitted. free: exponents that were. names: of what all flights share, after a level for each. errors, pulls:
    of every number. left: sum of squares that is not explained.
    """

    at: ForceNumbers
    free: list[str]
    names: list[str]
    errors: Floats
    pulls: Floats
    left: float


def forces(
    block: HalfSeconds, p: PredictorParameters, geometry: Geometry, speeds: bool, rounds: int = 10, variant: Variant = PLAIN
) -> tuple[dict[str, AverageEstimate], dict[str, str]]:
    """Thrust curve, tilt and drag from mean forces, all at once, in `rounds` rounds; undetermined ones with the reason.

    m (mean acceleration - g) = mean R ((tilt_y, -tilt_x, 1) thrust - K sum w_i v_i), thrust = k_f sum w_i^2, v_i: of a hub
    through the air, w = speed c^a (V / V_n)^b. Thrust differs from flight to flight by more than it does within one, so each
    flight has a speed of its own, and the exponents come from variation within flights.
    """
    flight = np.unique(block.flight, return_inverse=True)[1].astype(np.int64)
    count = int(flight.max()) + 1
    logs, volts = np.log(np.maximum(block.commands, 1e-3)), np.log(block.volts / p.curve.nominal)
    lift = np.log(np.maximum((block.gain * block.axes[..., 2].mean(axis=1)).sum(axis=1), 1e-3))
    free, why, explained = exponents(flight, logs.mean(axis=(1, 2)), volts.mean(axis=1), lift, speeds)
    free = [one for one in free if KEYS[one] not in variant.given]
    known: dict[str, AverageEstimate] = {}
    if variant.answering and "exponent" in free:
        free = [one for one in free if one != "exponent"]
        p = p._replace(curve=p.curve._replace(exponent=min(float(p.curve.exponent) / explained, EXPONENTS[1])))
        known["command.exponent"] = AverageEstimate(float(p.curve.exponent), 0.0)
    calm, windy = (balance(block, flight, p, geometry, free, speeds, rounds, wind, variant) for wind in (False, True))
    if "exponent" in free and calm.at.exponent in EXPONENTS:
        free.remove("exponent")
        why["command.exponent"] = "no exponent of a rotor explains how thrust follows the command"
        calm, windy = (balance(block, flight, p, geometry, free, speeds, rounds, wind, variant) for wind in (False, True))
    wind = blows(block, flight, calm, windy, float(p.airframe.mass * p.airframe.gravity)) != variant.other
    at, _, names, errors, pulls, _ = windy if wind else calm
    values = {"exponent": at.exponent, "voltage_exponent": at.voltage_exponent, "x": at.tilt[0], "y": at.tilt[1]}
    values |= {"flat": max(float(at.drag[0]), 1e-12), "axial": max(float(at.drag[1]), 1e-12)}
    known |= {
        KEYS[name]: AverageEstimate(float(values[name]), float(errors[place]), float(pulls[place]))
        for place, name in enumerate(names, count)
    }
    speed = math.exp(float(at.levels.mean()))
    scatter = float(at.levels.std(ddof=1)) / math.sqrt(count) if count > 1 else 0.0
    own = math.hypot(float(np.sqrt((errors[:count] ** 2).mean() / count)), GUSTS * wind)
    known["command.speed"] = AverageEstimate(speed, speed * math.hypot(scatter, own), speed * float(pulls[:count].mean()))
    if wind:
        keys = [f"{name}[{place}]" for name in ("imu.tilt", "centre_of_gravity") for place in (0, 1)]
        why.update(dict.fromkeys(keys, "it cannot be separated from the wind"))
    return known, why


def balance(
    block: HalfSeconds, flight: NDArray[np.int64], p: PredictorParameters, geometry: Geometry, free: list[str], speeds: bool,
    rounds: int, wind: bool, variant: Variant = PLAIN,
) -> Balance:  # fmt: skip
    """The fit of mean forces. wind: whether a steady, level wind blows in each flight; then the tilt stays, as either leans
    the vehicle. It is an airspeed and not a force, since what it does changes with the lean and with the speed of the rotors;
    what is searched is K_x times the wind, as K_x may be 0.
    """
    count = int(flight.max()) + 1
    names = [*free, "flat", *(["axial"] if variant.axial else []), *(() if wind else ("x", "y"))]
    powers = (1.0, 0.0) if speeds else (float(p.curve.exponent), float(p.curve.voltage_exponent))
    tilt, drag = np.array([float(one) for one in p.tilt]), np.array([float(p.airframe.drag.rotor[i]) for i in (0, 2)])
    at = ForceNumbers(np.full(count, math.log(p.curve.speed)), *powers, tilt, drag, np.zeros((count, 2)))
    past = count + len(names)
    for _ in range(rounds):
        matrix, rest = linearised(block, flight, p, geometry, at, free, wind, variant)
        step, errors, pulls = least_squares(matrix, rest, np.repeat(clusters_of(block), 3))
        pressing = step[past : past + 2 * count].reshape(count, 2) if wind else 0.0 * at.pressing
        at = at.moved(dict(zip(names, map(float, step[count:past]), strict=True)), step[:count], pressing)
        if wind:
            least = LEAST_DRAG * float(p.airframe.mass) / float(whirl(block, flight, at).mean())
            at = at._replace(drag=np.maximum(at.drag, (least, 0.0)))
    return Balance(at, free, names, errors, pulls, float(rest @ rest))


def blows(block: HalfSeconds, flight: NDArray[np.int64], calm: Balance, windy: Balance, weight: float) -> bool:
    """Whether a wind explains the lean: where the tilt would be larger than any mounting's, or the heading turns under a
    lean as large that stays with the world.
    """
    if np.hypot(*calm.at.tilt) > MOST_TILT:
        return True
    leans = np.hypot(*windy.at.pressing[flight].T) * whirl(block, flight, windy.at) / weight
    return bool(leans.mean() > MOST_TILT) and windy.left < calm.left


def whirl(block: HalfSeconds, flight: NDArray[np.int64], at: ForceNumbers) -> Floats:
    """The mean sum of the rotors' speeds in each half second at full voltage (n,) [rad/s]."""
    return np.exp(at.levels[flight]) * (block.commands**at.exponent).sum(axis=2).mean(axis=1)


def wind_lean(block: HalfSeconds) -> float:
    """By how much a steady wind that shows in no flight may lean the vehicle in its own axes [rad]: a tilt or a centre of
    gravity apart would lean it likewise unless the heading turns. It is the largest lean that counts as a tilt, times the
    length of the mean of all headings (the mean resultant length of Mardia and Jupp, *Directional Statistics*, 2000).
    """
    noses = block.axes[..., :2, 0]
    headings = noses / np.maximum(np.linalg.norm(noses, axis=-1, keepdims=True), 1e-12)
    return MOST_TILT * float(np.linalg.norm(headings.mean(axis=(0, 1))))


def linearised(
    block: HalfSeconds, flight: NDArray[np.int64], p: PredictorParameters, geometry: Geometry, at: ForceNumbers,
    free: list[str], wind: bool, variant: Variant = PLAIN,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Slopes of the mean forces (3 n, numbers) and what they leave unexplained (3 n,). The numbers: levels of the flights, the
    exponents that are free, in-plane and axial drag, then the tilt, or the wind's pressing in each flight; then the variant's.
    """
    count, mass = len(at.levels), float(p.airframe.mass)
    logs, volts = np.log(np.maximum(block.commands, 1e-3)), np.log(block.volts / p.curve.nominal)
    turned = through_air(in_rotors_axes(block, at.tilt), at.wind[flight])
    air = hubs(turned, geometry)
    turning = np.exp(at.levels[flight][:, None, None] + at.exponent * logs + at.voltage_exponent * volts[..., None])
    thrusts = float(p.airframe.rotor.thrust) / mass * turning**2
    thrust, leaning = thrusts.sum(axis=2), turned.axes[..., 2]
    lifted = (thrust[..., None] * leaning).mean(axis=1)
    by_exponent = {
        "exponent": (2.0 * (thrusts * logs).sum(axis=2)[..., None] * leaning).mean(axis=1),
        "voltage_exponent": (2.0 * (thrust * volts)[..., None] * leaning).mean(axis=1),
    }
    flat, axial = in_and_across_plane(turned.axes, (turning[..., None] * air).sum(axis=2) / mass)
    press = pressed(turned.axes, turning.sum(axis=2) / mass, at.drag)
    columns = [2.0 * lifted * (flight == i)[:, None] for i in range(count)]
    columns += [by_exponent[name] for name in free]
    columns += [-(flat + (at.wind[flight][:, :, None] * press).sum(axis=1)), *([-axial] if variant.axial else [])]
    if wind:
        columns += [press[:, axis] * (flight == i)[:, None] for i in range(count) for axis in (0, 1)]
    else:  # a tilt about x and y
        columns += [sign * (thrust[..., None] * turned.axes[..., axis]).mean(axis=1) for sign, axis in ((-1.0, 1), (1.0, 0))]
    if variant.drifting:
        spans = np.array([np.ptp(block.row[flight == i]) for i in range(count)])
        columns += [2.0 * lifted * (block.row / np.maximum(spans, 1.0)[flight])[:, None]]
    if variant.parasitic:
        body = turned.velocity * np.linalg.norm(turned.velocity, axis=-1, keepdims=True)
        columns += [-np.einsum("nsij,nsj->nsi", turned.axes, body).mean(axis=1)]
    rest = block.gain - unfitted(turned, p, air) - (lifted - at.drag[0] * flat - at.drag[1] * axial)
    return np.stack([one.reshape(-1) for one in columns], axis=1), rest.reshape(-1)


def unfitted(block: HalfSeconds, p: PredictorParameters, air: Floats) -> Floats:
    """Mean accelerations by parasitic drag and translational lift, which no fit changes, in world axes (n, 3)."""
    drag, speed = p.airframe.drag, np.linalg.norm(block.velocity, axis=-1, keepdims=True)
    body = -speed * block.velocity * np.array([float(one) for one in drag.parasitic])
    body[..., 2] += float(drag.translational_lift) * (air[..., 0] ** 2 + air[..., 1] ** 2).sum(axis=2)
    return np.einsum("nsij,nsj->nsi", block.axes, body).mean(axis=1) / float(p.airframe.mass)


def in_and_across_plane(axes: Floats, flow: Floats) -> tuple[Floats, Floats]:
    """Of a flow in body axes (n, samples, 3) the parts in the rotors' plane and across it: means in world axes (n, 3)."""
    world = axes * flow[:, :, None, :]
    return (world[..., 0] + world[..., 1]).mean(axis=1), world[..., 2].mean(axis=1)


def pressed(axes: Floats, turning: Floats, drag: Floats) -> Floats:
    """What wind along world x and y of one over the in-plane drag does to the mean forces, shape (n, 2, 3). turning: sum of
    the rotors' speeds over the mass.
    """
    found = []
    for axis in (0, 1):
        flat, axial = in_and_across_plane(axes, turning[..., None] * axes[..., axis, :])
        found.append(flat + axial * float(drag[1] / max(drag[0], 1e-12)))
    return np.stack(found, axis=1)


def through_air(block: HalfSeconds, wind: Floats) -> HalfSeconds:
    """The averages with velocities through the air, in a wind (n, 2) along world x and y [m/s]."""
    carried = (block.axes[..., :2, :] * wind[:, None, :, None]).sum(axis=2)
    return block._replace(velocity=block.velocity - carried)
