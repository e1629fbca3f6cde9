"""ArduPilot's own loops and ours over the same samples: the autopilot's compiled from a tree, or what it said of some.

Of the tree whole files are compiled, from AC_PosControl down to its mathematics; of the mixer, which needs all of ArduPilot,
the one function.
"""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from quadstep.control.ardupilot_cascade import GRAVITY, ArduPilotCascade, ArduPilotCascadeMemory, outer
from quadstep.control.ardupilot_loops import (
    IntegratorLimits,
    PidGains,
    PidMemory,
    pid,
    root_within,
    shaped,
    shrinking,
    unrooted,
)
from quadstep.control.mixers import ardupilot_mixed
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Matrix, Vector
from quadstep.numbers.rotations import from_yaw_pitch_roll, normalised, unrotate
from tests.firmware_flights import answers, run, walks
from tests.firmware_trees import STUBS

LOOPS = {"rates": 2, "all": 2, "climb": 1, "shapes": 3, "mixer": 8, "cascade": 8, "limited": 8}
"""How many numbers each gives."""

PARAMETER = """#pragma once
template <typename T> struct AP_Value {
    T value; void set(T v) { value = v; } T get() const { return value; } void load() {} void save() {}
    void set_and_save(T v) { value = v; } void set_default(T v) { value = v; }
    operator const T &() const { return value; }
};
using AP_Float = AP_Value<float>; using AP_Int8 = AP_Value<int8_t>; using AP_Int16 = AP_Value<int16_t>;
struct AP_Param {
    struct GroupInfo { int kind; unsigned place; float value; unsigned from; };
    static void setup_object_defaults(const void *object, const GroupInfo *one)
    {
        for (char *at = (char *)object; one->kind; one++) {
            float value = one->from ? *(float *)(at + one->from) : one->value;
            if (one->kind == 4) { *(float *)(at + one->place) = value; }
            if (one->kind == 1) { *(int8_t *)(at + one->place) = value; }
        }
    }
};
#define AP_ENTRY(owner, one, value, from) {sizeof(owner::one), __builtin_offsetof(owner, one), value, from}
#define AP_GROUPINFO(name, number, owner, one, value) AP_ENTRY(owner, one, value, 0)
#define AP_GROUPINFO_FLAGS(name, number, owner, one, value, flags) AP_ENTRY(owner, one, value, 0)
#define AP_GROUPINFO_FLAGS_DEFAULT_POINTER(name, number, o, one, from) AP_ENTRY(o, one, 0, __builtin_offsetof(o, from))
#define AP_SUBGROUPINFO(...) {99}
#define AP_NESTEDGROUPINFO(...) {99}
#define AP_GROUPEND {}
#define AP_PARAMDEFV(...)
"""

MOTORS = """#pragma once
#include <AP_Math/AP_Math.h>
#define AP_MOTORS_MAX_NUM_MOTORS 4
struct AP_Motors {
    struct { bool roll, pitch, yaw, throttle_lower, throttle_upper; } limit;
    float throttle, hover = 0.35f, _throttle_avg_max, _throttle_thrust_max = 1.0f, _throttle_out;
    float get_throttle() const { return throttle; }
    float get_throttle_hover() const { return hover; }
    float get_throttle_out() const { return throttle; }
    float get_throttle_slew_rate() const { return 0; }
    float get_throttle_thrust_max() const { return _throttle_thrust_max; }
    void set_throttle(float one) { throttle = one; }
    void set_throttle_avg_max(float one) { _throttle_avg_max = one; }
    void set_throttle_filter_cutoff(float) {}
    void set_roll(float) {} void set_pitch(float) {} void set_yaw(float) {}
    void set_roll_ff(float) {} void set_pitch_ff(float) {} void set_yaw_ff(float) {}
};
struct AP_MotorsMulticopter : AP_Motors {};
struct AP_MotorsMatrix : AP_MotorsMulticopter {
    struct { float get_compensation_gain() { return 1.0f; } } thr_lin;
    float _roll_in, _roll_in_ff = 0, _pitch_in, _pitch_in_ff = 0, _yaw_in, _yaw_in_ff = 0;
    float _thrust_rpyt_out[4], _throttle_factor[4] = {1, 1, 1, 1};
    float _roll_factor[4] = {-0.5f, 0.5f, 0.5f, -0.5f}, _pitch_factor[4] = {-0.5f, 0.5f, -0.5f, 0.5f};
    float _yaw_factor[4] = {-0.5f, -0.5f, 0.5f, 0.5f}, _yaw_headroom = 200;
    bool motor_enabled[4] = {true, true, true, true}, _thrust_boost = false;
    int _motor_lost_index = 0;
    float boost_ratio(float, float normal) const { return normal; }
    void check_for_failed_motor(float) {}
    void output_armed_stabilizing();
};
"""

