"""PX4's own loops and ours over the same samples: the autopilot's compiled from a tree, or what it said of some."""

import re
from pathlib import Path

import numpy as np

from quadstep.control.mixers import px4_mixed, px4_mixer
from quadstep.control.px4_cascade import Px4Cascade, gyro_filters, position_gains, rate_gains
from quadstep.control.px4_loops import STILL, MotionNow, attitude_loop, attitude_of, of_gyro, position_loop, rate_loop
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Matrix, Vector
from quadstep.numbers.rotations import from_rotation_vector, multiply
from tests.firmware_flights import answers, run, walks
from tests.firmware_trees import STUBS

LOOPS = {
    "attitude": 3, "rates": 3, "gyro": 2, "position": 7, "coupled": 7, "mixer": 7, "airmode1": 7, "airmode2": 7,
}  # fmt: skip
"""How many numbers each gives."""

UNITS = (
    "lib/rate_control/rate_control.cpp",
    "modules/mc_att_control/AttitudeControl/AttitudeControl.cpp",
    "modules/mc_pos_control/PositionControl/PositionControl.cpp",
    "modules/mc_pos_control/PositionControl/ControlMath.cpp",
    "modules/control_allocator/ControlAllocation/ControlAllocation.cpp",
    "modules/control_allocator/ControlAllocation/ControlAllocationPseudoInverse.cpp",
    "modules/control_allocator/ControlAllocation/ControlAllocationSequentialDesaturation.cpp",
)
"""Of PX4's `src`."""

MESSAGES = (
    "ControlAllocatorStatus", "RateCtrlStatus", "TrajectorySetpoint", "VehicleAttitudeSetpoint",
    "VehicleLocalPositionSetpoint",
)  # fmt: skip

HEADERS = {
    "px4_boardconfig.h": "",
    "drivers/drv_hrt.h": """#pragma once
#include <stdint.h>
typedef uint64_t hrt_abstime;
hrt_abstime hrt_absolute_time();
""",
    "px4_platform_common/module_params.h": """#pragma once
struct ModuleParams { ModuleParams(void *) {} void updateParams() {} };
struct Parameter { int value; int get() const { return value; } };
#define DEFINE_PARAMETERS(...) Parameter _param_mc_airmode;
""",
}
"""What PX4's build makes, as far as these files need it."""

KINDS = {"float32": "float", "bool": "bool"}


