"""Flights that nobody would call as commanded, on paths and vehicles drawn at random: what does their grade say?"""

import math
from collections.abc import Iterable

import numpy as np

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.linear.wind_limit import cannot_hover
from quadstep.metrics.quantities import position_errors
from quadstep.metrics.verdict import FlightGrade, graded
from quadstep.mission.schema import Mission
from tests.challenge.search import Attempt, Search

STEPPING = "pid", "geometric", "lqr"

VEHICLES = ("x500", "crazyflie", "hummingbird", "research-2.6kg")


def verdict(content: dict[str, object], case: str) -> Attempt:
    """Whether a flight that reaches its end is called as commanded."""
    mission = Mission.model_validate(content)
    log = fly(mission.plan())
    if log.outcome is not Outcome.COMPLETED:
        return Attempt(0.0, case)
    found = graded(mission.flight_metrics(log)[0])
    return Attempt(2.0 if found.grade is FlightGrade.AS_COMMANDED else 0.0, f"{case}: {found.grade.value} {found.reasons}")


def lost_rotors(seed: int) -> Iterable[Attempt]:
    """A rotor stops 0.1 to 3 s before the end of a flight around a circle, in a hover or after a step, calm or in wind."""
    random = np.random.default_rng(seed)
    while True:
        vehicle, radius = str(random.choice(VEHICLES)), float(random.choice([0.0, 1.0, 3.0]))
        duration, late = float(random.uniform(5.0, 20.0)), float(0.1 * 30.0 ** random.uniform())
        circle = {"type": "circle", "centre": [0.0, 0.0, 9.0], "radius": radius, "period": 3.0 + 4.0 * radius, "ramp": 2.0}
        size, law = float(random.choice([0.0, 1.0, 2.0])), str(random.choice(STEPPING))
        hover = {"type": "step", "start": [0.0, 0.0, 9.0], "end": [size, 0.0, 9.0], "duration": 2.0}
        speed = float(random.choice([0.0, 3.0]))
        content = {
            "vehicle": {"preset": vehicle},
            "controller": {"type": law},
            "path": circle if radius else hover,
            "wind": {"mean": [speed, 0.0, 0.0]},
            "simulation": {"duration": duration},
            "events": [{"type": "rotor", "time": duration - late, "rotor": int(random.integers(1, 5)), "efficiency": 0.0}],
        }
        yield verdict(
            content,
            f"{vehicle}, {law}, radius {radius:g} m, step {size:g} m, wind {speed:g} m/s, {duration:.6g} s, "
            f"lost {late:.6g} s before",
        )


def blown_off(seed: int) -> Iterable[Attempt]:
    """A gust carries a vehicle away in the last second of a flight, long after a step: to two arms and half the step or
    more, and still by 0.5 m/s.
    """
    random = np.random.default_rng(seed)
    while True:
        vehicle, law = str(random.choice(VEHICLES)), str(random.choice(STEPPING))
        size, duration, speed = (
            float(random.uniform(0.0, 2.0)),
            float(random.uniform(6.0, 15.0)),
            float(random.uniform(10.0, 40.0)),
        )
        heading, start = float(random.uniform(-math.pi, math.pi)), float(random.uniform(0.2, 1.0))
        gust = {
            "velocity": [speed * math.cos(heading), speed * math.sin(heading), 0.0],
            "start": duration - start,
            "length": start,
        }
        content = {
            "vehicle": {"preset": vehicle},
            "path": {"type": "step", "start": [0.0, 0.0, 9.0], "end": [size, 0.0, 9.0]},
            "controller": {"type": law},
            "wind": {"gust": gust},
            "simulation": {"duration": duration},
        }
        mission = Mission.model_validate(content)
        log = fly(mission.plan())
        off = np.linalg.norm(position_errors(log)[[-11, -1]], axis=1)
        far = off[1] > max(2.0 * mission.arm, 0.5 * size)
        leaving = far and (off[1] - off[0]) / float(log.column("t")[-1] - log.column("t")[-11]) > 0.5
        found = graded(mission.flight_metrics(log)[0])
        good = found.grade is FlightGrade.AS_COMMANDED
        said = f"{vehicle}, {law}, step {size:.6g} m, {duration:.6g} s, gust {speed:.6g} m/s at {heading:.6g} rad"
        said += f" from {start:.6g} s before its end: {off[1]:.3g} m off, {found.grade.value}"
        yield Attempt(2.0 if leaving and good else 0.0, said)


