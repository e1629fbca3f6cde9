"""The pieces of a run: independent replicates, and second opinions that do not count but must agree."""

import math
from collections.abc import Callable, Iterator
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from quadstep.interfaces.closed_loop import Advance
from quadstep.mission.distributions import Choice
from quadstep.numbers import exp, log
from quadstep.studies.campaign.flyer import SUCCESS
from quadstep.studies.campaign.schema import Campaign, CampaignFile, Method
from quadstep.studies.campaign.splits import MOST_LINES, with_option
from quadstep.studies.campaign.varied import texts_of
from quadstep.studies.rare.cross_entropy import LEAST, MOST_KEPT, NEGLIGIBLE, Level, Replicate, beyond, cross_entropy
from quadstep.studies.rare.mixture import A_REPLICATE, Evaluate, Floats, Points, Random, joined
from quadstep.studies.rare.point_flyer import Event, Failure, PointFlyer, values
from quadstep.studies.rare.run_folder import DoneEvent, FinishedPiece, Nearest, RepeatedFailures

SHARE = 0.1
"""Share of the flights that each event keeps."""

STEP, WANTED = 0.6, 0.44
"""The first step size of the chains, a standard deviation, and the target acceptance rate."""

NEW_NOISE = 0.5
"""Share of the candidates that get new noise; the others keep their predecessor's."""


def subset_simulation(evaluate: Evaluate, events: int, random: Random, size: int) -> list[Replicate]:
    """One replicate of each kind of failure, with `size` flights in each level (Au and Beck 2001): a rare event as the last of
    nested events, each frequent given the one before.

    An event is that a flight fails or its score exceeds a threshold, so failure is part of every event whatever the score
    is. Flights given an event are drawn by Markov chains that start from those already in it, by conditional sampling
    whose step size adapts to the acceptance rate (Papaioannou, Betz, Zwirglmaier and Straub 2015).
    """
    found = list[Replicate]()
    for event in range(events):

        def scored(points: Points, event: int = event) -> Floats:
            return np.asarray(evaluate(points)[event])

        least = max(LEAST, NEGLIGIBLE * sum(one.probability for one in found))
        found.append(followed(scored, random.after(event), size, least))
    return found


def followed(evaluate: Callable[[Points], Floats], random: Random, size: int, least: float) -> Replicate:
    """A replicate of one kind of failure. evaluate: its row. least: the probability below which it gives up."""
    points = random.points(size)
    scores = evaluate(points)
    crude = points.at(np.isinf(scores))
    probability, step, levels = 1.0, STEP, list[Level]()
    while probability > least:
        share = float(np.isinf(scores).mean())
        if share >= SHARE:
            failures = points.at(np.isinf(scores))
            reached, each = (*levels, Level(None, probability * share)), probability / len(scores)
            return Replicate(probability * share, size, crude, reached, failures, np.full(len(failures.noise), each))
        threshold = beyond(scores, SHARE)
        above = scores >= threshold
        if above.mean() > MOST_KEPT:
            break
        probability *= float(above.mean())
        levels.append(Level(threshold, probability))
        points, scores, step = chains(evaluate, random, points.at(above), scores[above], threshold, size, step)
    failures = points.at(np.isinf(scores))
    return Replicate(0.0, size, crude, tuple(levels), failures, np.zeros(len(failures.noise)))