def motion(lanes: int, samples: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Random walks, the wanted values near limits and beyond; in this package's axes, rounded to f32."""
    random = np.random.default_rng(seed)
    walk = walks(random, lanes, samples)

    def turned(v: np.ndarray) -> np.ndarray:
        return np.stack(list(from_rotation_vector(Vector(np.moveaxis(v, 2, 0)))), axis=2)

    now, off = (turned(walk(3, size, 0.05)) for size in (2.0, 0.7))
    wanted = np.stack(list(multiply(Vector(np.moveaxis(now, 2, 0)), Vector(np.moveaxis(off, 2, 0)))), axis=2)
    place, speed = walk(3, 2.0, 0.02), walk(3, 1.0, 0.05)
    path = [place + walk(3, 1.0, 0.05), speed + walk(3, 2.0, 0.05), walk(3, 1.0, 0.1), walk(1, 3.0, 0.05)]
    flights = np.concatenate([place, speed, walk(3, 0.5, 0.1), *path], axis=2)
    shares = np.concatenate([walk(3, 0.4, 0.03), np.abs(walk(1, 0.9, 0.03))], axis=2)
    missed = random.integers(-1, 2, (lanes, samples, 3)) * (random.random((lanes, samples, 3)) < 0.3)
    spin = [walk(3, 2.0, 0.1), walk(3, 3.0, 0.1), walk(3, 10.0, 1.0), missed]
    given = {
        "attitude": np.concatenate([now, wanted, walk(1, 0.5, 0.02)], axis=2),
        "rates": np.concatenate(spin, axis=2),
        "gyro": walk(1, 2.0, 0.1),
        **dict.fromkeys(FLIGHTS, flights),
        **dict.fromkeys(MIXERS, shares),
    }
    return {name: np.ascontiguousarray(one, dtype=np.float32) for name, one in given.items()}


FLIGHTS, MIXERS = ("position", "coupled"), ("mixer", "airmode1", "airmode2")

SIGNS = {
    "attitude": (1, 1, -1, -1, 1, 1, -1, -1, -1),
    "rates": (1, -1, -1) * 4,
    "gyro": (1,),
    **dict.fromkeys(FLIGHTS, (*(1, -1, -1) * 6, -1)),
    **dict.fromkeys(MIXERS, (1, -1, -1, 1)),
}
"""From this package's axes to PX4's."""

BACK = {
    "attitude": (1, -1, -1),
    "rates": (1, -1, -1),
    "gyro": (1, 1),
    **dict.fromkeys(FLIGHTS, (1, -1, -1, 1, 1, -1, -1)),
    **dict.fromkeys(MIXERS, (1, 1, 1, 1, 1, -1, -1)),
}
"""And back, of what the loops give."""


def structure(tree: Path, message: str) -> str:
    """The C of a message."""
    fields = []
    for line in (tree / f"msg/{message}.msg").read_text(encoding="utf-8").splitlines():
        found = re.match(r"(\w+)(\[\d+\])? +(\w+)( *= *\S+)?", line)
        if found:
            kind, count, name, value = found.groups(default="")
            kind = KINDS.get(kind, f"{kind}_t")
            fields.append(f"static constexpr {kind} {name}{value};" if value else f"{kind} {name}{count};")
    name = re.sub(r"(?<!^)(?=[A-Z])", "_", message).lower()
    return f"#pragma once\n#include <stdint.h>\nstruct {name}_s {{\n" + "\n".join(fields) + "\n};\n"


def firmware(folder: Path, tree: Path, given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What PX4's own code makes of it."""
    topics = {re.sub(r"(?<!^)(?=[A-Z])", "_", one).lower(): structure(tree, one) for one in MESSAGES}
    for name, text in {**HEADERS, **{f"uORB/topics/{name}.h": text for name, text in topics.items()}}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "stock.cpp").write_text((STUBS / "px4/stock.cpp").read_text(encoding="utf-8"), encoding="utf-8")
    source = tree / "src"
    places = (
        folder, source, source / "lib", source / "lib/matrix", tree / "platforms/common/include",
        source / "modules/mc_att_control/AttitudeControl", source / "modules/mc_pos_control",
        source / "modules/control_allocator",
    )  # fmt: skip
    found = [f"-I{place}" for place in places]
    flags = ["-std=gnu++17", "-O1", "-ffp-contract=off", "-shared", "-fPIC", "-w"]
    library = folder / "stock.so"
    units = [str(source / one) for one in UNITS]
    run(["g++", *flags, *found, *units, str(folder / "stock.cpp"), "-lm", "-o", str(library)], folder)
    asked = {name: np.ascontiguousarray(given[name] * np.array(signs, np.float32)) for name, signs in SIGNS.items()}
    made = {name: one * np.array(BACK[name], np.float32) for name, one in answers(library, asked, LOOPS).items()}
    for name in FLIGHTS:  # of the two quaternions of an attitude that with w >= 0
        made[name][..., 3:] *= np.where(made[name][..., 3:4] < 0.0, -1.0, 1.0)
    return made


def split(given: np.ndarray, i: int, *at: int) -> list[Vector]:
    """Vectors of sample i, ending at these places."""
    return [Vector(one) for one in np.split(given[:, i].T, at)]


def ours(given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What our laws make of it: rates and mixer in f32, as PX4, the others in f64."""
    model = load_preset("x500").model()
    values = {
        "MC_ROLLRATE_FF": 0.01, "MC_YAWRATE_FF": 0.02, "MPC_Z_VEL_D_ACC": 0.1, "MPC_USE_HTE": 0.0,
        "IMU_GYRO_NF0_FRQ": 100.0,
    }  # fmt: skip
    gains = Px4Cascade.gains(model, values)
    by = px4_mixer(model)
    outputs = Matrix([row.map(np.float32) for row in by.outputs])
    made = {name: [] for name in LOOPS}
    wide = {name: one.astype(float) for name, one in given.items()}
    a = gains.attitude
    most = np.pi / 180.0 * Vector((a.roll_most, a.pitch_most, a.yaw_most))
    samples, integral, axis, begun = given["rates"].shape[1], Vector([np.float32(0.0)] * 3), STILL, 0.0
    climbing = {name: Vector([0.0] * 3) for name in FLIGHTS}
    filters = gyro_filters(gains.filters, 0.00125)
    for i in range(samples):
        now, wanted, turn = split(wide["attitude"], i, 4, 8)
        made["attitude"].append(attitude_loop(Vector((a.roll, a.pitch, a.yaw)), a.weight, most, wanted, now, turn[0]))
        rates, asked, slopes, missed = split(given["rates"], i, 3, 6, 9)
        torque, integral = rate_loop(rate_gains(gains.rates), integral, asked, rates, slopes, missed, 0.00125)
        made["rates"].append(torque)
        axis = of_gyro(filters, axis, wide["gyro"][:, i, 0], begun, 0.00125)
        made["gyro"].append((axis.rate, axis.acceleration))
        begun = 1.0
        for name, own in climbing.items():
            *motion, path, speed, change, yaw = split(wide[name], i, 3, 6, 9, 12, 15, 18)
            law = position_gains(gains)._replace(decoupled=float(name == "position"))
            reference = Reference(path, speed, change, yaw[0], 0.0)
            thrust, climbing[name] = position_loop(law, own, MotionNow(*motion), reference, 0.01)
            made[name].append((*thrust, *attitude_of(thrust, yaw[0])))
        for mode, name in enumerate(MIXERS):
            torque, thrust = split(given[name], i, 3)
            found = px4_mixed(outputs, torque, thrust[0], float(mode))
            made[name].append((*found, *(torque - by.torques @ found)))
    return {name: np.stack([np.stack(list(row), axis=1) for row in rows], axis=1) for name, rows in made.items()}