def far_off(seed: int) -> Iterable[Attempt]:
    """A straight path of 50 m to 2 km, flown by gains so low that wind holds the vehicle more than 3 m off."""
    random = np.random.default_rng(seed)
    while True:
        length, speed = float(50.0 * 40.0 ** random.uniform()), float(random.uniform(6.0, 12.0))
        gain, heading = float(random.uniform(0.03, 0.3)), float(random.uniform(-math.pi, math.pi))
        duration = max(20.0, length / 10.0)
        content = {
            "vehicle": {"preset": "x500"},
            "path": {"type": "minimum-jerk", "start": [0.0, 0.0, 50.0], "end": [length, 0.0, 50.0], "duration": duration},
            "wind": {"mean": [speed * math.cos(heading), speed * math.sin(heading), 0.0]},
            "controller": {"type": "pid", "velocity_integral": 0.0, "position": gain},
        }
        mission = Mission.model_validate(content)
        log = fly(mission.plan())
        metrics, _ = mission.flight_metrics(log)
        off = float(str(metrics["position_rmse[m]"]))
        asked = graded(metrics).grade is FlightGrade.AS_COMMANDED
        where = f"{length:.6g} m, wind {speed:.6g} m/s at {heading:.6g} rad, gain {gain:.6g}"
        yield Attempt(off / 3.0 if asked else 0.0, f"{where}: {off:.3g} m off")


LAWS = {"pid": "rate", "geometric": "k_Omega"}
"""Laws, and their gain of the rates [1/s]: from some value on, a limit cycle."""

STILL, STRONG = math.radians(4.0), math.radians(6.5)
"""Below the first, an axis does not shake; above the second it does: `shaking` weighs swings of 2 Hz and more by 0.87
to 1.22.
"""


def swinging(log: FlightLog) -> tuple[float, float]:
    """RMS angle [rad] of the thrust's axis in the second half of a flight, by its spectrum: of all but its mean, and of what
    is faster than 2 Hz.
    """
    t, (w, x, y, z) = log.column("t"), log.table("q_w", "q_x", "q_y", "q_z").T
    late = slice(len(t) // 2, None)
    lean = np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x)], axis=1)[late]
    fade = np.hanning(len(lean))[:, None]  # without, what is slow leaks into what is fast
    lines = np.fft.rfft(fade * (lean - lean.mean(axis=0)), axis=0) / math.sqrt(float((fade**2).mean()))
    fast = np.fft.rfftfreq(len(lean), float(t[1] - t[0])) > 2.0
    every, quick = (math.sqrt(2.0 * float((np.abs(one) ** 2).sum())) / len(lean) for one in (lines, lines[fast]))
    return every, quick


