"""Flights of a sampled loop from starts that are off the mission's, each number of the state by a share of what is unknown."""

import numpy as np

from quadstep.numbers import flatten, leaf_names, rebuild

PARTS = {"position": 0, "velocity": 1, "attitude": 2, "pitch": 2, "rates": 3, "rate": 3}


def turned(quaternion, way):
    """The attitude (w, x, y, z) after a turn by the vector `way` [rad] about the vehicle's axes."""
    angle = np.linalg.norm(way)
    w, v = np.cos(0.5 * angle), np.sin(0.5 * angle) * way / max(angle, 1e-300)
    a, u = quaternion[0], np.array(quaternion[1:])
    return [a * w - u @ v, *(a * v + w * u + np.cross(u, v))]


def begun(loop, unknown, shares):
    """The loop's state at a start. shares: (4, 3), of position, velocity, attitude and rates, each from -1 to 1."""
    radii = (unknown.start, unknown.start_velocity, unknown.start_attitude, unknown.start_rates)
    values, names = list(map(float, flatten(loop.plan.start))), leaf_names(loop.plan.start)
    places = {}
    for place, name in enumerate(names):
        places.setdefault(name.partition(".")[0], []).append(place)
    for name, part in PARTS.items():
        off = radii[part] * np.asarray(shares[part])
        if len(places.get(name, [])) == 4:
            for place, value in zip(places[name], turned([values[i] for i in places[name]], off), strict=True):
                values[place] = float(value)
        elif radii[part]:
            for i, place in enumerate(places.get(name, [])):
                values[place] += float(off[i])
    return loop.at_rest(loop.loop.start(rebuild(loop.plan.start, iter(values)), loop.parameters))


def flown(loop, x, samples, p=None):
    """The state before every sample, (samples + 1, states), of a flight from the state x."""
    rows = [np.array(x, dtype=float)]
    for sample in range(samples):
        x = loop.step([float(one) for one in x], float(sample * loop.span), p)
        rows.append(np.array(x, dtype=float))
    return np.array(rows)
