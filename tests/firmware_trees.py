"""Trees of firmwares: where the real ones are, how an exported folder is built in one, and folders that look like them."""

import os
import re
import shutil
import subprocess
from pathlib import Path

STUBS = Path(__file__).parent / "firmware"

VARIABLES = {
    "crazyflie": "QUADSTEP_CRAZYFLIE_FIRMWARE",
    "px4": "QUADSTEP_PX4_AUTOPILOT",
    "ardupilot": "QUADSTEP_ARDUPILOT",
}
"""What names a checkout of each firmware, ready to be built."""

LONGEST = 3600.0
"""Seconds that building a firmware may take."""

DOCS = Path(__file__).parent.parent / "docs"


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

WAF = """#!/bin/sh
test "$1" = copter || exit 0
for one in libraries/AC_CustomControl/*.cpp; do
    g++ -std=c++17 $CFLAGS -Wall -Wextra -Werror -Ilibraries -c "$one" -o /dev/null || exit 1
done
for one in libraries/AC_CustomControl/*.c; do gcc $CFLAGS -Wall -Wextra -Werror -c "$one" -o /dev/null || exit 1; done
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
            shutil.copy(STUBS / target / "AC_CustomControl_Backend.h", made / "libraries" / place)
        (made / "waf").write_text(WAF, encoding="utf-8")
        (made / "waf").chmod(0o755)
    return made


def built(target: str, folder: Path, firmware: Path) -> subprocess.CompletedProcess[str]:
    """An exported folder built in a firmware's tree, by the commands of its page in docs/."""
    if target == "crazyflie":
        return run(["make", f"CRAZYFLIE_BASE={firmware}"], folder)
    if target == "px4":
        outside = folder.parent / "external"
        shutil.copytree(folder, outside / "src/modules/quadstep_control")
        (outside / "src/CMakeLists.txt").write_text(
            documented("export-px4.md", r"set\(config_module_list_external [^`]*\)"), encoding="utf-8"
        )
        return run(["make", "px4_sitl_default", f"EXTERNAL_MODULES_LOCATION={outside}"], firmware)
    place = firmware / "libraries/AC_CustomControl"
    ours = [path for path in folder.iterdir() if path.suffix in (".c", ".cpp", ".h") and not path.name.startswith("test_")]
    copies = [place / path.name for path in ours]
    for path in ours:
        shutil.copy(path, place)
    try:
        run(["./waf", "configure", "--board", "sitl"], firmware)
        return run(["./waf", "copter"], firmware)
    finally:
        for path in copies:
            path.unlink()


def run(line: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """A command of a build."""
    flags = {**os.environ, "CFLAGS": "-ffp-contract=off", "PWD": str(folder)}
    return subprocess.run(line, cwd=folder, env=flags, capture_output=True, text=True, check=False, timeout=LONGEST)
