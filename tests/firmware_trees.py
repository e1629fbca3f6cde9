"""Trees of firmwares: where the real ones are, how an exported folder is built in one, and folders that look like them."""

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

STUBS = Path(__file__).parent / "firmware"

VARIABLES = {"crazyflie": "QUADSTEP_CRAZYFLIE", "px4": "QUADSTEP_PX4", "ardupilot": "QUADSTEP_ARDUPILOT"}
"""What names a checkout of each firmware, ready to be built."""

NEEDED = {
    "crazyflie": (("python3", "make", "gcc", "arm-none-eabi-gcc"), ()),
    "px4": (("python3", "make", "cmake", "ninja", "g++"), ("kconfiglib", "jinja2", "em")),
    "ardupilot": (("python3", "g++"), ("pexpect", "em", "future")),
}
"""Programs, and modules of the Python that is first on PATH, without which a firmware cannot be built."""

LONGEST = 3600.0
"""Seconds that building a firmware may take."""

DOCS = Path(__file__).parent.parent / "docs"


def missing(target: str) -> list[str]:
    """What a firmware's build would not find, and a CMake that is too new for PX4 of 2024."""
    programs, modules = NEEDED[target]
    lacking = [name for name in programs if not shutil.which(name)]
    for name in () if "python3" in lacking else modules:
        if run(["python3", "-c", f"import {name}"], DOCS).returncode:
            lacking.append(f"Python's {name}")
    if target == "px4" and "cmake" not in lacking and "CMAKE_POLICY_VERSION_MINIMUM" not in os.environ:
        found = re.search(r"(\d+)\.\S+", run(["cmake", "--version"], DOCS).stdout)
        if found and int(found[1]) > 3:
            lacking.append(f"a CMake below 4, or CMAKE_POLICY_VERSION_MINIMUM=3.5 for CMake {found[0]}")
    return lacking


ABSENT = re.compile(r"No rule to make target '([^']+)'|([^\s:]+): No such file or directory")


def lacking(said: str, firmware: Path) -> str:
    """The file of a submodule that a build did not find, and what fetches it; "" where it ended for another reason."""
    listed = firmware / ".gitmodules"
    places = re.findall(r"^\s*path = (\S+)", listed.read_text(encoding="utf-8"), re.M) if listed.is_file() else []
    for found in ABSENT.finditer(said):
        name = (found[1] or found[2]).removeprefix(f"{firmware}/")
        for place in places:
            if name.startswith(f"{place}/"):
                named = re.sub(r"\.o$", ".c", name)
                return f"not built: no {named} in the tree; `git submodule update --init --recursive {place}` fetches it"
    return ""


def documented(page: str, pattern: str) -> str:
    """A command as a page of docs/ gives it: what stands between backticks and matches a pattern."""
    found = re.search(rf"`({pattern})`", (DOCS / page).read_text(encoding="utf-8"))
    assert found, f"{page} should say {pattern}"
    return found[1]


OOT = """include $(PWD)/Kbuild
all: $(OOT_CONFIG) $(obj-y)
%.o: %.c
\tgcc -std=gnu11 -Wall -Wextra -Werror $(CFLAGS_$@) -I. -I$(CRAZYFLIE_BASE)/src/modules/interface -c $< -o $@
"""

PX4 = """MODULE = $(EXTERNAL_MODULES_LOCATION)/src/modules/quadstep_control
NAMES = grep -o '[A-Za-z_0-9]*\\.c[p]*$$' $(MODULE)/CMakeLists.txt
FLAGS = -Wall -Wextra -Werror -Wno-unused-const-variable -ffp-contract=off -fno-math-errno -Isrc/include -c -o /dev/null
px4_sitl_default:
\tgrep -q modules/quadstep_control $(EXTERNAL_MODULES_LOCATION)/src/CMakeLists.txt
\tfor one in $$($(NAMES)); do case $$one in \\
\t*.cpp) g++ -std=c++17 $(FLAGS) $(MODULE)/$$one ;; *) gcc $(FLAGS) $(MODULE)/$$one ;; esac || exit 1; done
"""

FRONT_END = {
    "AC_CustomControl_PID.h": "#pragma once\n",
    "AC_CustomControl.h": """#pragma once
#include "AC_CustomControl_Backend.h"
#ifndef CUSTOMCONTROL_MAX_TYPES
#define CUSTOMCONTROL_MAX_TYPES 2
#endif
struct Front : AC_CustomControl {
    enum class CustomControlType : uint8_t {
        CONT_NONE            = 0,
        CONT_PID             = 2,
    };
    uint8_t get_type() { return static_cast<uint8_t>(_type) - 1; }
    void init();
    CustomControlType _type;
    const AP_Param::GroupInfo *_backend_var_info[CUSTOMCONTROL_MAX_TYPES];
    AC_CustomControl_Backend *_backend;
    AP_AHRS_View *_ahrs; AC_AttitudeControl *_att_control; AP_MotorsMulticopter *_motors;
    float _dt;
};
""",
    "AC_CustomControl.cpp": """#include "AC_CustomControl.h"
#include "AC_CustomControl_PID.h"
#define NEW_NOTHROW new
#define AP_SUBGROUPVARPTR(element, prefix, index, owner, group) {prefix, index, 0, 0}
extern const AP_Param::GroupInfo table[];
const AP_Param::GroupInfo table[] = {
    AP_GROUPEND
};
void Front::init()
{
    switch (_type) {
        case CustomControlType::CONT_PID:
            break;
        default:
            return;
    }
}
""",
}
"""What the steps of docs/export-ardupilot.md change, in a folder that looks like ArduPilot's."""

