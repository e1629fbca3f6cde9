"""Boxes of states around which a law is enclosed, and whether the images of points in them stay in the enclosure."""

import numpy as np

from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import image, seeded


def spread(centres, radius):
    """Directions along the axes, shape (numbers, directions, samples)."""
    return np.eye(len(centres))[:, :, None] * np.broadcast_to(radius, centres.shape)[:, None, :]


def outside(law, centres, radius, points, seed=1):
    """By how much the law leaves its enclosure at random points and corners of boxes, at most; and the enclosure's widths.

    law: takes a list of numbers and gives one. centres: (numbers, samples).
    """
    rng = np.random.default_rng(seed)
    width = spread(centres, radius)
    found = image(law(seeded(centres, width, spare=6)), len(centres), centres.shape[1])
    most = 0.0
    for trial in range(points):
        e = rng.uniform(-1.0, 1.0, centres.shape)
        e = np.sign(e) if trial % 2 else e
        reached = law(list(centres + radius * e))
        line = found.centre + np.einsum("ijb,jb->ib", found.parts, e)
        off = np.abs(np.array([np.broadcast_to(one, line.shape[1]) for one in reached]) - line)
        rounding = 1e-15 * (np.abs(found.centre) + np.abs(found.parts).sum(axis=1))  # of `line` itself
        most = max(most, float(np.max(off - found.rest - rounding)))
    return most, found.rest


def states(loop: SampledLoop, count, size, seed=2):
    """Some states about the start of a flight, (numbers, count), and the samples at which they are taken."""
    rng = np.random.default_rng(seed)
    start = np.array([loop.start[place] for place in loop.places])
    ticks = np.linspace(0.0, float(loop.ticks.last // loop.span // 2), count).round() * loop.span
    return start[:, None] + size * rng.uniform(-1.0, 1.0, (len(start), count)), ticks
