"""ArduPilot's own loops and ours over the same samples: the autopilot's compiled from a tree, or what it said of some.

Of the tree two files are compiled whole, AC_PID and AC_PID_Basic; of others, which need all of ArduPilot, single functions are
taken out and compiled beside them.
"""

import ctypes
import re
from pathlib import Path

import numpy as np

from quadstep.control.ardupilot_loops import Held, PidGains, PidMemory, pid, root_within, shaped, shrinking, unrooted
from quadstep.control.mixers import ardupilot_mixed
from quadstep.numbers import Matrix, Vector
from tests.firmware_flights import run
from tests.firmware_trees import STUBS

LOOPS = {"rates": 2, "all": 2, "climb": 1, "shapes": 3, "mixer": 8}
"""How many numbers each gives."""

HEAD = """#pragma once
#include <math.h>
#include <float.h>
#include <stdint.h>
#include <string.h>
#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define M_2PI (2 * M_PI)
#define INTERNAL_ERROR(x)
#define WARN_IF_UNUSED
#define CLASS_NO_COPY(c) c(const c &other) = delete
#define AP_FILTER_ENABLED 0
static inline bool is_zero(float x) { return fabsf(x) < FLT_EPSILON; }
static inline bool is_positive(float x) { return x >= FLT_EPSILON; }
static inline bool is_negative(float x) { return x <= -FLT_EPSILON; }
static inline float sq(float x) { return x * x; }
static inline float safe_sqrt(float x) { return x > 0 ? sqrtf(x) : 0; }
static inline float constrain_float(float x, float low, float high) { return x < low ? low : x > high ? high : x; }
"""

PARAMETER = """#pragma once
struct AP_Float {
    float value; void set(float v) { value = v; } float get() const { return value; } void load() {} void save() {}
    operator const float &() const { return value; }
};
struct AP_Param { struct GroupInfo { int none; }; static void setup_object_defaults(const void *, const GroupInfo *) {} };
#define AP_GROUPINFO_FLAGS_DEFAULT_POINTER(...) {}
#define AP_GROUPINFO(...) {}
#define AP_GROUPEND {}
"""

MOTORS = """#pragma once
#include <AP_Math/AP_Math.h>
#define AP_MOTORS_MAX_NUM_MOTORS 4
struct AP_MotorsMatrix {
    struct { float get_compensation_gain() { return 1.0f; } } thr_lin;
    struct { bool roll, pitch, yaw, throttle_lower, throttle_upper; } limit;
    float _roll_in, _roll_in_ff = 0, _pitch_in, _pitch_in_ff = 0, _yaw_in, _yaw_in_ff = 0, throttle, _throttle_avg_max;
    float _throttle_thrust_max = 1.0f, _throttle_out, _thrust_rpyt_out[4], _throttle_factor[4] = {1, 1, 1, 1};
    float _roll_factor[4] = {-0.5f, 0.5f, 0.5f, -0.5f}, _pitch_factor[4] = {-0.5f, 0.5f, -0.5f, 0.5f};
    float _yaw_factor[4] = {-0.5f, -0.5f, 0.5f, 0.5f}, _yaw_headroom = 200;
    bool motor_enabled[4] = {true, true, true, true}, _thrust_boost = false;
    int _motor_lost_index = 0;
    float get_throttle() { return throttle; }
    float boost_ratio(float, float normal) const { return normal; }
    void check_for_failed_motor(float) {}
    void output_armed_stabilizing();
};
"""

STUB_HEADERS = {
    "AP_Common/AP_Common.h": "#include <AP_Math/AP_Math.h>\n",
    "AP_HAL/AP_HAL.h": "#pragma once\n",
    "AP_InternalError/AP_InternalError.h": "#pragma once\n",
    "AP_Param/AP_Param.h": PARAMETER,
    "AP_Motors/AP_Motors.h": MOTORS,
    "Filter/SlewLimiter.h": "#pragma once\nstruct SlewLimiter { SlewLimiter(const float &, const float &) {} "
    "float modifier(float, float) { return 1; } float get_slew_rate() const { return 0; } };\n",
    "Filter/NotchFilter.h": "#pragma once\n",
    "Filter/AP_Filter.h": "#pragma once\n",
}

TAKEN = (
    ("AP_Math/AP_Math.cpp", r"float calc_lowpass_alpha_dt\(float dt, float cutoff_freq\)"),
    ("AP_Math/control.cpp", r"float sqrt_controller\(float error, float p, float second_ord_lim, float dt\)"),
    ("AP_Math/control.cpp", r"float inv_sqrt_controller\(float output, float p, float D_max\)"),
    ("AC_AttitudeControl/AC_AttitudeControl.cpp", r"float AC_AttitudeControl::input_shaping_ang_vel\([^)]*\)"),
    ("AC_AttitudeControl/AC_AttitudeControl.cpp", r"float AC_AttitudeControl::input_shaping_angle\([^)]*\)"),
)
"""Functions that are taken out, by the file and how they begin."""


