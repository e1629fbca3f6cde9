"""What an identified vehicle can be trusted for, and which flights would tell the rest."""

from collections.abc import Sequence

from quadstep.identify.fit import Identified
from quadstep.identify.flown_setpoints import FAR, FlightComparison, is_wrong, unlike
from quadstep.identify.known import BARELY, FROM_WORST, ROUGHLY, UNKNOWN, WELL, be, grade, in_words
from quadstep.identify.replay import ErrorTable
from quadstep.identify.replay_report import facts, to_better_guess
from quadstep.report.evidence import TableSection
from quadstep.report.markup import Fact
from quadstep.report.units import listed

TUNED, LATE = "roll and pitch", ("rotor.rise_time", "command.delay")
"""The use of which tuning is; what makes its loop late together, so that an error of one is to be seen beside both."""

USES = {
    "thrust in hover and climbs": (("command.speed", "command.exponent"), "climbs and descents that vary the thrust"),
    TUNED: (
        ("inertia[0]", "inertia[1]", *LATE),
        "quick reversals of roll and pitch, with a motor command logged every 10 ms or faster",
    ),
    "yaw": (("rotor.torque_coefficient", "rotor.inertia"), "quick changes of heading"),
    "speed and wind": (("drag.rotor[0]", "drag.flapping"), "fast level flight in several directions"),
    "fast climbs and descents": (("drag.rotor[2]",), "fast climbs and descents"),
    "drift without feedback": (
        ("centre_of_gravity[0]", "centre_of_gravity[1]", "imu.tilt[0]", "imu.tilt[1]"),
        "slow turns through every heading",
    ),
    "a battery that empties": (("command.voltage_exponent",), "most of a charge, with the voltage logged"),
}
"""What a model may be used for: the keys of the parameters on which it rests, and a log that tells them."""


def uses(fit: Identified) -> TableSection:
    """A row for each use, which is as good as the parameter of it that is known least."""
    rows = []
    for name, (keys, log) in USES.items():
        known = {key: grade(fit.fitted.get(key)) for key in keys}
        worst = min(known.values(), key=FROM_WORST.index)
        weak = listed([in_words(key) for key, how in known.items() if how == worst])
        rows.append((name, worst, weak * (worst != WELL), log * (worst not in (ROUGHLY, WELL))))
    text = (
        "Each use rests on several parameters, and the model is as good for it as the least known of them. Another log, of "
        "the manoeuvres in the last column, would tell more."
    )
    header = ("the model's", "is known", "least known", "what to fly")
    return TableSection(
        "What the model can be trusted for", "uses", header, rows, text, shown="What the model is good for", columns=(0, 1, 2)
    )


def cards(fit: Identified, compared: ErrorTable | None, period: float) -> list[Fact]:
    """How far it is off on held-out flights; without any, for how much its parameters are known."""
    if compared:
        return facts(compared, period)
    good = [str(name) for name, how, *_ in uses(fit).rows if how in (ROUGHLY, WELL)]
    return [Fact("uses known to within 50 %", f"{len(good)} of {len(USES)}", listed(good)), Fact("held-out flights", "none")]


def tuning(
    fit: Identified, compared: ErrorTable | None, flown: Sequence[FlightComparison],
    thrust: tuple[float, float] | None, idle: Sequence[str] = (),
) -> str:  # fmt: skip
    """Whether to tune a controller for roll and pitch on it. compared: predictions of held-out flights from commands; idle:
    which of the two no held-out flight turns about.
    """
    fitted = fit.fitted
    late = sum(fitted[key].value for key in LATE) if set(LATE) <= fitted.keys() else 0.0
    known = {key: grade(fitted.get(key), late * (key in LATE)) for key in ("command.speed", *USES[TUNED][0])}
    weak = [in_words(key) for key, how in known.items() if how in (UNKNOWN, BARELY)]
    lost = sum(bool(one.lost) for one in flown)
    against = [f"{listed(weak)} {be(weak)} not known to within 50 %"] * bool(weak)
    worse = [one for one in ("attitude", "rates") if compared and to_better_guess(compared, one).value >= 1.0]
    against += [f"on held-out flights it predicts {listed(worse)} no better than a baseline without a model"] * bool(worse)
    against += ["its thrust is wrong by more than 5 %"] * is_wrong(thrust)
    against += ["no flight was held out, so nothing shows how well it predicts others"] * (compared is None)
    apart = [*[f"are lost ({lost} of {len(flown)})"] * bool(lost), *unlike(flown, *FAR)]
    under = f"imulated flights under a PID {listed(apart)}: the real controller is not this PID, or the model is wrong."
    untested = f"{listed(idle)} {'was' if len(idle) == 1 else 'were'} hardly flown in the held-out flights, and so not tested"
    if against:
        against += [untested] * bool(idle)
        return f"Do not tune a controller on this model yet: {'; '.join(against)}." + f" S{under}" * bool(apart)
    if idle:
        return f"Test the model further before you tune roll and pitch on it: {untested}." + f" S{under}" * bool(apart)
    if apart:
        return f"Test the model further before you tune roll and pitch on it: s{under}"
    return "Nothing found here speaks against tuning roll and pitch on this model; that is no proof that the gains will fly."
