"""The pieces of a run: independent replicates, and second opinions that do not count but must agree."""

from collections.abc import Iterator
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from quadstep.interfaces.closed_loop import Advance
from quadstep.studies.campaign.flown import SUCCESS
from quadstep.studies.campaign.schema import Campaign, Method
from quadstep.studies.rare.cross_entropy import Replicate, cross_entropy
from quadstep.studies.rare.flights import Event, Failure, Flights, values
from quadstep.studies.rare.kept import Again, Done, DoneEvent, Nearest
from quadstep.studies.rare.mixture import A_REPLICATE, Points, Random, joined
from quadstep.studies.rare.subset import subset_simulation

METHODS = {Method.SUBSET: subset_simulation, Method.CROSS_ENTROPY: cross_entropy}

EVENTS = 2
"""Most failures kept of a piece."""

AGAIN = 50
"""Number of failures that are flown again with different noise."""


class Kind(StrEnum):
    """Why a piece is flown."""

    REPLICATE = "replicate"
    METHOD = "other method"
    SCORE = "other method and score"


class Piece(NamedTuple):
    """One piece of a run, with the index that determines its random numbers."""

    kind: Kind
    place: int


def pieces(campaign: Campaign) -> Iterator[Piece]:
    """All pieces of a campaign, in order; the two kinds of second opinion alternate."""
    rare = campaign.file.rare
    kinds = [Kind.REPLICATE] * rare.replicates + ([Kind.METHOD, Kind.SCORE] * rare.opinions)[: rare.opinions]
    yield from (Piece(kind, place) for place, kind in enumerate(kinds))


def fly_piece(flights: Flights, piece: Piece, progress: Advance) -> Done:
    """A piece's results. progress: called with further flights. Raises UserError for values that cannot be flown."""
    file = flights.campaign.file
    name = file.rare.method if piece.kind is Kind.REPLICATE else file.rare.method.other
    events = other_events(flights) if piece.kind is Kind.SCORE else flights.events()
    flown = 0

    def counted(more: int) -> None:
        nonlocal flown
        flown += more
        progress(more)

    random = Random(file.seed, EVENTS * piece.place, len(file.keys))
    found: list[Replicate] = METHODS[name](flights.evaluate(events, counted), len(events), random, file.rare.flights)
    failures = joined([one.failures for one in found])
    flown_again = again(flights, failures, counted) if flights.noisy and len(failures.noise) else None
    return Done(
        kind=piece.kind.value,
        method=name,
        probability=sum(one.probability for one in found),
        flights=flown,
        events=[recorded(event, one) for event, one in zip(events, found, strict=True)],
        nearest=nearest(flights, failures) if len(failures.noise) else None,
        again=flown_again,
    )


def other_events(flights: Flights) -> list[Event]:
    """Any failure, predicted by every candidate: the limited metrics and how much the inputs vary."""
    limits = flights.scales(tuple(flights.campaign.file.failure) or ("largest_error",))
    return [Event(Failure.ANY, {**limits, **flights.activity})]


def recorded(event: Event, one: Replicate) -> DoneEvent:
    return DoneEvent(
        failure=event.failure.value,
        score=list(event.scales),
        probability=one.probability,
        crude=one.crude,
        crude_failures=one.crude_failures,
        failures=len(one.failures.noise),
        levels=[(level.threshold, level.probability) for level in one.levels],
    )


def nearest(flights: Flights, failures: Points) -> Nearest:
    """The most likely of some failures."""
    distance = np.linalg.norm(failures.latent, axis=1)
    place = int(np.argmin(distance))
    drawn = values(flights.campaign.file, failures.latent[place : place + 1])
    return Nearest(
        deviations=float(distance[place]),
        values={name: column.at(0) for name, column in drawn.items()},
        deviations_by_key=dict(zip(drawn, failures.latent[place].tolist(), strict=True)),
    )


def again(flights: Flights, failures: Points, progress: Advance) -> Again:
    """How many of some failures fail again with different noise."""
    count = len(failures.noise)
    some = failures.at(np.unique(np.linspace(0, count - 1, min(count, AGAIN)).astype(np.int64)))
    failed = ~flights.fly(some._replace(noise=some.noise + A_REPLICATE // 2))[SUCCESS].to_numpy()
    progress(len(failed))
    return Again(flights=len(failed), failures=int(failed.sum()))
