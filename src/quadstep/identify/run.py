"""`quadstep identify`: fit, test on held-out flights, then fit all flights; and what was found, for its readers."""

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from quadstep.identify.fit import Identified, Say, identify
from quadstep.identify.flown_setpoints import of_wrong_thrust, span_of_thrust
from quadstep.identify.known import fitted, in_words
from quadstep.identify.logs.flight import Flags, FlightRecord
from quadstep.identify.logs.judge import barely_turned, spreads
from quadstep.identify.replay import ErrorTable, compare, ready
from quadstep.identify.replay_report import METHOD, called, error_table
from quadstep.identify.residual import Followed, followed, trained
from quadstep.identify.uses import TUNED, cards, tuning, uses
from quadstep.identify.vehicle_file import as_written, identified_vehicle, with_marks
from quadstep.io.errors import UserError
from quadstep.io.grouping import by_first
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.airframe_tables import ResidualSection
from quadstep.report import markup
from quadstep.report.evidence import Evidence, Section, TableSection
from quadstep.report.units import counted, listed
from quadstep.vehicle.airframe_plant import Residual

HELD_OUT = 4
"""One in this many flights is held out."""

MIXED = 0.2
"""Share by which the mean command in flight, times the voltage, may differ from the median of all flights."""


class Identification(NamedTuple):
    """vehicle: the result. held_out: names. tested: the fit without these; commands, guided: how it predicts them, by what it
    knows; *_residual: with the learned residual of that fit. None if there are none. thrust: of the vehicle over that needed,
    least and most, if known. residual: of the whole fit, if it was requested and did better on the held-out flights. idle: of
    roll and pitch, what no held-out flight turns about; alike: whether these all have the same setpoints.
    """

    vehicle: AirframeSection
    found: Identified
    held_out: list[str]
    tested: Identified | None
    commands: ErrorTable | None
    guided: ErrorTable | None
    thrust: tuple[float, float] | None = None
    residual: Residual | None = None
    commands_residual: ErrorTable | None = None
    guided_residual: ErrorTable | None = None
    idle: Sequence[str] = ()
    alike: bool = False

    def shown(self, flights: Sequence[FlightRecord]) -> list[FlightRecord]:
        """The flights on which it is judged: those held out or, if none were, all."""
        return [flight for flight in flights if flight.name in self.held_out] or list(flights)

    @property
    def kind(self) -> str:
        """Of these flights."""
        return "held out of the first fit" if self.held_out else "fitted"

    @property
    def shares(self) -> tuple[float, ...]:
        """Mean errors with the residual over those without, on held-out flights, 10 and 50 samples ahead; empty if none."""
        pairs = ((self.commands, self.commands_residual), (self.guided, self.guided_residual))
        return tuple(
            float(np.mean(two.predicted[1:] / one.predicted[1:])) for one, two in pairs if one is not None and two is not None
        )


def answer(run: Identification) -> str:
    """The result: whether to tune on it, what to fly if not, and a thrust that is wrong."""
    return " ".join([tuning(run.found, run.commands, run.thrust, run.idle), *of_wrong_thrust(run.thrust)])


def for_test(flights: Sequence[FlightRecord]) -> list[FlightRecord]:
    """One flight in four, from the second of those that turn most about roll and pitch on: the first, which tells most, is
    fitted. And the second about an axis about which none of these turns, if it does.
    """

    def turning(*axes: str) -> list[FlightRecord]:
        return sorted(flights, key=lambda one: -min(spreads(one, certain(one)).get(axis, 0.0) for axis in axes))

    unseen = turning(*TUNED)[1::HELD_OUT]
    for axis in TUNED:
        second = turning(axis)[1]
        if axis in untested(unseen) and axis not in untested([second]):
            unseen.append(second)
    return unseen


def certain(flight: FlightRecord) -> Flags:
    """Where it flies and was measured."""
    return flight.flying & (flight.runs() > 0)


def untested(unseen: Sequence[FlightRecord]) -> list[str]:
    """Of roll and pitch, what none of these flights turns about."""
    calm = [barely_turned(one, certain(one)) for one in unseen]
    return [axis for axis in TUNED if calm and all(axis in one for one in calm)]


def same_setpoints(flights: Sequence[FlightRecord]) -> bool:
    """Whether several flights were to follow the same path, as far as they all last, to a centimetre."""
    if len(flights) < 2 or not all("setpoint" in one.channels for one in flights):
        return False
    rows = min(one.rows for one in flights)
    first, *others = (one.channel("setpoint")[:rows] for one in flights)
    return all(np.allclose(first, other, rtol=0.0, atol=0.01, equal_nan=True) for other in others)


def run(
    flights: Sequence[FlightRecord], vehicle: AirframeSection, mass_source: str, hold_out: bool, say: Say,
    learn: bool = False, still: bool = False,
) -> Identification:  # fmt: skip
    """Identify a vehicle. learn: whether to train a network on what the laws do not explain. still: as in `identify`. Raises
    UserError.
    """
    vehicle = vehicle.model_copy(update={"residual": None})
    ready(flights, vehicle)
    check_alike(flights)
    names = ", ".join(flight.name for flight in flights)
    flights = sorted(flights, key=lambda one: one.motors.tobytes())  # so that their order changes nothing
    unseen = for_test(flights) if hold_out and len(flights) >= HELD_OUT else []
    fitted = [flight for flight in flights if flight.name not in [one.name for one in unseen]]
    found = identify(fitted, vehicle, say, still=still)
    tested = commands = guided = None
    if unseen:
        commands = compare(unseen, vehicle, found.numbers)
        if found.guided:
            guided = compare(unseen, vehicle, found.numbers._replace(observer=found.guided), guided=True)
        say("all flights")
        tested = found
        found = identify(flights, vehicle, say, found, still=still)
    found = as_written(vehicle, found)
    description = f"{vehicle.description or 'A vehicle'}; identified from {names}"
    result = with_marks(identified_vehicle(vehicle, found, description[:900], mass_source), flights)
    thrust = span_of_thrust(flights, result)
    done = Identification(result, found, [flight.name for flight in unseen], tested, commands, guided, thrust)
    done = done._replace(idle=untested(unseen), alike=same_setpoints(unseen))
    if not learn:
        return done
    if tested is None:
        raise UserError("--residual: held-out flights decide whether it helps; give four flights or more, and --hold-out")
    say("residual")
    return with_residual(done, flights, fitted, unseen, vehicle)


