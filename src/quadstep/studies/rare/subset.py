"""Subset simulation (Au and Beck 2001): a rare event as the last of nested events, each frequent given the one before.

An event is that a flight fails or its score exceeds a threshold, so failure is part of every event whatever the score
is. Flights given an event are drawn by Markov chains that start from those already in it, by conditional sampling
whose step size adapts to the acceptance rate (Papaioannou, Betz, Zwirglmaier and Straub 2015).
"""

import math
from collections.abc import Callable

import numpy as np

from quadstep.numbers import exp, log
from quadstep.studies.rare.cross_entropy import LEAST, MOST_KEPT, NEGLIGIBLE, Level, Replicate, beyond
from quadstep.studies.rare.mixture import Evaluate, Floats, Points, Random, joined

SHARE = 0.1
"""Share of the flights that each event keeps."""

STEP, WANTED = 0.6, 0.44
"""The first step size of the chains, a standard deviation, and the target acceptance rate."""

NEW_NOISE = 0.5
"""Share of the candidates that get new noise; the others keep their predecessor's."""


def subset_simulation(evaluate: Evaluate, events: int, random: Random, size: int) -> list[Replicate]:
    """One replicate of each kind of failure, with `size` flights in each level."""
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
    crude = int(np.isinf(scores).sum())
    probability, step, levels = 1.0, STEP, list[Level]()
    while probability > least:
        share = float(np.isinf(scores).mean())
        if share >= SHARE:
            failures = points.at(np.isinf(scores))
            return Replicate(probability * share, size, crude, (*levels, Level(None, probability * share)), failures)
        threshold = beyond(scores, SHARE)
        above = scores >= threshold
        if above.mean() > MOST_KEPT:
            break
        probability *= float(above.mean())
        levels.append(Level(threshold, probability))
        points, scores, step = chains(evaluate, random, points.at(above), scores[above], threshold, size, step)
    failures = points.at(np.isinf(scores))
    return Replicate(0.0, size, crude, tuple(levels), failures)


def chains(
    evaluate: Callable[[Points], Floats],
    random: Random,
    points: Points,
    scores: Floats,
    threshold: float,
    size: int,
    step: float,
) -> tuple[Points, Floats, float]:
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
