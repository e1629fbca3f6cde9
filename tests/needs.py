"""Requirements of some tests that a machine may lack: whether they are met, and how to install them."""

import os
import shutil
import subprocess
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import pytest


class Need(NamedTuple):
    """what: as in "needs ...". cure: how to have it. spared: whether `--complete` (.ci/run) does without it."""

    what: str
    cure: str
    here: Callable[[], bool] = lambda: True
    spared: bool = False

    @property
    def reason(self) -> str:
        """What pytest says of a test skipped for this; tests/conftest.py reads it back."""
        return f"needs {self.what}"


def program(*names: str) -> str | None:
    """The first of these programs that is on the path."""
    return next((path for path in map(shutil.which, names) if path), None)


def said(*line: str) -> str:
    """What a program says."""
    return subprocess.run(line, capture_output=True, text=True, check=False).stdout


def has_graphics() -> bool:
    """Whether an NVIDIA graphics processor answers."""
    from quadstep.engines.cuda import Device, NoDeviceError

    try:
        Device()
    except NoDeviceError:
        return False
    return True


def has_assembler() -> bool:
    """Whether PTX can be assembled."""
    from benchmarks.gpu_assembler import ptxas

    return ptxas() is not None


CHROMIUM_PROGRAM = program("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

FIREFOX_PROGRAM = program("firefox-esr", "firefox")

DATA = Path(__file__).parent.parent.parent / "shared" / "data"
"""Flights of Crazyflies that are not ours to carry lie beside the checkout."""

CRAZYPAD, NANOBENCH = DATA / "crazypad", DATA / "nanobench"

CHROMIUM = Need("Chromium", "install it (Debian: chromium)", lambda: CHROMIUM_PROGRAM is not None)
FIREFOX = Need("Firefox", "install it (Debian: firefox-esr)", lambda: FIREFOX_PROGRAM is not None, spared=True)
NODE = Need("Node.js", "install version 20 or newer (Debian: nodejs)", lambda: program("node") is not None)
NPM = Need(
    "npm", "install Node.js 20 or newer with npm (Debian: nodejs npm)", lambda: bool(program("node") and program("npm"))
)
BUILD_TOOLS = Need("the front end's build tools", "run `npm ci` in frontend/, once, with a network")
QEMU = Need("qemu-aarch64", "install QEMU's user mode (Debian: qemu-user)", lambda: program("qemu-aarch64") is not None)
ARM_COMPILER = Need(
    "a C compiler for 64-bit ARM",
    "install one (Debian: gcc-aarch64-linux-gnu libc6-dev-arm64-cross)",
    lambda: program("aarch64-linux-gnu-gcc") is not None,
)
CXX_COMPILER = Need("a C++ compiler", "install one (Debian: g++)", lambda: program("g++") is not None)
C_COMPILER = Need("a C compiler", "install one (Debian: gcc)", lambda: program("gcc", "clang") is not None)
CORTEX_M = Need(
    "a C compiler for Cortex-M and its emulator",
    "install them (Debian: gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm)",
    lambda: bool(program("arm-none-eabi-gcc") and program("qemu-system-arm")),
)
CORTEX_M_12 = Need(
    "version 12.2 of the compiler for Cortex-M, whose sizes docs/export.md gives",
    "use Debian 12's gcc-arm-none-eabi",
    lambda: CORTEX_M.here() and " 12.2" in said("arm-none-eabi-gcc", "--version"),
    spared=True,
)
CMAKE = Need("CMake", "install it (Debian: cmake)", lambda: program("ctest") is not None)
CPPCHECK = Need("cppcheck", "install it (Debian: cppcheck)", lambda: program("cppcheck") is not None)
PTXAS = Need("ptxas", "`make test` installs it on Linux; elsewhere install NVIDIA's CUDA toolkit", has_assembler)
PACKAGES = Need("a package of requirements/dev.lock", "`make test` installs them all")
SITE = Need("Sphinx", "`make docs` installs it", lambda: all(map(find_spec, ("sphinx", "furo", "myst_parser"))))
BASH = Need("bash", "install it", lambda: program("bash") is not None)
ZSH = Need("zsh", "install it (Debian: zsh)", lambda: program("zsh") is not None)
FISH = Need("fish", "install it (Debian: fish)", lambda: program("fish") is not None)
APART = "`.venv/bin/pip install --no-deps --require-hashes -r requirements/apart.lock`"
TINYMPC = Need("tinympc", f"{APART} (it asks for an older SciPy, and does without)", lambda: find_spec("tinympc") is not None)
POLICY = Need("foundation-policy", f"{APART} (there is no wheel of it)", lambda: find_spec("foundation_policy") is not None)
PS = Need("ps", "install it (Debian: procps)", lambda: program("ps") is not None)
SUPERUSER = Need("the rights of root", "run as root", lambda: os.geteuid() == 0)
MOUNTS = Need("file systems of its own", "run as root where `mount` is allowed (containers may forbid it)")
GRAPHICS = Need("an NVIDIA graphics processor", "use a machine with one", has_graphics, spared=True)
NO_GRAPHICS = Need("a machine without a graphics processor", "use one, or hide it", lambda: not has_graphics(), spared=True)
PROCESSOR = Need("a processor with other instructions", "use a machine with one", spared=True)
RECORDINGS = Need(
    "the CrazyPAD recordings",
    "put them into ../shared/data/crazypad (examples/crazyflie_flight.toml says where they are from)",
    (CRAZYPAD / "normal_motor.csv").is_file,
    spared=True,
)
FLIGHTS = Need(
    "the NanoBench flights",
    "put them into ../shared/data/nanobench (docs/logs.md says whose they are)",
    (NANOBENCH / "B2_circle_fast_rep1.csv").is_file,
    spared=True,
)
CRAZYFLIE_TREE = Need(
    "a tree of the Crazyflie firmware",
    "name one: QUADSTEP_CRAZYFLIE=DIRECTORY (docs/firmware.md)",
    lambda: bool(os.environ.get("QUADSTEP_CRAZYFLIE")),
    spared=True,
)
PX4_TREE = Need(
    "a tree of PX4",
    "name one: QUADSTEP_PX4=DIRECTORY (docs/firmware.md)",
    lambda: bool(os.environ.get("QUADSTEP_PX4")),
    spared=True,
)

ARDUPILOT_TREE = Need(
    "a tree of ArduPilot",
    "name one: QUADSTEP_ARDUPILOT=DIRECTORY (docs/firmware.md)",
    lambda: bool(os.environ.get("QUADSTEP_ARDUPILOT")),
    spared=True,
)
COPTER = Path(os.environ.get("QUADSTEP_ARDUPILOT", ".")).resolve() / "build/sitl/bin/arducopter"
ARDUCOPTER = Need(
    "ArduPilot's simulator",
    "name a tree in which `./waf configure --board sitl` and `./waf copter` were run: QUADSTEP_ARDUPILOT=DIRECTORY",
    COPTER.is_file,
    spared=True,
)
BETAFLIGHT_TREE = Need(
    "a tree of Betaflight 4.5",
    "name one: QUADSTEP_BETAFLIGHT=DIRECTORY (docs/stock-checked.md)",
    (Path(os.environ.get("QUADSTEP_BETAFLIGHT", "none")) / "src/main").is_dir,
    spared=True,
)
NAMED = Path(os.environ.get("QUADSTEP_BETAFLIGHT", ".")).resolve()
BETAFLIGHT = NAMED if NAMED.is_file() else NAMED / "obj/main/betaflight_SITL.elf"
BETAFLIGHT_SITL = Need(
    "Betaflight's simulator and network namespaces",
    "name it, or a tree in which it was built (docs/autopilot.md): QUADSTEP_BETAFLIGHT=PATH",
    lambda: BETAFLIGHT.is_file() and bool(said("unshare", "-rn", "echo", "yes")),
    spared=True,
)

NEEDS = (
    CHROMIUM, FIREFOX, NODE, NPM, BUILD_TOOLS, QEMU, ARM_COMPILER, PTXAS, PACKAGES, TINYMPC, POLICY, SUPERUSER, MOUNTS,
    GRAPHICS, NO_GRAPHICS, PROCESSOR, RECORDINGS, FLIGHTS, C_COMPILER, CXX_COMPILER, CORTEX_M, CORTEX_M_12, CPPCHECK, CMAKE,
    PS, SITE, BASH, ZSH, FISH, CRAZYFLIE_TREE, PX4_TREE, ARDUPILOT_TREE, ARDUCOPTER, BETAFLIGHT_TREE,
    BETAFLIGHT_SITL,
)  # fmt: skip


def needs(*wanted: Need) -> pytest.MarkDecorator:
    """Marks a test, or as `pytestmark` a module, that is skipped where something that it needs is not here."""
    missing = next((need for need in wanted if not need.here()), None)
    return pytest.mark.skipif(missing is not None, reason=missing.reason if missing else "")


def without(need: Need, detail: str = "") -> None:
    """Skip the running test: it turned out that something is not here. Raises what pytest skips by."""
    pytest.skip(f"{need.reason}: {detail}" if detail else need.reason)


def package(name: str) -> ModuleType:
    """A package that is imported; the test or module is skipped where it is not installed."""
    return pytest.importorskip(name, reason=f"{PACKAGES.reason}: {name}")