def with_residual(
    done: Identification, flights: Sequence[FlightRecord], fitted: Sequence[FlightRecord], unseen: Sequence[FlightRecord],
    vehicle: AirframeSection,
) -> Identification:  # fmt: skip
    """The run with a network trained on the fit's residual, if held-out flights support it; the plain vehicle is unchanged."""
    assert done.tested
    numbers = done.tested.numbers
    p = numbers._replace(airframe=numbers.airframe._replace(residual=trained(fitted, vehicle, numbers).net))
    commands = compare(unseen, vehicle, p)
    guided = compare(unseen, vehicle, p._replace(observer=done.tested.guided), guided=True) if done.tested.guided else None
    done = done._replace(commands_residual=commands, guided_residual=guided)
    if np.mean(done.shares) >= 1.0:
        return done
    net = trained(flights, vehicle, done.found.numbers).net
    section = ResidualSection.model_validate(
        {
            "inputs": [list(row) for row in net.inputs],
            "biases": list(net.biases),
            "outputs": [list(row) for row in net.outputs],
            "offsets": list(net.offsets),
        }
    )
    return done._replace(residual=net, vehicle=done.vehicle.model_copy(update={"residual": section}))


def check_alike(flights: Sequence[FlightRecord]) -> None:
    """Refuses flights that cannot be of the same vehicle. Raises UserError."""
    if len({flight.speeds for flight in flights}) > 1:
        raise UserError("some logs contain motor commands, others rotor speeds; fit them separately")
    levels = []
    for flight in flights:
        if not flight.flying.any():
            raise UserError(f"{flight.name}: never flew: the rotors never turned in the air; nothing can be fitted")
        volts = flight.channel("voltage")[:, 0] if "voltage" in flight.channels else np.ones(flight.rows)
        levels.append(float(np.nanmedian((flight.motors.mean(axis=1) * volts)[flight.flying])))
    middle = float(np.median(levels))
    for flight, level in zip(flights, levels, strict=True):
        if abs(level / middle - 1.0) > MIXED:
            raise UserError(
                f"{flight.name}: needs {level / middle:.2f} times the median command to fly; are these logs from one vehicle?"
            )


def followers(run: Identification, flights: Sequence[FlightRecord], start: AirframeSection) -> list[Followed]:
    """The flights on which the vehicle is judged, followed by it."""
    return [one for flight in run.shown(flights) if (one := followed(flight, start, (run.tested or run.found).numbers))]


def evidence(
    run: Identification, flights: Sequence[FlightRecord], start: AirframeSection, found: Sequence[Followed] = (),
    notes: Sequence[str] = (),
) -> Evidence:  # fmt: skip
    """What was found. start: the vehicle that it began with; found: `followers`; notes: on its logs."""
    period = flights[0].period
    reasons = by_first((reason, in_words(key)) for key, reason in run.found.kept.items())
    kept = [f"Kept from the starting vehicle: {listed(keys)} ({reason})." for reason, keys in reasons.items()]
    several = {"": (run.commands, run.guided), ", with the learned residual": (run.commands_residual, run.guided_residual)}
    tables = [
        error_table(f"Held-out flights predicted from {one.knows}{more}", one, period)
        for more, both in several.items()
        for one in filter(None, both)
    ]
    names = ", ".join(flight.name for flight in flights)
    held = f"Held out: {', '.join(run.held_out)}{', all with the same setpoints' * run.alike}. The vehicle file is from a "
    held += f"second fit, to all flights ({names}), which leaves none to test it."
    more = [*kept, *of_residual(run)]
    said = "".join(markup.paragraph(one, escape) for one in notes)
    noted = [markup.disclosure("what the logs show, and lack", said)] * bool(said)
    sections: list[Section] = [uses(run.found), *noted, markup.heading("Identified parameters", "found")]
    sections += [markup.paragraph(" ".join(more), escape)] * bool(more)
    sections += fitted(run.found, start, run.vehicle.inertia[2])
    if tables:
        sections.append(TableSection("Prediction of held-out flights", "held-out", text=f"{held} {METHOD}", set_as=escape))
        sections += [tables[0], *(one._replace(shown="") for one in tables[1:])]
    if found:
        sections.append(TableSection("A flight and its predictions", "left"))
    said = answer(run)
    return Evidence(
        name=f"{called(start)}, identified from {counted(len(flights), 'flight')}",
        kind="Identification",
        answer=said,
        sentences=[said, *more],
        record={},
        facts=cards(run.found, run.commands, period),
        sections=sections,
        fold=("found", "held-out", "left"),
    )


def of_residual(run: Identification) -> list[str]:
    """What held-out flights say of the residual, if it was trained."""
    if not run.shares:
        return []
    much = " and ".join(f"{share:.3f}" for share in run.shares)
    if run.residual is not None:
        return [f"With the residual errors are {much} times as large; the vehicle has it, switched off (effects.residual)."]
    return [f"With the residual errors are {much} times as large on flights held out, so it is left out of the vehicle."]
