"""Betaflight's own rate loop and mixer and ours over the same samples: the firmware's, compiled from a tree."""

import ctypes
from pathlib import Path
from unittest import mock

import numpy as np

from quadstep.control.betaflight_rates import BetaflightRates, MixerState, mix, pid, still
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector
from tests.firmware_flights import run
from tests.firmware_trees import STUBS

UNITS = ("flight/pid.c", "flight/pid_init.c", "flight/mixer.c", "common/filter.c", "common/maths.c")
FEATURES = ("ITERM_RELAX", "D_MIN", "FEEDFORWARD", "TPA_MODE", "DYN_LPF", "THROTTLE_BOOST", "THRUST_LINEARIZATION")
FLAGS = ("-std=gnu11", "-O1", "-ffp-contract=off", "-w", "-shared", "-fPIC", "-DUNIT_TEST", '-D__TARGET__="TEST"')
PERIOD = np.float32(1000.0) * np.float32(1e-6)

AXIS = ("p", "i", "d", "f", "d_min")
FILTERS = ("d_notch", "d_notch_cut", "d1", "d1_type", "d_least", "d_most", "d_expo", "d2", "d2_type", "yaw")
SHARED = (
    "d_gain", "d_advance", "i_limit", "windup", "relax", "relax_type", "relax_cut", "limit", "limit_yaw", "gravity_gain",
    "gravity_p", "gravity_cut", "tpa_mode", "tpa_rate", "tpa_breakpoint", "boost", "boost_cut", "linear",
)  # fmt: skip
"""What `rates.c` is told, in its order."""

CASES = {
    "defaults": {},
    "static": {"d_least": 0.0, "d1": 90.0, "d2": 0.0, "yaw": 0.0, "d_min": 0.0, "tpa_mode": 0.0, "windup": 100.0},
    "busy": {"relax": 4.0, "relax_type": 0.0, "d1_type": 2.0, "d2_type": 3.0, "linear": 40.0, "limit": 200.0, "airmode": 0.0},
    "steady": {"relax": 2.0, "boost": 0.0, "gravity_gain": 0.0, "i_limit": 20.0, "d": 20.0, "f": 0.0},
    "biquads": {"d_least": 0.0, "d1_type": 1.0, "d2_type": 1.0, "d_notch": 200.0, "d_notch_cut": 140.0},
}
"""Settings that differ from the defaults, of all axes alike."""


def motion(lanes: int, samples: int, seed: int = 0) -> np.ndarray:
    """Setpoints, rates [deg/s] and throttle as random walks, at rest at times, to the limits and beyond."""
    random = np.random.default_rng(seed)
    steps = random.normal(0.0, 1.0, (lanes, samples, 7)) * random.choice([0.0, 0.3, 3.0, 12.0], (lanes, 1, 7))
    walk = np.cumsum(steps, axis=1) + random.normal(0.0, 30.0, (lanes, 1, 7))
    walk[..., 3:6] += walk[..., 0:3]
    walk[..., 6] = 0.1 + 0.85 * (0.5 + np.arctan(0.03 * walk[..., 6]) / np.pi)
    micros = np.float32(1000.0) + np.float32(1000.0) * walk[..., 6].astype(np.float32)  # as a receiver says it
    walk[..., 6] = (micros - np.float32(1000.0)) / np.float32(1000.0)
    return np.ascontiguousarray(walk, dtype=np.float32)


def gains(case: str):
    """The law's, with a case's settings, in f32."""
    own = BetaflightRates.gains(load_preset("x500").model())
    changed = {}
    for name in ("roll", "pitch", "yaw", "filters", "shared"):
        part = getattr(own, name)
        values = {key: np.float32(CASES[case].get(key, value)) for key, value in part._asdict().items()}
        changed[name] = type(part)(**values)
    return own._replace(**changed)


def settings(case: str) -> np.ndarray:
    """For `set` of `rates.c`."""
    own = gains(case)
    axes = [getattr(axis, name) for axis in (own.roll, own.pitch, own.yaw) for name in AXIS]
    return np.array([*axes, *(getattr(own.filters, one) for one in FILTERS), *(getattr(own.shared, one) for one in SHARED)],
                    np.float32)  # fmt: skip


def compiled(folder: Path, tree: Path) -> ctypes.CDLL:
    """The firmware's code of a tree."""
    library, harness = folder / "rates.so", folder / "rates.c"
    harness.write_text((STUBS / "betaflight/rates.c").read_text(encoding="utf-8"), encoding="utf-8")
    found = [f"-I{tree / 'src/test/unit'}", f"-I{tree / 'src/main'}", *(f"-DUSE_{one}" for one in FEATURES)]
    units = [str(harness), *(str(tree / "src/main" / one) for one in UNITS)]
    run(["gcc", *FLAGS, *found, *units, "-lm", "-o", str(library)], folder)
    return ctypes.CDLL(str(library))


def firmware(library: ctypes.CDLL, case: str, given: np.ndarray) -> np.ndarray:
    """What the firmware makes of it: outputs of the axes, and motors; shape (lanes, samples, 7)."""
    told, made = settings(case), np.empty_like(given)
    library.set(told.ctypes.data_as(ctypes.c_void_p), int(CASES[case].get("airmode", 1.0)))
    library.fly(*given.shape[:2], *(one.ctypes.data_as(ctypes.c_void_p) for one in (given, made)))
    return made


def narrow(of):
    """A function of NumPy, in f32 also where it is given numbers alone."""
    return lambda x: np.asarray(of(x)).astype(np.float32)


@mock.patch.multiple("quadstep.control.filters", sin=narrow(np.sin), cos=narrow(np.cos))  # ours are in f64 there
def ours(case: str, given: np.ndarray) -> np.ndarray:
    """What our law makes of it, in f32."""
    own = gains(case)
    lanes, samples, _ = given.shape
    none = np.zeros(lanes, np.float32)
    begin = type(still())(*(Vector([none] * len(part)) if isinstance(part, Vector) else none for part in still()))
    axes = [begin] * 3
    mixed = MixerState(given[:, 0, 6], none, Vector([none] * 2), none)
    made = np.empty_like(given)
    for i in range(samples):
        outputs = []
        for axis, part in enumerate((own.roll, own.pitch, own.yaw)):
            asked, gyro = given[:, i, axis], given[:, i, 3 + axis]
            output, axes[axis] = pid(part, own.shared, own.filters, axes[axis], mixed, asked, gyro, PERIOD, turn=axis == 2)
            made[:, i, axis] = output
            outputs.append(output)
        motors, mixed = mix(own.shared, mixed, tuple(outputs), given[:, i, 6], False, PERIOD)
        front_right, back_right, back_left, front_left = motors
        made[:, i, 3:] = np.stack([front_right, back_right, back_left, front_left], axis=1)
    return made
