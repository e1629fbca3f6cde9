"""What an identified vehicle can be trusted for, and which flights would tell the rest."""

import math
from collections.abc import Sequence

from quadstep.identify.fit import Fitted, Identified
from quadstep.identify.flown_setpoints import is_wrong
from quadstep.identify.known import in_words
from quadstep.identify.replay import ErrorTable
from quadstep.identify.replay_report import facts, to_better_guess
from quadstep.report.evidence import TableSection
from quadstep.report.markup import Fact
from quadstep.report.units import interval_texts, listed, number

ENOUGH = 0.5
"""Share of itself within which a number must be known for a use that rests on it."""

SPEED, LATENESS = "command.speed", "rotor lag and delay"
"""What thrust grows with; what makes a loop late, of which flights tell the sum better than the parts."""

TUNED = {"roll": "inertia[0]", "pitch": "inertia[1]"}
"""The loops that are tuned on a model, and the inertia of each."""

QUICK = "quick reversals of {}, with a motor command logged every 10 ms or faster"

USES = {
    **{axis: ((axis, LATENESS), QUICK.format(axis)) for axis in TUNED},
    "yaw": (("rotor.torque_coefficient", "rotor.inertia"), "quick changes of heading"),
    "thrust in hover and climbs": ((SPEED, "command.exponent"), "climbs and descents that vary the thrust"),
    "speed and wind": (("drag.rotor[0]", "drag.flapping"), "fast level flight in several directions"),
    "fast climbs and descents": (("drag.rotor[2]",), "fast climbs and descents"),
    "drift without feedback": (
        ("centre_of_gravity[0]", "centre_of_gravity[1]", "imu.tilt[0]", "imu.tilt[1]"),
        "slow turns through every heading",
    ),
    "a battery that empties": (("command.voltage_exponent",), "most of a charge, with the voltage logged"),
}
"""What a model may be used for: the keys of the parameters on which it rests, an axis for the gain of its loop, and a log that
tells them.
"""

NAMES = tuple(dict.fromkeys(key for keys, _ in USES.values() for key in keys))


def of(fit: Identified, key: str) -> Fitted | None:
    """What a use rests on, if the flights determine it; of the gain of a loop, the inertia."""
    return fit.late if key == LATENESS else fit.fitted.get(TUNED.get(key, key))


def reach(fit: Identified, key: str) -> tuple[float, float]:
    """How far an interval goes below and above the value, as shares of it; infinite for what is zero, not determined, or has
    either sign. That of a gain is by the ends of both: of the full command's thrust, which grows with the square of its speed,
    over the inertia. What no flight reveals cancels.
    """
    one = of(fit, key)
    if one is None or one.either_sign or one.value == 0.0 or (key in TUNED and SPEED not in fit.fitted):
        return math.inf, math.inf
    if key in TUNED:
        speed = fit.fitted[SPEED]
        low, high = ((end / speed.value) ** 2 for end in (speed.low, speed.high))
        return float(1.0 - low * one.value / one.high), float(high * one.value / one.low - 1.0)
    return float((one.value - one.low) / abs(one.value)), float((one.high - one.value) / abs(one.value))


def within(fit: Identified, key: str) -> str:
    """Within which share of itself it is known."""
    size, one = max(reach(fit, key)), of(fit, key)
    if size < math.inf:
        return f"{number(100.0 * size, 2)} %"
    return "sign unknown" if one and (one.either_sign or one.value == 0.0) else "not determined"


def in_short(key: str) -> str:
    return f"gain of {key}" if key in TUNED else key if key == LATENESS else in_words(key)


def uses(fit: Identified) -> TableSection:
    """A row for each use, which is as good as the parameter of it that is known least."""
    rows = []
    for name, (keys, log) in USES.items():
        sizes = {key: max(reach(fit, key)) for key in keys}
        worst = [key for key, size in sizes.items() if size == max(sizes.values())]
        rows.append((name, within(fit, worst[0]), listed(list(map(in_short, worst))), log))
    header = ("use", "known to within", "least known", "flights that tell more")
    return TableSection(
        "What the model can be trusted for", "uses", header, rows, shown="What the model is good for", columns=(0, 1, 2)
    )


def cards(fit: Identified, compared: ErrorTable | None, period: float) -> list[Fact]:
    """What a tuner needs of roll and pitch, and how well the rates of held-out flights are predicted."""
    shown = []
    for axis in TUNED:
        size = within(fit, axis)
        shown.append(Fact(in_short(axis), f"within {size}" if "%" in size else size, "full thrust over inertia, 95 %"))
    if fit.late:
        value, low, high, unit = interval_texts(*fit.late[:3], "s", 0.05)
        shown.append(Fact(LATENESS, value + unit, f"95 % interval: {low} to {high}{unit}"))
    if not compared:
        return [*shown, Fact("held-out flights", "none")]
    rates = facts(compared, period)[-1]
    return [*shown, rates._replace(what=f"held-out {rates.what}")]


def tuning(
    fit: Identified, compared: ErrorTable | None, thrust: tuple[float, float] | None, idle: Sequence[str] = ()
) -> str:  # fmt: skip
    """Whether to tune roll and pitch on it, and what to fly if not. compared: predictions of held-out flights from commands;
    idle: which of the two no held-out flight turns about.
    """
    weak = {axis: [key for key in USES[axis][0] if max(reach(fit, key)) > ENOUGH] for axis in TUNED}
    worse = [one for one in ("attitude", "rates") if compared and to_better_guess(compared, one).value >= 1.0]
    against = [f"on held-out flights it predicts {listed(worse)} no better than a baseline without a model"] * bool(worse)
    against += ["its thrust is wrong by more than 5 %"] * is_wrong(thrust)
    against += ["no flight was held out to test it: log four or more"] * (compared is None)
    unknown = list(dict.fromkeys(key for keys in weak.values() for key in keys))
    open_axes = [*TUNED] if against else [axis for axis in TUNED if weak[axis] or axis in idle]
    ready = [axis for axis in TUNED if axis not in open_axes]
    if unknown:
        names = [f"the {in_short(key)}" for key in unknown]
        against.append(f"{listed(names)} {'is' if len(names) == 1 else 'are'} not known to within {100.0 * ENOUGH:.0f} %")
    against += [f"no held-out flight turns much about {listed(idle, 'or')}"] * bool(idle)
    if not against:
        least = max((key for axis in TUNED for key in USES[axis][0]), key=lambda key: max(reach(fit, key)))
        enough = f"known to within {within(fit, least)}; {100.0 * ENOUGH:.0f} % is enough"
        judged = "yaw is not judged: held-out flights test roll and pitch only"
        return f"Roll and pitch ({enough}) can be tuned on this model; {judged}."
    can = f"{listed(ready).capitalize()} can be tuned on this model; do not yet tune" if ready else "Do not yet tune"
    speed = bool(TUNED.keys() & set(unknown)) and max(reach(fit, SPEED)) > 0.25 * ENOUGH  # half of what a gain may be off
    short = [axis for axis in TUNED if axis in idle or weak[axis]]
    fly = [USES["thrust in hover and climbs"][1]] * speed + [QUICK.format(listed(short))] * bool(short)
    said = f"{can} {listed(open_axes)}{'' if ready else ' on this model'}: {'; '.join(against)}."
    return f"{said} Next, fly {listed(fly)}." if fly else said
