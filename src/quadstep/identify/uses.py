"""What an identified vehicle can be trusted for, and which flights would tell the rest."""

from collections.abc import Sequence
from typing import NamedTuple

from quadstep.identify.fit import Identified
from quadstep.identify.flown_setpoints import FlightComparison, is_wrong, unlike
from quadstep.identify.known import BARELY, ROUGHLY, SIGN, UNKNOWN, WELL, grade, in_words
from quadstep.identify.replay import ErrorTable
from quadstep.identify.replay_report import to_better_guess
from quadstep.report.evidence import TableSection
from quadstep.report.units import listed


class Use(NamedTuple):
    """Something that a model may be used for. keys: of the parameters on which it rests. log: flights that tell them."""

    name: str
    keys: tuple[str, ...]
    log: str


USES = (
    Use("thrust in hover and climbs", ("command.speed", "command.exponent"), "climbs and descents that vary the thrust"),
    Use(
        "roll and pitch", ("inertia[0]", "inertia[1]", "rotor.rise_time", "command.delay"),
        "quick reversals of roll and pitch, with a motor command logged every 10 ms or faster",
    ),
    Use("yaw", ("rotor.torque_coefficient", "rotor.inertia"), "quick changes of heading"),
    Use("speed and wind", ("drag.rotor[0]", "drag.flapping"), "fast level flight in several directions"),
    Use("fast climbs and descents", ("drag.rotor[2]",), "fast climbs and descents"),
    Use(
        "drift without feedback", ("centre_of_gravity[0]", "centre_of_gravity[1]", "imu.tilt[0]", "imu.tilt[1]"),
        "slow turns through every heading; indoors, pass --still-air",
    ),
    Use("a battery that empties", ("command.voltage_exponent",), "most of a charge, with the voltage logged"),
)  # fmt: skip

FROM_WORST = (UNKNOWN, SIGN, BARELY, ROUGHLY, WELL)
LATE = ("rotor.rise_time", "command.delay")
"""Together these make a loop late, so that an error of one is to be seen beside both."""


def grades(fit: Identified, keys: Sequence[str]) -> dict[str, str]:
    """How well each is known."""
    return {key: grade(fit.fitted[key]) if key in fit.fitted else UNKNOWN for key in keys}


def uses(fit: Identified) -> TableSection:
    """A row for each use, which is as good as the parameter of it that is known least."""
    rows = []
    for one in USES:
        known = grades(fit, one.keys)
        worst = min(known.values(), key=FROM_WORST.index)
        weak = [in_words(key) for key, how in known.items() if how == worst]
        log = one.log if worst in (UNKNOWN, SIGN, BARELY) else ""
        rows.append((one.name, worst, listed(weak) if worst != WELL else "", log))
    text = (
        "Each use rests on several parameters and is as good as the one of them that is known least. Fly the manoeuvres in "
        "the last column in another log to learn more about it."
    )
    header = ("the model's", "is known", "least known", "a log that would help")
    return TableSection("What the model can be trusted for", "uses", header, rows, text, shown="What the model is good for")


def tuning(
    fit: Identified, compared: ErrorTable | None, flown: Sequence[FlightComparison], thrust: tuple[float, float] | None
) -> str:
    """Whether to tune a controller for roll and pitch on it. compared: predictions of held-out flights from commands."""
    known = grades(fit, ("command.speed", *USES[1].keys))
    if set(LATE) <= fit.fitted.keys():
        both = sum(fit.fitted[key].value for key in LATE)
        known |= {key: grade(fit.fitted[key], both) for key in LATE}
    weak = [in_words(key) for key, how in known.items() if how in (UNKNOWN, BARELY)]
    against = [f"{listed(weak)} {'is' if len(weak) == 1 else 'are'} not known well enough"] * bool(weak)
    worse = [one for one in ("attitude", "rates") if compared and to_better_guess(compared, one)[0].value >= 1.0]
    against += [f"on held-out flights it predicts {listed(worse)} no better than a baseline without a model"] * bool(worse)
    against += ["its thrust is wrong by more than 5 %"] * is_wrong(thrust)
    against += unlike(flown)
    against += ["no flight was held out, so nothing shows how well it predicts others"] * (compared is None)
    if against:
        return f"Do not tune a controller on this model yet: {'; '.join(against)}."
    return "Nothing found here speaks against tuning roll and pitch on this model, which still is no proof that the gains fly."