def shakes(seed: int) -> Iterable[Attempt]:
    """Hovers and slow circles, calm, in turbulence and in a gust, by gains from dull to ones that oscillate."""
    random = np.random.default_rng(seed)
    while True:
        vehicle, law = str(random.choice(VEHICLES)), str(random.choice(list(LAWS)))
        radius, gain = float(random.choice([0.0, 1.0])), float(8.0 * 40.0 ** random.uniform())
        wind, gust = float(random.choice([0.0, 5.0, 10.0])), float(random.choice([0.0, 8.0]))
        circle = {"type": "circle", "centre": [0.0, 0.0, 9.0], "radius": radius, "period": 10.0, "ramp": 2.0}
        hover = {"type": "step", "start": [0.0, 0.0, 9.0], "end": [0.0, 0.0, 9.0], "duration": 2.0}
        air: dict[str, object] = {"mean": [wind, 0.0, 0.0]}
        air |= {"turbulence": {"wind_20": wind}} if wind else {}
        air |= {"gust": {"velocity": [0.0, gust, 0.0], "start": 5.0, "length": 1.0}} if gust else {}
        content = {
            "vehicle": {"preset": vehicle},
            "path": circle if radius else hover,
            "wind": air,
            "controller": {"type": law, LAWS[law]: gain},
            "simulation": {"duration": 8.0},
        }
        mission = Mission.model_validate(content)
        log = fly(mission.plan())
        if log.outcome is not Outcome.COMPLETED:
            continue
        every, quick = swinging(log)
        called = any("swung" in one for one in graded(mission.flight_metrics(log)[0]).reasons)
        said = f"{vehicle}, {law}, {gain:.6g}/s, radius {radius:g} m, wind {wind:g}, gust {gust:g} m/s: swings by "
        said += f"{math.degrees(every):.3g} degrees rms, {math.degrees(quick):.3g} faster than 2 Hz; called shaking: {called}"
        yield Attempt(2.0 if (called and every < STILL) or (quick > STRONG and not called) else 0.0, said)


def held(seed: int) -> Iterable[Attempt]:
    """Vehicles in the weakest wind in which they are said not to be able to hover: how far does a PID let them drift?"""
    random = np.random.default_rng(seed)
    while True:
        vehicle, heading = str(random.choice(VEHICLES)), float(random.uniform(-math.pi, math.pi))
        content: dict[str, object] = {
            "vehicle": {"preset": vehicle},
            "path": {"type": "step", "start": [0.0, 0.0, 90.0], "end": [0.0, 0.0, 90.0], "duration": 2.0},
            "controller": {"type": "pid"},
            "simulation": {"duration": 60.0},
        }
        lift = float(random.choice([0.0, 0.0, 2.0, -2.0]))
        low, high = 0.0, 200.0
        while high - low > 0.001 * high:
            speed = 0.5 * (low + high)
            wind = {"mean": [speed * math.cos(heading), speed * math.sin(heading), lift]}
            mission = Mission.model_validate(content | {"wind": wind})
            low, high = (low, speed) if cannot_hover(mission.plan()) else (speed, high)
        if high == 200.0:
            continue
        wind = {"mean": [high * math.cos(heading), high * math.sin(heading), lift]}
        log = fly(Mission.model_validate(content | {"wind": wind}).plan())
        late = log.rows[log.column("t") >= log.ended - 10.0]
        place = [list(log.columns).index(name) for name in "xyz"]
        drift = float(np.linalg.norm(np.ptp(late[:, place], axis=0)))
        held = log.outcome is Outcome.COMPLETED and drift < 0.1
        said = f"{vehicle}, wind {high:.6g} m/s at {heading:.6g} rad, {lift:g} m/s upwards: {drift:.3g} m in its last 10 s"
        yield Attempt(2.0 if held else 0.0, said)


SEARCHES = [
    Search(
        "cannot hover", "no vehicle holds its place in a wind in which it is said not to be able to hover", held, slow=True
    ),
    Search(
        "as commanded, a lost rotor",
        "no flight that loses a rotor 0.1 s before its end or earlier is as commanded",
        lost_rotors,
    ),
    Search("as commanded, blown off", "no flight that a gust carries away at its end is as commanded", blown_off),
    Search(
        "as commanded, far off",
        "no flight that is off its path by more than 3 m on average is as commanded",
        far_off,
        bound=True,
    ),
    Search("shaking", "a flight is called shaking if its thrust's axis shakes, and not if it does not", shakes),
]
