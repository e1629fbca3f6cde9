"""Random samples for laws of real vehicles, and results by NumPy and SciPy: nothing here uses the package."""

import numpy as np
from scipy.spatial.transform import Rotation

from quadstep.control.registry import controllers
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector

UP = np.array([0.0, 0.0, 1.0])


def law_of(kind, vehicle="research-2.6kg"):
    """A controller of the package and its usual gains."""
    model, found = load_preset(vehicle).model(), controllers(Measured)[kind]
    return found.for_vehicle(model), found.gains(model)


def shaken(gains, random, bounds=1.0, name=""):
    """The same structure with every number changed, bounds scaled, and none of them zero or equal to another."""
    if isinstance(gains, Vector):
        return Vector(shaken(entry, random, bounds, name) for entry in gains)
    if hasattr(gains, "_asdict"):
        return type(gains)(**{key: shaken(value, random, bounds, key) for key, value in gains._asdict().items()})
    if isinstance(gains, tuple):
        return tuple(shaken(entry, random, bounds, name) for entry in gains)
    scaled = gains * (bounds if "bound" in name else 1.0)
    return float(random.uniform(0.6, 1.4) * scaled) if scaled else float(random.uniform(0.02, 0.1))


def any_vector(random, size, count=3):
    return Vector(float(one) for one in random.normal(0.0, size, count))


def any_measured(random, tilt=0.5, **known):
    """A sample of everything that a real vehicle can tell."""
    turn = Rotation.from_euler("z", random.uniform(-3.0, 3.0)) * Rotation.from_rotvec(random.normal(0.0, tilt, 3))
    x, y, z, w = turn.as_quat()
    some = {
        "position": any_vector(random, 0.3),
        "velocity": any_vector(random, 1.0),
        "attitude": Vector(map(float, (w, x, y, z))),
        "rates": any_vector(random, 2.0),
        "thrust": float(random.uniform(10.0, 40.0)),
        "torque": any_vector(random, 0.5),
        "specific_force": any_vector(random, 3.0) + Vector((0.0, 0.0, 9.0)),
        "rotor_speeds": Vector(float(one) for one in random.uniform(300.0, 700.0, 4)),
    }
    return Measured(**{**some, **known})


def any_reference(random):
    """An instant of a path."""
    sizes = {"position": 0.3, "velocity": 2.0, "acceleration": 2.0, "jerk": 3.0, "snap": 5.0}
    yaws = {"yaw": float(random.uniform(-3.0, 3.0)), "yaw_rate": float(random.normal(0.0, 1.0))}
    return Reference(**{key: any_vector(random, size) for key, size in sizes.items()}, **yaws)


def arrays(structure):
    """A dict of arrays and floats of a `NamedTuple` of vectors and numbers."""
    found = structure._asdict()
    return {key: np.array(list(value)) if isinstance(value, Vector) else value for key, value in found.items()}


def rotation_of(attitude):
    w, x, y, z = attitude
    return Rotation.from_quat([x, y, z, w]).as_matrix()


def frame(force, yaw):
    """The attitude with its third axis along a force and its first nearest the heading."""
    third = force / np.linalg.norm(force)
    second = np.cross(third, [np.cos(yaw), np.sin(yaw), 0.0])
    second /= np.linalg.norm(second)
    return np.column_stack([np.cross(second, third), second, third])


def turning(attitude, h=2e-3):
    """Body rates and their rate at t = 0 of an attitude over time, by differences of fourth order."""

    def central(f):
        return (8.0 * f(h) - f(2.0 * h)) / (12.0 * h)

    def rates(t):
        return central(lambda d: Rotation.from_matrix(attitude(t - d).T @ attitude(t + d)).as_rotvec())

    return rates(0.0), central(lambda d: rates(d) - rates(-d))


def attitude_errors(attitude, rotation, rates, h=2e-3):
    """An attitude now, Lee's errors of attitude and rates to it, and the angular acceleration that follows it over time."""
    wanted = attitude(0.0)
    wanted_rates, change = turning(attitude, h)
    across = rotation.T @ wanted
    skew = 0.5 * (wanted.T @ rotation - rotation.T @ wanted)
    e_r = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return wanted, e_r, rates - across @ wanted_rates, across @ change - np.cross(rates, across @ wanted_rates)


def reachable(force, most):
    """A force within the rotors' reach: height first."""
    up = np.clip(force[2], 0.1 * most, 0.95 * most)
    level, room = np.hypot(*force[:2]), np.sqrt(most**2 - up**2)
    return np.array([*(force[:2] * min(1.0, room / level)), up])