AHRS = """#pragma once
#include <AP_Math/AP_Math.h>
struct AP_AHRS_View {
    Quaternion attitude;
    Vector3f gyro, acceleration;
    float yaw = 0;
    void get_quat_body_to_ned(Quaternion &q) const { q = attitude; }
    Vector3f get_gyro_latest() const { return gyro; }
    Vector3f get_accel_ef() const { return acceleration; }
    float cos_yaw() const { return 1; } float sin_yaw() const { return 0; }
    float cos_pitch() const { return cosf(attitude.get_euler_pitch()); }
    float cos_roll() const { return cosf(attitude.get_euler_roll()); }
    uint32_t getLastPosNorthEastReset(Vector2f &) const { return 0; }
    uint32_t getLastPosDownReset(float &) const { return 0; }
};
namespace AP {
struct Ahrs {
    void getControlLimits(float &, float &scale) const { scale = 1; }
    float getControlScaleZ() const { return 1; }
    bool get_relative_position_NED_origin(Vector3p &) const { return true; }
    bool get_relative_position_D_origin_float(float &) const { return true; }
    bool get_velocity_NED(Vector3f &) const { return true; }
    bool get_vert_pos_rate_D(float &) const { return true; }
};
inline Ahrs ahrs() { return {}; }
}
"""

HAL = """#pragma once
#include <stdarg.h>
#include <stdio.h>
#include <AP_HAL/AP_HAL_Boards.h>
#include <AP_InternalError/AP_InternalError.h>
namespace AP_HAL {
struct Util { int snprintf(char *, unsigned, const char *, ...) { return 0; } };
struct HAL { Util *util; };
inline unsigned millis() { return 0; }
inline unsigned long micros64() { return 0; }
}
"""

BOARD = """#pragma once
#include <stdint.h>
#include <string.h>
#define WARN_IF_UNUSED
#define CLASS_NO_COPY(c) c(const c &other) = delete
#define ARRAY_SIZE(a) (sizeof(a) / sizeof(a[0]))
#define __AP_LINE__ __LINE__
#define CONFIG_HAL_BOARD 1
#define HAL_BOARD_SITL 2
#define HAL_WITH_POSTYPE_DOUBLE 1
#define HAL_WITH_EKF_DOUBLE 0
#define HAL_LOGGING_ENABLED 0
#define AP_FILTER_ENABLED 0
"""

NONE = "#pragma once\n"

STUB_HEADERS = {
    "AP_AHRS/AP_AHRS_View.h": AHRS,
    "AP_BoardConfig/AP_BoardConfig.h": NONE + "struct AP_BoardConfig { static void config_error(const char *, ...) {} };\n"
    "class AC_PosControl;\n",
    "AP_Common/AP_Common.h": NONE + "#include <AP_HAL/AP_HAL.h>\n#include <AP_Param/AP_Param.h>\n",
    "AP_CustomRotations/AP_CustomRotations.h": NONE,
    "AP_HAL/AP_HAL.h": HAL,
    "AP_HAL/AP_HAL_Boards.h": BOARD,
    "AP_InternalError/AP_InternalError.h": NONE + "#define INTERNAL_ERROR(x)\n",
    "AP_Logger/AP_Logger.h": NONE,
    "AP_Logger/LogStructure.h": NONE + "enum LogMessages { NO_LOG };\n",
    "AP_Motors/AP_Motors.h": MOTORS,
    "AP_Motors/AP_MotorsMulticopter.h": NONE + "#include <AP_Motors/AP_Motors.h>\n",
    "AP_Param/AP_Param.h": PARAMETER,
    "AP_Scheduler/AP_Scheduler.h": NONE + "namespace AP { struct Scheduler { unsigned ticks32() const { return 0; }\n"
    "float get_filtered_loop_time() const { return 0.0025f; } }; inline Scheduler scheduler() { return {}; } }\n",
    "AP_Scripting/AP_Scripting_config.h": NONE,
    "AP_Vehicle/AP_MultiCopter.h": NONE + "struct AP_MultiCopter { int angle_max = 3000; };\n",
    "AP_Vehicle/AP_Vehicle_Type.h": NONE + "#define APM_BUILD_TYPE(x) 0\n",
    "Filter/AP_Filter.h": NONE,
    "Filter/NotchFilter.h": NONE,
    "Filter/SlewLimiter.h": NONE + "struct SlewLimiter { SlewLimiter(const float &, const float &) {} "
    "float modifier(float, float) { return 1; } float get_slew_rate() const { return 0; } };\n",
}