def motion(lanes: int, samples: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Random walks, near limits and beyond, rounded to f32."""
    random = np.random.default_rng(seed)

    def walk(parts: int, size: float, step: float) -> np.ndarray:
        begin = random.uniform(-size, size, (lanes, 1, parts))
        return begin + np.cumsum(random.normal(0.0, step, (lanes, samples, parts)), axis=1)

    def flags(parts: int) -> np.ndarray:
        return random.random((lanes, samples, parts)) < 0.3

    throttle = walk(1, 0.7, 0.03)
    turning = np.concatenate([walk(2, 1.5, 0.05), flags(1)], axis=2)
    given = {
        "rates": turning,
        "all": turning,
        "climb": np.concatenate([walk(2, 3.0, 0.05), flags(2)], axis=2),
        "shapes": np.concatenate([walk(1, 0.6, 0.02), walk(2, 0.8, 0.02)], axis=2),
        "mixer": np.concatenate([walk(3, 0.5, 0.03), throttle, throttle + np.abs(walk(1, 0.2, 0.01))], axis=2),
    }
    return {name: np.ascontiguousarray(one, dtype=np.float32) for name, one in given.items()}


def taken(tree: Path, name: str, begins: str) -> str:
    """A function of a file, no class's."""
    text = (tree / "libraries" / name).read_text(encoding="utf-8")
    found = re.search(rf"^(?:void )?{begins}\n\{{\n.*?^\}}\n", text, re.DOTALL | re.MULTILINE)
    assert found, f"{name} has no {begins}"
    return found[0].replace("AC_AttitudeControl::", "")


def firmware(folder: Path, tree: Path, given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What ArduPilot's own code makes of it."""
    functions = [taken(tree, name, begins) for name, begins in TAKEN]
    heads = [one.partition("\n{")[0] + ";\n" for one in functions]
    files = {
        **STUB_HEADERS,
        "AP_Math/AP_Math.h": HEAD + "".join(heads),
        "taken.cpp": "#include <AP_Motors/AP_Motors.h>\n"
        + "".join(functions)
        + taken(tree, "AP_Motors/AP_MotorsMatrix.cpp", r"AP_MotorsMatrix::output_armed_stabilizing\(\)"),
        "stock.cpp": (STUBS / "ardupilot/stock.cpp").read_text(encoding="utf-8"),
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    found = [f"-I{folder}", f"-I{tree / 'libraries'}"]
    flags = ["-std=gnu++17", "-O1", "-ffp-contract=off", "-fsingle-precision-constant", "-w", "-shared", "-fPIC"]
    flags += ["-Dprivate=public", "-Dprotected=public"]
    library = folder / "stock.so"
    units = [str(tree / "libraries/AC_PID" / one) for one in ("AC_PID.cpp", "AC_PID_Basic.cpp")]
    units += [str(folder / one) for one in ("taken.cpp", "stock.cpp")]
    run(["g++", *flags, *found, *units, "-lm", "-o", str(library)], folder)
    loaded, made = ctypes.CDLL(str(library)), {}
    for name, count in LOOPS.items():
        lanes, samples, _ = given[name].shape
        made[name] = np.empty((lanes, samples, count), np.float32)
        place = [one.ctypes.data_as(ctypes.c_void_p) for one in (given[name], made[name])]
        getattr(loaded, name)(lanes, samples, *place)
    return made


RATES = PidGains(0.135, 0.135, 0.0036, 0.0, 0.0, 0.5, 0.0, 20.0, 0.0, 20.0)
ALL = PidGains(0.18, 0.018, 0.002, 0.1, 0.01, 0.05, 0.2, 20.0, 2.5, 10.0)
CLIMB = PidGains(5.0, 0.5, 0.1, 0.2, 0.0, 10.0, 0.0, 0.0, 5.0, 5.0)
FACTORS = Matrix([Vector(row) for row in ((-0.5, -0.5, -0.5), (0.5, 0.5, -0.5), (0.5, -0.5, 0.5), (-0.5, 0.5, 0.5))])
NOTHING = PidMemory(*[np.float32(0.0)] * 4)


def narrow(gains: PidGains) -> PidGains:
    """In f32, as ArduPilot has them."""
    return PidGains(*map(np.float32, gains))


def ours(given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What our laws make of it, in f32 as ArduPilot."""
    period, made, begun = np.float32(0.0025), {name: [] for name in LOOPS}, 0.0
    loops = {"rates": (narrow(RATES), NOTHING), "all": (narrow(ALL), NOTHING)}
    climb = NOTHING
    for i in range(given["rates"].shape[1]):
        for name, (gains, memory) in loops.items():
            target, measured, limited = given[name][:, i].T
            output, ahead, after = pid(gains, memory, target, measured, shrinking(limited, memory), begun, period)
            loops[name] = (gains, after)
            made[name].append((output, ahead))
        target, measured, low, high = given["climb"][:, i].T
        output, ahead, climb = pid(narrow(CLIMB), climb, target, measured, Held(low, high), begun, period)
        made["climb"].append((output + ahead,))
        error, rate, wanted = given["shapes"][:, i].T
        turned = shaped(error, np.float32(0.15), np.float32(4.7), rate, wanted, np.float32(1.05), period)
        reach = root_within(error, np.float32(4.5), np.float32(9.6), period)
        made["shapes"].append((reach, unrooted(np.abs(rate), np.float32(4.5), np.float32(2.1)), turned))
        roll, pitch, yaw, throttle, average = given["mixer"][:, i].T
        found = ardupilot_mixed(FACTORS, Vector((roll, pitch, yaw)), throttle, average, np.float32(0.2))
        made["mixer"].append((*found.thrusts, *found[1:]))
        begun = 1.0
    return {name: np.stack([np.stack(list(row), axis=1) for row in rows], axis=1) for name, rows in made.items()}
