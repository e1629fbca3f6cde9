"""Flights of vehicles of known truth by a simulator that shares no code with the package, as logs of an autopilot.

Many X quadrotors at once, in NumPy: Runge-Kutta 4 at 1 ms; in-plane, axial and quadratic drag, flapping, rotor inertia, an
exponent and a delay of commands, a battery that sags, wind and gusts; under a cascade of P and PID loops at 500 Hz with noise.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.logs.flight import FlightRecord
from quadstep.mission.airframe import AirframeSection

Floats = NDArray[np.float64]
Vehicles = dict[str, Floats]

STEP, LOGGED, SENSED, GUIDED, LONGEST = 0.001, 10, 2, 10, 20
"""Of the integration [s]; steps from one row of the log to the next, and between samples of law and guidance; steps of the
longest delay.
"""

SPIN = np.array([1.0, 1.0, -1.0, -1.0])
CORNERS = np.array([[1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0]])
UP = np.array([0.0, 0.0, 1.0])
GRAVITY, FULL = 9.81, 16.8


class Case(NamedTuple):
    """A log, the vehicle to start from, the true values by key, and what was drawn."""

    flight: FlightRecord
    start: AirframeSection
    truth: dict[str, float]
    drawn: str


def drawn(random: np.random.Generator, n: int) -> Vehicles:
    """Vehicles of 0.4 to 2.5 times an x500's length, their paths, air and noise."""
    size = 10.0 ** random.uniform(-0.4, 0.4, n)
    mass, arm = 2.28 * size**3 * random.uniform(0.7, 1.3, n), 0.17678 * size
    roll = 0.024 * size**5 * random.uniform(0.7, 1.4, n)
    thrust = 8.5e-6 * size**4
    hover = np.sqrt(mass * GRAVITY / 4.0 / thrust)
    rise, delay = 0.045 * size**0.7 * random.uniform(0.5, 1.3, n), random.choice([0.0, 0.005, 0.01, 0.015], n)
    gain, drag = 0.8 / (rise + delay + 0.004), mass * random.uniform(0.1, 0.5, n) / (4.0 * hover)
    omega = random.choice([0.4, 0.7, 1.0, 1.4], n)
    sag = np.where(random.random(n) < 0.35, random.uniform(0.05, 0.15, n), 0.0)
    pitch, yaw = roll * random.uniform(0.8, 1.25, n), 1.8 * roll * random.uniform(0.9, 1.0, n)

    def sometimes(share: float, low: float, high: float) -> Floats:
        return np.where(random.random(n) < share, random.uniform(low, high, n), 0.0)

    return {
        "mass": mass, "arm": arm, "inertia": np.stack([roll, pitch, yaw], 1), "thrust": thrust,
        "torque": thrust * 0.016 * size * random.uniform(0.7, 1.3, n), "fastest": hover * random.uniform(1.3, 1.9, n),
        "rotor": 2.65e-5 * size**5 * random.uniform(0.5, 2.0, n), "rise": rise, "delay": delay,
        "exponent": random.uniform(0.8, 1.1, n), "drag": np.stack([drag, drag, drag * random.uniform(0.5, 1.3, n)], 1),
        "parasitic": sometimes(0.3, 0.0, 0.02) * mass, "flapping": sometimes(0.5, 0.02, 0.04) * drag * arm,
        "centre": np.concatenate([random.normal(0.0, 0.01, (n, 2)) * arm[:, None], np.zeros((n, 1))], 1),
        "gain": gain, "place": 0.6 * random.uniform(0.7, 1.5, n),
        "speed": np.minimum(2.5, 0.09 * gain) * random.uniform(0.7, 1.2, n),
        "omega": omega, "amplitude": random.choice([0.05, 0.7, 1.5, 3.0], n) / (1.0 + 0.5 * omega),
        "eight": random.choice([0.0, 1.0], n), "vertical": random.choice([0.0, 0.3], n),
        "wind": np.concatenate([random.uniform(-4.0, 4.0, (n, 2)) * (random.random((n, 1)) < 0.4), np.zeros((n, 1))], 1),
        "gusts": sometimes(0.4, 0.1, 0.8), "turn": random.choice([0.0, 0.0, 0.5], n),
        "gyro": random.choice([0.003, 0.02], n), "noise": random.choice([0.3, 1.0], n),
        "sag": sag, "volts": sag * (random.random(n) < 0.5),
    }  # fmt: skip


