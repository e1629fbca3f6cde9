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


BLACKBOX = (
    *(f"rcCommand[{i}]" for i in range(4)), *(f"gyroADC[{i}]" for i in range(3)), *(f"axisP[{i}]" for i in range(3)),
    *(f"axisI[{i}]" for i in range(3)), "axisD[0]", "axisD[1]", *(f"motor[{i}]" for i in range(4)),
)  # fmt: skip
"""What is read of a flight: sticks [us] and rates [deg/s] to a tenth, the rest in whole numbers."""

LOGGED = """set blackbox_device = SERIAL
set blackbox_high_resolution = ON
set blackbox_sample_rate = 1/1
serial 1 128 115200 57600 0 115200
set f_roll = 0
set f_pitch = 0
set f_yaw = 0
set d_max_advance = 0
set throttle_boost = 0
set dterm_lpf1_dyn_min_hz = 0
set rc_smoothing = OFF
"""
"""Its blackbox on UART2, and off what the log does not tell exactly: what sticks do between packets, throttle that is boosted,
and a cut-off that follows it in steps.
"""

FLOWN = {"f": 0.0, "d_advance": 0.0, "boost": 0.0, "d_least": 0.0, "idle": 700.0}
"""The same of our law; its simulator's motors idle at 1070 us."""

SETTLED = 300
"""Samples after which filters have forgotten how they began."""


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


def in_flight(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What Betaflight logged of a flight, and what our law makes of the same sticks and rates from its I parts after
    SETTLED samples on, each (n - SETTLED, 10): P + I + D of each axis, I of each axis, motors [us] (back right, front right,
    back left, front left). rows: BLACKBOX, (n, 19).
    """
    plain = BetaflightRates.gains(load_preset("x500").model())
    roll, pitch, yaw, filters, shared = (
        part._replace(**{name: value for name, value in FLOWN.items() if name in part._fields})
        for part in (plain.roll, plain.pitch, plain.yaw, plain.filters, plain.shared)
    )
    axes, mixed, made = [still()] * 3, MixerState(0.0, 0.0, Vector([0.0] * 2), 0.0), []
    for i, row in enumerate(rows.tolist()):
        if i == SETTLED:
            axes = [one._replace(integral=before) for one, before in zip(axes, rows[i - 1, 10:13].tolist(), strict=True)]
        outputs = []
        for axis, own in enumerate((roll, pitch, yaw)):
            share, rate = row[axis] / 500.0, row[4 + axis]
            asked = 70.0 * share + 600.0 * abs(share) * share  # its default rates
            output, axes[axis] = pid(own, shared, filters, axes[axis], mixed, asked, rate, 0.001, turn=axis == 2)
            outputs.append(output)
        motors, mixed = mix(shared, mixed, tuple(outputs), row[3] / 1000.0 - 1.0, False, 0.001)
        front_right, back_right, back_left, front_left = motors
        pulses = [1000.0 * (1.0 + one) for one in (back_right, front_right, back_left, front_left)]
        made.append([*outputs, *(one.integral for one in axes), *pulses])
    sums = rows[:, 7:10] + rows[:, 10:13]
    sums[:, :2] += rows[:, 13:15]
    return np.hstack([sums, rows[:, 10:13], rows[:, 15:]])[SETTLED:], np.array(made)[SETTLED:]