def chains(
    evaluate: Callable[[Points], Floats], random: Random, points: Points, scores: Floats, threshold: float,
    size: int, step: float,
) -> tuple[Points, Floats, float]:  # fmt: skip
    """About `size` flights whose score is at least the threshold, including those given; their scores, and the step."""
    all_points, all_scores = [points], [scores]
    count, turns = len(scores), -(-size // len(scores)) - 1
    drawn = random.points(turns * count)
    renewed = random.uniform(drawn) < NEW_NOISE
    for turn in range(1, turns + 1):
        own = np.arange((turn - 1) * count, turn * count)
        fresh = drawn.at(own)
        latent = math.sqrt(1.0 - step * step) * points.latent + step * fresh.latent
        noise = np.where(renewed[own], fresh.noise, points.noise)
        found = evaluate(Points(latent, noise))
        accepted = found >= threshold
        points = Points(np.where(accepted[:, None], latent, points.latent), np.where(accepted, noise, points.noise))
        scores = np.where(accepted, found, scores)
        step = min(1.0, exp(log(step) + (float(accepted.mean()) - WANTED) / math.sqrt(turn)))
        all_points.append(points)
        all_scores.append(scores)
    return joined(all_points), np.concatenate(all_scores), step


METHODS = {Method.SUBSET: subset_simulation, Method.CROSS_ENTROPY: cross_entropy}

EVENTS = 2
"""Most failures kept of a piece."""

AGAIN = 50
"""Number of failures that are flown again with different noise."""


class PieceKind(StrEnum):
    """Why a piece is flown."""

    REPLICATE = "replicate"
    METHOD = "other method"
    SCORE = "other method and score"


class Piece(NamedTuple):
    """One piece of a run, with the index that determines its random numbers."""

    kind: PieceKind
    place: int


def pieces(campaign: Campaign) -> Iterator[Piece]:
    """All pieces of a campaign, in order; the two kinds of second opinion alternate."""
    rare = campaign.file.rare
    kinds = [PieceKind.REPLICATE] * rare.replicates + ([PieceKind.METHOD, PieceKind.SCORE] * rare.opinions)[: rare.opinions]
    yield from (Piece(kind, place) for place, kind in enumerate(kinds))


def fly_piece(flights: PointFlyer, piece: Piece, progress: Advance) -> FinishedPiece:
    """A piece's results. progress: called with further flights. Raises UserError for values that cannot be flown."""
    file = flights.campaign.file
    name = file.rare.method if piece.kind is PieceKind.REPLICATE else file.rare.method.other
    events, flown = flights.events(), 0
    if piece.kind is PieceKind.SCORE:  # any failure, predicted by the limited metrics and how much the inputs vary
        limits = flights.scales(tuple(file.failure) or ("largest_error",))
        events = [Event(Failure.ANY, {**limits, **flights.activity})]

    def counted(more: int) -> None:
        nonlocal flown
        flown += more
        progress(more)

    random = Random(file.seed, EVENTS * piece.place, len(file.keys))
    found: list[Replicate] = METHODS[name](flights.evaluate(events, counted), len(events), random, file.rare.flights)
    failures = joined([one.failures for one in found])
    flown_again = failing_again(flights, failures, counted) if flights.noisy and len(failures.noise) else None
    return FinishedPiece(
        kind=piece.kind.value,
        method=name,
        probability=sum(one.probability for one in found),
        flights=flown,
        events=[recorded(flights, event, one) for event, one in zip(events, found, strict=True)],
        again=flown_again,
    )


def recorded(flights: PointFlyer, event: Event, one: Replicate) -> DoneEvent:
    return DoneEvent(
        failure=event.failure.value,
        score=list(event.scales),
        probability=one.probability,
        crude=one.crude,
        crude_failures=len(one.crude_failures.noise),
        options=by_choice(flights.campaign.file, one),
        failures=len(one.failures.noise),
        levels=[(level.threshold, level.probability) for level in one.levels],
        nearest=nearest(flights, one.failures, event.failure.value) if len(one.failures.noise) else None,
    )


def by_choice(file: CampaignFile, one: Replicate) -> dict[str, tuple[float, int, float]]:
    """What it found with each value of the choices that are not between numbers, as `DoneEvent` has it."""
    drawn, crude = (values(file, some.latent) for some in (one.failures, one.crude_failures))
    choices = {key: one for key, one in file.vary.items() if isinstance(one, Choice) and 1 < len(one.values) <= MOST_LINES}
    found = dict[str, tuple[float, int, float]]()
    for key, choice in choices.items():
        shares = np.array(choice.weights or [1.0] * len(choice.values))
        for place in np.flatnonzero(shares) if isinstance(choice.values[0], bool | str | dict) else ():
            with_it, crude_with = (some[key].values == place for some in (drawn, crude))
            found[with_option(key, texts_of(choice.values)[place])] = (
                float(one.weights @ with_it), int(crude_with.sum()), float(shares[place] / shares.sum())
            )  # fmt: skip
    return found


def nearest(flights: PointFlyer, failures: Points, kind: str) -> Nearest:
    file = flights.campaign.file
    counts = [at for at, name in enumerate(file.keys) if not isinstance(file.vary.get(name), Choice)]
    distance = np.linalg.norm(failures.latent[:, counts], axis=1)
    place = int(np.argmin(distance))
    drawn = values(file, failures.latent[place : place + 1])
    return Nearest(
        failure=kind,
        deviations=float(distance[place]),
        values={name: column.at(0) for name, column in drawn.items()},
        deviations_by_key={file.keys[at]: float(failures.latent[place, at]) for at in counts},
    )


def failing_again(flights: PointFlyer, failures: Points, progress: Advance) -> RepeatedFailures:
    """How many of some failures fail again with different noise."""
    count = len(failures.noise)
    some = failures.at(np.unique(np.linspace(0, count - 1, min(count, AGAIN)).astype(np.int64)))
    failed = ~flights.fly(some._replace(noise=some.noise + A_REPLICATE // 2))[SUCCESS].to_numpy()
    progress(len(failed))
    return RepeatedFailures(flights=len(failed), failures=int(failed.sum()))
