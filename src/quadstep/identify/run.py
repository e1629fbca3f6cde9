"""`quadstep identify`: fit, test on held-out flights, then fit all flights; and what was found, for its readers."""

import re
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from quadstep.identify.fit import Identified, Say, identify
from quadstep.identify.flown_setpoints import hover_ratio, is_wrong, span_of_thrust
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.parameters import GROWS
from quadstep.identify.replay import ErrorTable, compare, ready
from quadstep.identify.replay_report import METHOD, error_table, facts, of_wrong_thrust, off_by, predicting
from quadstep.identify.residual import Followed, trained
from quadstep.identify.vehicle_file import fraction, identified_vehicle, in_proportion, with_marks
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.airframe_tables import ResidualSection
from quadstep.mission.fields import words
from quadstep.report import markup
from quadstep.report.evidence import Evidence, TableSection
from quadstep.report.units import counted, interval_texts, listed, number
from quadstep.vehicle.airframe_plant import Residual

IN_PROPORTION = "Known only up to the mass m, thrust coefficient k_f and yaw inertia J_z"

HELD_OUT = 4
"""One in this many flights is held out."""

MIXED = 0.2
"""Share by which the mean command in flight, times the voltage, may differ from the median of all flights."""


class Identification(NamedTuple):
    """vehicle: the result. held_out: names. tested: the fit without these; commands, guided: how it predicts them, by what it
    knows; *_residual: with the learned residual of that fit. None if there are none. thrust: of the vehicle over that needed,
    least and most, if known. residual: of the whole fit, if it was requested and did better on the held-out flights.
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

    @property
    def shares(self) -> tuple[float, ...]:
        """Mean errors with the residual over those without, on held-out flights, 10 and 50 samples ahead; empty if none."""
        pairs = ((self.commands, self.commands_residual), (self.guided, self.guided_residual))
        return tuple(
            float(np.mean(two.predicted[1:] / one.predicted[1:])) for one, two in pairs if one is not None and two is not None
        )


def in_words(key: str) -> str:
    """A parameter as a sentence has it: inertia[0] is the inertia about x."""
    return words(key.replace("[", ".").removesuffix("]"))


def answer(run: Identification, period: float) -> str:
    """The result: how it predicts flights that it has not seen, then what was found and what of it is not to be trusted."""
    fitted, left = run.found.fitted, list(run.found.kept)
    if run.commands is None:
        said = ["No flight was held out, so nothing shows how well this vehicle predicts other flights."]
    else:
        said = [f"On {counted(len(run.commands.names), 'flight')} held out of the fit, {predicting(run.commands, period)}"]
    if run.guided is not None:
        said.append(f"That is from commands alone; predictions that know the setpoints too are off by {off_by(run.guided)}.")
    but = f" (but not {listed([*map(in_words, left)])})" if left else ""
    said.append(f"{len(fitted)} of {counted(len(fitted) + len(left), 'vehicle parameter')} were identified{but}.")
    if scaled := sum(key in GROWS for key in fitted):
        only = f"{scaled} of these are" if scaled > 1 else "One of these is"
        said.append(f"{only} only as exact as the given mass, thrust coefficient or inertia about z.")
    if run.thrust and is_wrong(run.thrust):
        said.append(of_wrong_thrust(run.thrust))
    return " ".join(said)


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
    held = [i for i in range(len(flights)) if i % HELD_OUT == HELD_OUT - 2] if hold_out and len(flights) >= HELD_OUT else []
    fitted = [flight for i, flight in enumerate(flights) if i not in held]
    unseen = [flights[i] for i in held]
    found = identify(fitted, vehicle, say, still=still)
    tested = commands = guided = None
    if unseen:
        commands = compare(unseen, vehicle, found.numbers)
        if found.guided:
            guided = compare(unseen, vehicle, found.numbers._replace(observer=found.guided), guided=True)
        say("all flights")
        tested = found
        found = identify(flights, vehicle, say, found, still=still)
    found = in_proportion(vehicle, found)
    names = ", ".join(flight.name for flight in flights)
    description = f"{vehicle.description or 'A vehicle'}; identified from {names}"
    result = with_marks(identified_vehicle(vehicle, found, description[:900], mass_source), flights)
    thrust = span_of_thrust(flights, result)
    done = Identification(result, found, [flight.name for flight in unseen], tested, commands, guided, thrust)
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


def evidence(run: Identification, flights: Sequence[FlightRecord], start: AirframeSection, mass: str) -> Evidence:
    """What was found. start: the vehicle that it began with; mass: where its mass is from."""
    names, period = ", ".join(run.held_out), flights[0].period
    reasons: dict[str, list[str]] = {}
    for key, reason in run.found.kept.items():
        reasons.setdefault(reason, []).append(in_words(key))
    kept = [f"As in the given vehicle: {listed(keys)} ({reason})." for reason, keys in reasons.items()]
    said = [answer(run, period), *kept, f"Mass: {start.mass:g} kg ({mass}).", *of_residual(run)]
    tables = [
        error_table(f"Held out of the first fit: {names}, predicted from {knows}", found, period)
        for knows, found in (
            ("commands alone", run.commands),
            ("commands and setpoints", run.guided),
            ("commands alone, with the learned residual", run.commands_residual),
            ("commands and setpoints, with the learned residual", run.guided_residual),
        )
        if found
    ]
    return Evidence(
        name=f"{re.split('[;,]', start.description)[0] or 'Vehicle'}, identified from {counted(len(flights), 'flight')}",
        kind="Identification",
        answer=said[0],
        sentences=said,
        record={},
        facts=facts(run.commands, period) if run.commands else (),
        sections=[
            markup.heading("Identified parameters", "found"),
            *fitted(run.found, start, run.vehicle.inertia[2]),
            *([markup.heading("Prediction of held-out flights", "held-out"), markup.paragraph(METHOD)] if tables else []),
            *tables,
        ],
        more=said[1:],
    )


def of_residual(run: Identification) -> list[str]:
    """What held-out flights say of the residual, if it was trained."""
    if not run.shares:
        return []
    much = " and ".join(f"{share:.3f}" for share in run.shares)
    if run.residual is not None:
        return [f"With the residual errors are {much} times as large; the vehicle has it, switched off (effects.residual)."]
    return [f"With the residual errors are {much} times as large on flights held out, so it is left out of the vehicle."]


def fitted(fit: Identified, given: AirframeSection, upright: float) -> list[TableSection]:
    """What flights determine by themselves, and what only over what they do not. upright: inertia about z [kg m^2]."""
    rows: tuple[list[tuple[str, ...]], list[tuple[str, ...]]] = [], []
    for key, one in fit.fitted.items():
        value, low, high, _ = interval_texts(*one[:3], "-")
        known = (GROWS[key], fraction(one)) if key in GROWS else (f"{low} to {high}",)
        rows[key in GROWS].append((f"{in_words(key)}, `{key}`", value, one.unit, *known))
    mass, thrust, about_z = map(number, (given.mass, given.rotor.thrust_coefficient, upright))
    whole = "These intervals hold whatever the vehicle weighs; they take its rotors to be where the given vehicle has them."
    over = (
        "No flight reveals the mass m, the rotors' thrust coefficient k_f or the inertia about z, J_z. The next table is for "
        f"m = {mass} kg and k_f = {thrust} N s^2, as given, and J_z = {about_z} kg m^2, in proportion to the inertias about x "
        "and y. If one is wrong, so are the values, in proportion (nearly, where it is J_z); the fit's own error adds to that."
    )
    before = ("parameter, key", "value", "unit")
    found = (
        TableSection("", "", (*before, "95 % interval"), rows[0], whole, shown="Identified"),
        TableSection("", "", (*before, "proportional to", "fit alone, 95 %"), rows[1], over, shown=IN_PROPORTION),
    )
    return [one for one in found if one.rows]


def rms(values: Floats) -> Floats:
    """By column."""
    return np.asarray(np.sqrt((values**2).mean(axis=0)))


def worse_than_none(found: Sequence[Followed]) -> str:
    """A sentence on the axes about which more angular acceleration stays unexplained than was measured, if any."""
    flights = np.array([rms(one.torque) > rms(one.turning) for one in found]).reshape(-1, 3).sum(axis=0)
    axes = [
        f"about {axis} in {many} of {counted(len(found), 'flight')}" for axis, many in zip("xyz", flights, strict=True) if many
    ]
    return f"More angular acceleration is unexplained than was measured (RMS) {listed(axes)}." if axes else ""


def unexplained(
    found: Sequence[Followed], flights: Sequence[FlightRecord], vehicle: AirframeSection, kind: str
) -> TableSection:
    """A row for each flight: unexplained angular acceleration and force beside the measured ones, and the thrust."""
    thrust = {flight.name: hover_ratio(flight, vehicle) for flight in flights}
    rows = []
    for one in found:
        numbers = [rms(values) for values in (one.turning, one.torque, one.force)]
        measured, torque, force = (" / ".join(f"{value:.2g}" for value in values) for values in numbers)
        mean = " / ".join(f"{value:+.2g}" for value in one.force.mean(axis=0))
        rows.append((one.name, measured, torque, force, mean, f"{thrust[one.name]:.3f}"))
    header = (
        "flight, x / y / z", "angular acceleration [rad/s²]", "unexplained part", "unexplained acceleration [m/s²]",
        "its mean", "thrust / needed",
    )  # fmt: skip
    text = (
        "While the model follows a flight, measurements correct it; what they add to its own torque and thrust is "
        f"unexplained. RMS and mean values over the flights that were {kind}."
    )
    return TableSection("What the model cannot explain", "left", header, rows, text, escape)