WHOLE = (
    *(f"AP_Math/{one}.cpp" for one in ("AP_Math", "control", "matrix3", "quaternion", "vector2", "vector3")),
    *(f"AC_PID/{one}.cpp" for one in ("AC_P", "AC_P_1D", "AC_P_2D", "AC_PID", "AC_PID_2D", "AC_PID_Basic")),
    *(f"AC_AttitudeControl/AC_{one}.cpp" for one in ("AttitudeControl", "AttitudeControl_Multi", "PosControl")),
)
"""Files of the tree that are compiled as they are."""


def motion(lanes: int, samples: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Random walks, near limits and beyond, rounded to f32."""
    random = np.random.default_rng(seed)
    walk = walks(random, lanes, samples)

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
        "cascade": flying(walk, flags),
        "limited": flying(walk, flags),
    }
    return {name: np.ascontiguousarray(one, dtype=np.float32) for name, one in given.items()}


def flying(walk: Callable[..., np.ndarray], flags: Callable[[int], np.ndarray]) -> np.ndarray:
    """What position and attitude loops are given: position and what is wanted of it [m], velocities [m/s], acceleration
    [m/s^2], heading [rad] and its rate, attitude, rates [rad/s], vertical acceleration, limits of throttle.
    """
    attitude = from_yaw_pitch_roll(Vector(np.moveaxis(np.concatenate([walk(1, 3.0, 0.02), walk(2, 0.6, 0.02)], axis=2), 2, 0)))
    place, speed = walk(3, 5.0, 0.02), walk(3, 2.0, 0.05)
    parts = [place, place + walk(3, 4.0, 0.05), speed, speed + walk(3, 2.0, 0.05), walk(3, 2.0, 0.05), walk(1, 3.0, 0.02)]
    parts += [walk(1, 1.0, 0.02), np.stack(list(attitude), axis=2), walk(3, 1.0, 0.05), walk(1, 1.5, 0.05), flags(2)]
    return np.concatenate(parts, axis=2)


def firmware(folder: Path, tree: Path, given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What ArduPilot's own code makes of it."""
    text = (tree / "libraries/AP_Motors/AP_MotorsMatrix.cpp").read_text(encoding="utf-8")
    mixer = re.search(r"^void AP_MotorsMatrix::output_armed_stabilizing\(\)\n\{\n.*?^\}\n", text, re.DOTALL | re.MULTILINE)
    assert mixer, "AP_MotorsMatrix.cpp has no mixer"
    stock = (STUBS / "ardupilot/stock.cpp").read_text(encoding="utf-8")
    files = {**STUB_HEADERS, "stock.cpp": stock, "mixer.cpp": "#include <AP_Motors/AP_Motors.h>\n" + mixer[0]}
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    found = [f"-I{folder}", f"-I{tree / 'libraries'}"]
    flags = ["-std=gnu++17", "-O1", "-ffp-contract=off", "-fsingle-precision-constant", "-w", "-shared", "-fPIC"]
    flags += ["-Dprivate=public", "-Dprotected=public"]
    library = folder / "stock.so"
    units = [*(str(tree / "libraries" / one) for one in WHOLE), "mixer.cpp", "stock.cpp"]
    run(["g++", *flags, *found, *units, "-lm", "-o", str(library)], folder)
    return answers(library, given, LOOPS)


RATES = PidGains(0.135, 0.135, 0.0036, 0.0, 0.0, 0.5, 0.0, 20.0, 0.0, 20.0)
ALL = PidGains(0.18, 0.018, 0.002, 0.1, 0.01, 0.05, 0.2, 20.0, 2.5, 10.0)
CLIMB = PidGains(5.0, 0.5, 0.1, 0.2, 0.0, 10.0, 0.0, 0.0, 5.0, 5.0)
TOLD = {"MOT_HOVER_LEARN": 0.0, "MOT_THST_HOVER": 0.35, "INS_ACCEL_FILTER": 0.0}
BOUNDS = {"ATC_RATE_R_MAX": 60.0, "ATC_RATE_P_MAX": 40.0, "ATC_RATE_Y_MAX": 30.0, "ATC_ACCEL_R_MAX": 20000.0}
BOUNDS |= {"ATC_ACCEL_P_MAX": 15000.0, "ATC_ACCEL_Y_MAX": 4000.0, "PSC_ANGLE_MAX": 15.0}
FACTORS = Matrix([Vector(row) for row in ((-0.5, -0.5, -0.5), (0.5, 0.5, -0.5), (0.5, -0.5, 0.5), (-0.5, 0.5, 0.5))])
NOTHING = PidMemory(*[np.float32(0.0)] * 4)


def narrow(gains: PidGains) -> PidGains:
    """In f32, as ArduPilot has them."""
    return PidGains(*map(np.float32, gains))


def ours(given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What our laws make of it, in f32 as ArduPilot."""
    period, made, begun = np.float32(0.0025), {name: [] for name in LOOPS}, 0.0
    model = load_preset("x500").model()
    cascades = {"cascade": ArduPilotCascade.gains(model, TOLD), "limited": ArduPilotCascade.gains(model, {**TOLD, **BOUNDS})}
    memories: dict[str, ArduPilotCascadeMemory] = {}
    loops = {"rates": (narrow(RATES), NOTHING), "all": (narrow(ALL), NOTHING)}
    climb = NOTHING
    for i in range(given["rates"].shape[1]):
        for name, (gains, memory) in loops.items():
            target, measured, limited = given[name][:, i].T
            output, ahead, after = pid(gains, memory, target, measured, shrinking(limited, memory), begun, period)
            loops[name] = (gains, after)
            made[name].append((output, ahead))
        target, measured, low, high = given["climb"][:, i].T
        output, ahead, climb = pid(narrow(CLIMB), climb, target, measured, IntegratorLimits(low, high), begun, period)
        made["climb"].append((output + ahead,))
        error, rate, wanted = given["shapes"][:, i].T
        turned = shaped(error, np.float32(0.15), np.float32(4.7), rate, wanted, np.float32(1.05), period)
        reach = root_within(error, np.float32(4.5), np.float32(9.6), period)
        made["shapes"].append((reach, unrooted(np.abs(rate), np.float32(4.5), np.float32(2.1)), turned))
        roll, pitch, yaw, throttle, average = given["mixer"][:, i].T
        found = ardupilot_mixed(FACTORS, Vector((roll, pitch, yaw)), throttle, average, np.float32(0.2))
        made["mixer"].append((*found.thrusts, *found[1:]))
        for name, gains in cascades.items():
            n = given[name][:, i].T.astype(float)
            attitude = normalised(Vector(n[17:21]))
            now = Measured(Vector(n[0:3]), Vector(n[6:9]), attitude, Vector(n[21:24]), 0.0, Vector([0.0] * 3))
            now = now._replace(specific_force=unrotate(attitude, Vector((0.0, 0.0, n[24] + GRAVITY))))
            wanted = Reference(Vector(n[3:6]), Vector(n[9:12]), Vector(n[12:15]), n[15], n[16])
            if not begun:
                memories[name] = ArduPilotCascade().start(now, gains)
            before = memories[name]._replace(limits=Vector((0.0, 0.0, n[26], n[25])), begun=begun)
            left = memories[name] = outer(before, now, now.rates, wanted, gains, 0.0025)
            made[name].append((*left.wanted, left.asked, left.average, left.lean, left.push[2, 0], left.push[2, 1]))
        begun = 1.0
    return {name: np.stack([np.stack(list(row), axis=1) for row in rows], axis=1) for name, rows in made.items()}