WAF = """#!/bin/sh
test "$1" = copter || exit 0
for one in libraries/AC_CustomControl/*.cpp; do
    g++ -std=c++17 -Wall -Wextra -Werror -Ilibraries -c "$one" -o /dev/null || exit 1
done
for one in libraries/AC_CustomControl/*.c; do gcc -Wall -Wextra -Werror -c "$one" -o /dev/null || exit 1; done
"""


def tree(target: str, folder: Path) -> Path:
    """The tree that a variable names, or a folder arranged like one, with our headers and no more."""
    named = os.environ.get(VARIABLES[target])
    if named:
        return Path(named).resolve()
    made = folder / "tree"
    if target == "crazyflie":
        shutil.copytree(STUBS / target, made / "src/modules/interface")
        (made / "tools/make").mkdir(parents=True)
        (made / "tools/make/oot.mk").write_text(OOT, encoding="utf-8")
    elif target == "px4":
        shutil.copytree(STUBS / target, made / "src/include")
        (made / "Makefile").write_text(PX4, encoding="utf-8")
    else:
        shutil.copytree(STUBS / target, made / "libraries", ignore=shutil.ignore_patterns("*.cpp", "AC_*"))
        (made / "libraries/AC_CustomControl").mkdir()
        for place in ("AC_CustomControl", "AP_AHRS"):
            for name in ("Backend", "config"):
                shutil.copy(STUBS / target / f"AC_CustomControl_{name}.h", made / "libraries" / place)
        for name, text in FRONT_END.items():
            (made / "libraries/AC_CustomControl" / name).write_text(text, encoding="utf-8")
        (made / "waf").write_text(WAF, encoding="utf-8")
        (made / "waf").chmod(0o755)
    return made


def built(target: str, folder: Path, firmware: Path, more: Sequence[Path] = ()) -> subprocess.CompletedProcess[str]:
    """An exported folder built in a firmware's tree, by the commands of its page in docs/. more: other modules of PX4."""
    if target == "crazyflie":
        return run(["make", f"CRAZYFLIE_BASE={firmware}"], folder)
    if target == "px4":
        outside = folder.parent / "external"
        shutil.rmtree(outside, ignore_errors=True)
        shutil.copytree(folder, outside / "src/modules/quadstep_control")
        for one in more:
            shutil.copytree(one, outside / "src/modules" / one.name)
        names = " ".join(f"modules/{one}" for one in ("quadstep_control", *(one.name for one in more)))
        said = documented("export-px4.md", r"set\(config_module_list_external [^`]*\)")
        (outside / "src/CMakeLists.txt").write_text(said.replace("modules/quadstep_control", names), encoding="utf-8")
        return run(["make", "px4_sitl_default", f"EXTERNAL_MODULES_LOCATION={outside}"], firmware)
    place = firmware / "libraries/AC_CustomControl"
    ours = [path for path in folder.iterdir() if path.suffix in (".c", ".cpp", ".h") and not path.name.startswith("test_")]
    copies = [place / path.name for path in ours]
    entered = {place / f"AC_CustomControl.{end}": (place / f"AC_CustomControl.{end}").read_text() for end in ("h", "cpp")}
    for path in ours:
        shutil.copy(path, place)
    try:
        for path, text in entered.items():
            path.write_text(with_back_end(path.name, text))
        configured = run(["./waf", "configure", "--board", "sitl", "--no-submodule-update"], firmware)
        return configured if configured.returncode else run(["./waf", "copter"], firmware)
    finally:
        for path in copies:
            path.unlink()
        for path, text in entered.items():
            path.write_text(text)


def with_back_end(name: str, text: str) -> str:
    """A file of `AC_CustomControl` with what docs/export-ardupilot.md says to enter, for a tree without a third type."""
    page = (DOCS / "export-ardupilot.md").read_text(encoding="utf-8")
    case = re.search(r"^    (    )?case CustomControlType::CONT_QUADSTEP:\n(?:    .*\n)+", page, re.M)
    assert case
    changes = (
        (r"#define CUSTOMCONTROL_MAX_TYPES \d+", documented("export-ardupilot.md", r"#define CUSTOMCONTROL_MAX_TYPES \d+")),
        (r"(CONT_PID             = 2,)", r"\1 " + documented("export-ardupilot.md", r"CONT_QUADSTEP        = 3,")),
        (
            r'(#include "AC_CustomControl_PID.h")',
            r"\1\n" + documented("export-ardupilot.md", r'#include "AC_CustomControl_Quadstep.h"'),
        ),
        (r"(\n *AP_GROUPEND)", "\n" + documented("export-ardupilot.md", r"AP_SUBGROUPVARPTR\([^`]*\),") + r"\1"),
        (r"( *default:)", case[0] + r"\1"),
    )
    for old, new in changes[:2] if name.endswith(".h") else changes[2:]:
        text, count = re.subn(old, new, text, count=1)
        assert count == 1, f"{name} has no {old}"
    return text


def run(line: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """A command of a build."""
    flags = {**os.environ, "PWD": str(folder)}
    return subprocess.run(line, cwd=folder, env=flags, capture_output=True, text=True, check=False, timeout=LONGEST)