def product(q: Floats, r: Floats) -> Floats:
    """Of quaternions (n, 4), scalar first."""
    w, v, scalar, u = q[:, :1], q[:, 1:], r[:, :1], r[:, 1:]
    return np.concatenate([w * scalar - (v * u).sum(1, keepdims=True), w * u + scalar * v + cross(v, u)], 1)


def cross(a: Floats, b: Floats) -> Floats:
    """As NumPy's, in a fifth of the time."""
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def axes(q: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) from body to world."""
    hat = cross(np.eye(3)[None], q[:, None, 1:])
    found: Floats = np.eye(3) + 2.0 * q[:, 0, None, None] * hat + 2.0 * hat @ hat
    return found


def unit(x: Floats) -> Floats:
    found: Floats = x / np.linalg.norm(x, axis=1, keepdims=True)
    return found


def column(x: Floats) -> Floats:
    return x[:, None]


def derivative(v: Vehicles, rotors: Floats, state: tuple[Floats, ...], target: Floats, air: Floats) -> tuple[Floats, ...]:
    """Of position, velocity, attitude, rates and rotor speeds. rotors: their places (n, 4, 3)."""
    _, moving, q, rates, turning = state
    turn, spun = axes(unit(q)), column(v["rotor"]) * SPIN
    flow = np.einsum("nji,nj->ni", turn, moving - air)
    hubs = turning[:, :, None] * (flow[:, None] + cross(rates[:, None], rotors))
    pushes = -v["drag"][:, None] * hubs
    pushes[:, :, 2] += column(v["thrust"]) * turning**2
    faster = (target - turning) / column(v["rise"])
    torque = cross(rotors, pushes).sum(1) + column(v["flapping"]) * cross(hubs, UP).sum(1)
    torque[:, 2] -= (SPIN * column(v["torque"]) * turning**2 + spun * faster).sum(1)
    momentum = v["inertia"] * rates + column((spun * turning).sum(1)) * UP
    force = pushes.sum(1) - column(v["parasitic"]) * np.linalg.norm(flow, axis=1, keepdims=True) * flow
    gain = np.einsum("nij,nj->ni", turn, force) / column(v["mass"]) - GRAVITY * UP
    spin = 0.5 * product(q, np.concatenate([np.zeros((len(q), 1)), rates], 1))
    return moving, gain, spin, (torque - cross(rates, momentum)) / v["inertia"], faster


def goal(v: Vehicles, t: float) -> tuple[Floats, Floats]:
    """Where the vehicles should be at a time [s], and where their noses should point."""
    phase, wide, turned = v["omega"] * t, min(t / 3.0, 1.0) * v["amplitude"], v["turn"] * t
    sideways = v["eight"] * np.sin(2.0 * phase) / 2.0 + (1.0 - v["eight"]) * (1.0 - np.cos(phase))
    place = np.stack([wide * np.sin(phase), wide * sideways, 5.0 + wide * v["vertical"] * np.sin(1.3 * phase)], 1)
    return place, np.stack([np.cos(turned), np.sin(turned), 0.0 * turned], 1)


def flown(v: Vehicles, random: np.random.Generator, seconds: float) -> list[tuple[Floats, ...]]:
    """Rows of time, commands, position, velocity, attitude, rates and share of the full voltage, of all vehicles."""
    n = len(v["mass"])
    rotors = np.concatenate([CORNERS[None] * v["arm"][:, None, None], np.zeros((n, 4, 1))], 2) - v["centre"][:, None]
    ratio = column(v["torque"] / v["thrust"])
    mixer = np.linalg.inv(np.stack([np.ones((n, 4)), rotors[:, :, 1], -rotors[:, :, 0], -SPIN * ratio], 1))
    at, moving, rates = np.tile([0.0, 0.0, 5.0], (n, 1)), np.zeros((n, 3)), np.zeros((n, 3))
    q = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    turning = np.repeat(column(np.sqrt(v["mass"] * GRAVITY / 4.0 / v["thrust"])), 4, 1)
    command = (turning / column(v["fastest"])) ** (1.0 / column(v["exponent"]))
    waiting, late = np.repeat(command[None], LONGEST, 0), (v["delay"] / STEP).round().astype(int)
    gust, summed, steady, slope, before = (np.zeros((n, 3)) for _ in range(5))
    rows: list[tuple[Floats, ...]] = []
    wanted, thrust, rate_gain = axes(q), v["mass"] * GRAVITY, v["gain"][:, None] * np.array([1.0, 1.0, 0.4])

    for step in range(round(seconds / STEP)):
        t = step * STEP
        share, turn = 1.0 - v["sag"] * t / seconds, axes(q)
        if step % SENSED == 0:
            felt = rates + column(v["gyro"]) * random.normal(size=(n, 3))
            if step % GUIDED == 0:
                place, nose = goal(v, t)
                off = place - at - 2e-3 * random.normal(size=(n, 3))
                error = column(v["place"]) * off - moving - 5e-3 * random.normal(size=(n, 3))
                steady = np.clip(steady + 0.003 * error, -2.0, 2.0)
                asked = column(v["speed"]) * (error + steady) + GRAVITY * UP
                asked = np.clip(asked, [-6.0, -6.0, 4.0], [6.0, 6.0, 16.0])
                top = unit(asked)
                left = unit(cross(top, nose))
                wanted = np.stack([cross(left, top), left, top], 2)
                thrust = v["mass"] * (asked * turn[:, :, 2]).sum(1)
            apart = np.einsum("nji,njk->nik", wanted, turn)
            lean = 0.5 * np.stack([apart[:, i, j] - apart[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], 1)
            faster_than = -column(v["gain"]) * np.array([0.3, 0.3, 0.12]) * lean + column(v["turn"]) * UP - felt
            slope, before = slope + 0.2 * ((felt - before) / (SENSED * STEP) - slope), felt
            summed = np.clip(summed + SENSED * STEP * faster_than, -1.0, 1.0)
            damping = 0.5 * column(v["gain"] * v["rise"]) * np.array([1.0, 1.0, 0.0])
            torque = v["inertia"] * (rate_gain * (faster_than + summed) - damping * slope)
            squares = np.einsum("nij,nj->ni", mixer, np.concatenate([column(thrust), torque], 1)) / column(v["thrust"])
            speeds = np.sqrt(np.maximum(squares, (0.1 * column(v["fastest"])) ** 2))
            command = np.clip(speeds / column(v["fastest"]), 0.0, 1.0) ** (1.0 / column(v["exponent"]))
        waiting = np.concatenate([command[None], waiting[:-1]])
        if step % LOGGED == 0:
            rows.append((np.full(n, t), command, at, moving, q, rates, share))
        target = column(v["fastest"] * share) * waiting[late, np.arange(n)] ** column(v["exponent"])
        gust = gust * (1.0 - STEP / 1.5) + column(v["gusts"]) * np.sqrt(2.0 * STEP / 1.5) * random.normal(size=(n, 3))
        state, air = (at, moving, q, rates, turning), v["wind"] + gust
        slopes = [derivative(v, rotors, state, target, air)]
        for ahead in (0.5, 0.5, 1.0):
            there = tuple(x + ahead * STEP * dx for x, dx in zip(state, slopes[-1], strict=True))
            slopes.append(derivative(v, rotors, there, target, air))
        at, moving, q, rates, turning = (
            x + STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d) for x, a, b, c, d in zip(state, *slopes, strict=True)
        )
        q = unit(q)
    return rows


def record(v: Vehicles, rows: list[tuple[Floats, ...]], i: int, random: np.random.Generator) -> FlightRecord:
    """The log of a vehicle's flight, with noise, after it stood for 0.2 s."""
    time, motors, at, moving, q, rates, share = (np.array([row[part][i] for row in rows]) for part in range(7))
    noise = float(v["noise"][i])

    def measured(values: Floats, deviation: float) -> Floats:
        return values + noise * random.normal(0.0, deviation, values.shape)

    small = np.concatenate([np.ones((len(time), 1)), noise * random.normal(0.0, 5e-4, (len(time), 3))], 1)
    channels = {
        "position": measured(at, 2e-3), "velocity": measured(moving, 3e-3), "attitude": unit(product(q, small)),
        "rates": measured(rates, 5e-3),
    }  # fmt: skip
    if v["volts"][i] > 0.0:
        channels["voltage"] = FULL * column(share * (1.0 + 1e-3 * random.normal(size=len(time))))
    motors[:20] = 0.0
    channels["position"][:20, 2] = 4.0
    return FlightRecord("independent", time, LOGGED * STEP, motors, False, channels, (), np.zeros(len(time), dtype=bool))


