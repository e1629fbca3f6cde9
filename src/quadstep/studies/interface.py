"""The Python interface: fly missions, or plans made from them, and query the flights."""

import base64
import io
from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from quadstep.engines import fly as engines
from quadstep.engines.engine import FLIGHTS, Engine, engine_for
from quadstep.engines.fly import FlightPlan, fingerprint
from quadstep.interfaces.closed_loop import Advance, Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.doors import needed_by
from quadstep.io.errors import UserError, shorten, unknown_name
from quadstep.metrics.registry import Metrics, flight_metrics, metric
from quadstep.mission.schema import Mission
from quadstep.report.drawing import FigureJob
from quadstep.report.markup import paragraph, table
from quadstep.report.panels import flight_jobs
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import publishing
from quadstep.report.units import quantity, rich
from quadstep.studies.fly import ending_state, summarise, write_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

Flyable: TypeAlias = Mission | FlightPlan
"""What `fly` accepts."""

DPI = 75
"""Resolution of the figure in a notebook."""


class NamedMetrics(dict[str, object]):
    """Metrics that say which there are where another is asked for."""

    def __missing__(self, name: str) -> object:
        raise KeyError(unknown_name("metric", name, self))


class Flight(FlightLog):
    """A finished flight: a `FlightLog`, with the mission, plan and engine that produced it.

    columns: name and unit of each column of the log; angles in rad, positions in the world's frame, z up. rows: of shape
    (samples, len(columns)), finite. outcome: an `Outcome`; ended: its time [s]. final: state, memory of the controller
    with its weights, and command at that time. mission: None if a plan was flown. plan: laws and numbers. engine: the
    engine that flew it.

    >>> from quadstep import Mission, fly
    >>> line = {"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 2.0}
    >>> flight = fly(Mission(name="Line", path=line))
    >>> flight
    <Flight 'Line': completed 2 s, position RMSE 4.77 mm, 201 rows>
    >>> flight.outcome.name, flight.columns["theta"], flight.table("x", "y", "z").shape
    ('COMPLETED', 'rad', (201, 3))
    """

    mission: Mission | None = None
    plan: FlightPlan
    engine: Engine

    @property
    def name(self) -> str:
        return self.mission.name if self.mission else "Flight"

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the mission or the flight (a rotor at its limit, say), one line each."""
        found = self.mission.flight_metrics(self)[1] if self.mission else []
        return (*self.plan.warnings, *found)

    def metrics(self) -> Metrics:
        """The numbers of `metrics.json`, with units in the keys, as `flight_metrics` describes them.

        Of others, as of `metrics()["rmse"]`, its KeyError says which there are.

        >>> flight = fly(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0}))
        >>> flight.metrics()["outcome"], round(flight.metrics()["position"]["z"]["largest[m]"], 3)
        ('completed', 1.0)
        """
        if self.mission:
            return NamedMetrics(self.mission.flight_metrics(self)[0])
        return NamedMetrics(flight_metrics(self, efforts=self.plan.loop.plant.efforts))

    def to_pandas(self) -> "DataFrame":
        """The log as a DataFrame, indexed by t [s]; the units are in its `attrs["units"]`. Raises UserError without pandas.

        >>> flight = fly(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0}))
        >>> flight.to_pandas().loc[1.0:, "z"].max()  # doctest: +SKIP
        1.0042
        """
        with needed_by("Flight.to_pandas()"):
            from pandas import DataFrame  # noqa: PLC0415 (optional)

        frame = DataFrame(self.rows.copy(), columns=list(self.columns)).set_index("t")
        frame.attrs["units"] = dict(self.columns)
        return frame

    def figures(self) -> list[str]:
        """The names of its figures; empty if it ended before its second row."""
        return [job.name for job in self._jobs()]

    def plot(self, figure: str = "position") -> "Figure":
        """One of the figures that `quadstep fly` draws, as a Matplotlib figure without a window.

        pyplot is not used. Raises UserError, with the available figures, for another name.

        >>> flight = fly(Mission(path={"type": "step", "end": [0.0, 0.0, 1.0], "duration": 2.0}))
        >>> flight.figures()
        ['path', 'position', 'attitude', 'inputs', 'learning']
        >>> flight.plot("attitude").savefig("attitude.pdf")  # doctest: +SKIP
        """
        jobs = {job.name: job for job in self._jobs()}
        if figure not in jobs:
            none = "" if jobs else ": the flight ended before its second row"
            raise UserError(unknown_name("figure", figure, jobs) + none)
        return jobs[figure].picture()

    def save(self, folder: Path | str, overwrite: bool = False) -> None:
        """Write what `quadstep fly` writes: flight.csv, metrics.json, figures/, page.html, report.html, weights.json.

        Raises UserError if the folder contains other results, unless `overwrite`, and for the flight of a plan,
        whose mission is not known.
        """
        if self.mission is None:
            raise UserError("only the flight of a mission can be saved, not the flight of a plan")
        with publishing(Path(folder), fingerprint([self.plan]), overwrite) as out, drawing_pool() as pool:
            ending = ending_state(self.plan, self)
            write_results(out, pool, self.mission, self.plan, self, self.engine, self.mission.folder, ending)

    def __repr__(self) -> str:
        metrics = self.metrics()
        rmse = f", position RMSE {quantity(metric(metrics, 'position_rmse[m]'), 'm')}" if "position_rmse[m]" in metrics else ""
        how = "completed" if self.outcome is Outcome.COMPLETED else f"lost ({self.outcome.name.lower()}) at"
        return f"<Flight {self.name!r}: {how} {self.ended:g} s{rmse}, {len(self.rows)} rows>".replace("\u00a0", " ")

    def _repr_html_(self) -> str:
        """The view in a notebook: a table of results and the position over time."""
        said = summarise(self.name, self, self.metrics(), self.warnings, [], self.mission)
        parts = [f"<strong>{escape(said.name)}</strong>", paragraph(said.ending)]
        parts += [paragraph(f"Warning: {warning}") for warning in said.warnings]
        if said.rows:
            parts.append(table(("", *said.header), said.rows, rich))
            parts.append(table(("limits", "value"), said.facts, rich))
        if self.figures():
            picture = io.BytesIO()
            self.plot().savefig(picture, format="png", dpi=DPI)
            text = base64.b64encode(picture.getvalue()).decode()
            parts.append(f'<img alt="position over time" src="data:image/png;base64,{text}">')
        return f"<div>{''.join(parts)}</div>"

    def _jobs(self) -> list[FigureJob]:
        if len(self.rows) < 2:
            return []
        return self.mission.figures(self) if self.mission else flight_jobs(self, self.name, self.plan.loop.plant.efforts)


def fly(mission: Flyable, engine: Engine | str = Engine.LANES, progress: Advance | None = None) -> Flight:
    """Fly a mission, or a plan made from one.

    engine: "lanes", compiled, or "python", the same laws without a compiler, a thousand times slower; the flights are the same
    to the bit. progress: called with the number of steps since the last call. A flight that diverges is an outcome,
    not an error. Raises UserError for a mission that cannot be flown.

    >>> from quadstep import Mission, fly
    >>> orbit = {"type": "circle", "centre": [0.0, 0.0, 3.0], "radius": 1.0, "period": 6.0, "turns": 1.0}
    >>> flight = fly(Mission(name="Orbit", vehicle={"preset": "crazyflie"}, path=orbit, controller={"type": "geometric"}))
    >>> flight.outcome.name, flight.metrics()["largest_error[m]"] < 0.13
    ('COMPLETED', True)
    """
    return fly_all([mission], engine, progress)[0]


def fly_all(missions: Iterable[Flyable], engine: Engine | str = Engine.LANES, progress: Advance | None = None) -> list[Flight]:
    """Fly many missions or plans; returns the flights in order. Flights of equal structure and clock are flown together.

    engine, progress, errors: as for `fly`.

    >>> from quadstep import Mission, fly_all
    >>> line = {"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 2.0}
    >>> flights = fly_all(Mission(path=line, disturbance={"scale": scale}) for scale in (0.0, 1.0, 2.0))
    >>> [flight.outcome.name for flight in flights]
    ['COMPLETED', 'COMPLETED', 'COMPLETED']
    """
    given, flown_by = list(missions), engine_for(FLIGHTS, engine)
    plans = [planned(one) for one in given]
    flights = []
    for one, plan, log in zip(given, plans, engines.fly_all(plans, flown_by, progress), strict=True):
        flight = Flight(*log)
        flight.mission, flight.plan, flight.engine = one if isinstance(one, Mission) else None, plan, flown_by
        flights.append(flight)
    return flights


def planned(mission: Flyable) -> FlightPlan:
    """The plan of a mission, or the plan itself. Raises UserError for anything else."""
    if isinstance(mission, Mission):
        return mission.plan()
    if isinstance(mission, FlightPlan):
        return mission
    raise UserError(
        f"only a Mission or its plan can be flown, not {shorten(mission)}; read_mission(path) reads one from a file"
    )