def start(v: Vehicles, i: int, random: np.random.Generator) -> AirframeSection:
    """A vehicle whose numbers are up to 30 % off, except those that flights do not reveal."""

    def wrong(value: float) -> float:
        return float(value * np.exp(random.uniform(-0.3, 0.3)))

    arm, drag, (roll, pitch, yaw) = float(v["arm"][i]), v["drag"][i], v["inertia"][i]
    level, lag, roll, pitch = wrong(drag[0]), wrong(v["rise"][i]), wrong(roll), wrong(pitch)
    rotor = {
        "thrust_coefficient": float(v["thrust"][i]), "torque_coefficient": wrong(v["torque"][i]), "radius": 0.7 * arm,
        "inertia": wrong(v["rotor"][i]), "rise_time": lag, "fall_time": lag, "slowest": 0.0, "fastest": wrong(v["fastest"][i]),
    }  # fmt: skip
    places = [
        {"position": (x * arm, y * arm, 0.0), "spin": "ccw" if s > 0.0 else "cw"}
        for (x, y), s in zip(CORNERS, SPIN, strict=True)
    ]
    content: dict[str, object] = {
        "mass": float(v["mass"][i]), "gravity": GRAVITY, "inertia": (roll, pitch, min(float(yaw), 0.99 * (roll + pitch))),
        "rotors": places, "rotor": rotor,
        "drag": {"parasitic": (0.0, 0.0, 0.0), "rotor": (level, level, wrong(drag[2])), "flapping": 0.0,
                 "translational_lift": 0.0},
        "battery": {"full": FULL, "empty": 13.2, "capacity": 18000.0, "resistance": 0.02, "efficiency": 0.8},
    }  # fmt: skip
    return AirframeSection.model_validate(content)


def truth(v: Vehicles, i: int) -> dict[str, float]:
    """The true values by key. A command acts from the next step on."""
    every: dict[str, Any] = {
        "command.speed": v["fastest"], "command.exponent": v["exponent"], "rotor.rise_time": v["rise"],
        "command.delay": v["delay"] + STEP, "inertia[0]": v["inertia"][:, 0], "inertia[1]": v["inertia"][:, 1],
        "rotor.torque_coefficient": v["torque"], "rotor.inertia": v["rotor"], "drag.rotor[0]": v["drag"][:, 0],
        "drag.rotor[2]": v["drag"][:, 2], "drag.flapping": v["flapping"], "centre_of_gravity[0]": v["centre"][:, 0],
        "centre_of_gravity[1]": v["centre"][:, 1],
    }  # fmt: skip
    return {"command.voltage_exponent": 1.0, "imu.tilt[0]": 0.0, "imu.tilt[1]": 0.0} | {
        k: float(x[i]) for k, x in every.items()
    }


def cases(seed: int, n: int, seconds: float) -> list[Case]:
    """Flights of n vehicles."""
    random = np.random.default_rng(seed)
    v = drawn(random, n)
    rows = flown(v, random, seconds)
    said = ("exponent", "delay", "sag", "volts", "wind", "gusts", "parasitic", "flapping", "omega", "amplitude", "turn")
    told = [", ".join(f"{key} {np.round(v[key][i], 4).tolist()}" for key in said) for i in range(n)]
    return [Case(record(v, rows, i, random), start(v, i, random), truth(v, i), told[i]) for i in range(n)]
