"""Whole processes: import, the study, and the size of an installation."""

import json
import os
import re
import subprocess
import sys
import threading
import time
from importlib import metadata
from pathlib import Path
from unittest import mock


def run(*arguments: str) -> float:
    """Seconds of a Python process."""
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    return time.perf_counter() - start


def import_time(_: Path) -> tuple[str, str, str, str, str]:
    """Importing the package, and everything that a flight needs, beyond a bare interpreter."""
    bare = min(run("-c", "") for _ in range(5))
    package = min(run("-c", "import quadstep") for _ in range(5)) - bare
    flight = min(run("-c", "from quadstep import fly, Mission; import quadstep.engines.kernel") for _ in range(5)) - bare
    numpy = min(run("-c", "import numpy") for _ in range(5)) - bare
    return (
        "import quadstep",
        f"{package:.3f} s; with all that a flight needs {flight:.2f} s",
        "< 0.3 s",
        f"import numpy {numpy:.2f} s ({flight / numpy:.1f} times less)",
        "-",
    )


def tree_memory(root: int) -> int:
    """Proportional memory of a process and its children [bytes], where the system tells (Linux)."""
    parents: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    total, waiting = 0, [root]
    while waiting:
        process = waiting.pop()
        waiting += parents.get(process, [])
        try:
            rollup = Path(f"/proc/{process}/smaps_rollup").read_text()
        except OSError:
            continue
        total += 1024 * int(re.search(r"^Pss:\s+(\d+)", rollup, re.M).group(1))  # type: ignore[union-attr]
    return total


def one_mission(folder: Path) -> tuple[str, str, str, str, str]:
    """`quadstep fly` of Case 1 as a user waits for it: figures, tables and page included, compiled before or not."""
    results, cache = folder / "flown", folder / "cache"
    command = ("-m", "quadstep", "fly", "examples/case1.toml", "--out", str(results))
    with mock.patch.dict(os.environ, QUADSTEP_CACHE=str(cache)):
        cold = run(*command)
        warm = min(run(*command) for _ in range(5))
    yardstick = min(run("-c", "import numpy, matplotlib.pyplot") for _ in range(5))
    largest = max(axis["largest[m]"] for axis in json.loads((results / "metrics.json").read_text())["position"].values())
    return (
        "quadstep fly, Case 1",
        f"{warm:.2f} s in all; {cold:.2f} s the first time, with compiling",
        "< 2 s",
        f"import numpy, matplotlib.pyplot {yardstick:.2f} s ({warm / yardstick:.1f} times less)",
        f"largest error {1e6 * largest:.0f} um",
    )


def one_question(folder: Path) -> tuple[str, str, str, str, str]:
    """`quadstep what-if` as a user waits for it: 1,000 gusty flights before and after, margins, a figure; asked at first, and
    with other values, when the flights and the grade before are kept. What 1,000 flights take is the difference to two.
    """
    results, cache = folder / "asked", folder / "cache"
    command = ("-m", "quadstep", "what-if", "px4-cascade", "--vehicle", "x500", "--overwrite", "--out", str(results))
    with mock.patch.dict(os.environ, QUADSTEP_CACHE=str(cache)):
        cold = run(*command, "MC_ROLLRATE_P=0.1")
        few, warm = (
            min(run(*command, "--flights", count, f"MC_ROLLRATE_P=0.2{place}") for place in range(1, 6))
            for count in ("2", "1000")
        )
    yardstick = min(run("-c", "import numpy, matplotlib.pyplot") for _ in range(5))
    failed = json.loads((results / "metrics.json").read_text())["failed"]["difference"]
    return (
        "quadstep what-if, 1,000 gusty flights of a change",
        f"{warm - few:.2f} s for the flights, {warm:.2f} s in all; {cold:.2f} s the first time, with compiling",
        "< 1 s for the flights",
        f"import numpy, matplotlib.pyplot {yardstick:.2f} s ({warm / yardstick:.1f} times less)",
        f"failures differ by {100 * failed['low']:+.2g} to {100 * failed['high']:+.2g} points",
    )


def reproduction(folder: Path) -> tuple[str, str, str, str, str]:
    """`quadstep reproduce` as a whole: time, memory of all its processes, and Case 1's largest error."""
    out = folder / "paper"
    start, peak = time.perf_counter(), 0
    process = subprocess.Popen([sys.executable, "-m", "quadstep", "reproduce", "--out", str(out)], stdout=subprocess.DEVNULL)
    done = threading.Event()

    def watch() -> None:
        nonlocal peak
        while not done.wait(0.05):
            peak = max(peak, tree_memory(process.pid))

    watcher = threading.Thread(target=watch)
    watcher.start()
    process.wait()
    took = time.perf_counter() - start
    done.set()
    watcher.join()
    matplotlib = run("-c", "import matplotlib.figure, matplotlib.backends.backend_agg")
    case = json.loads((out / "metrics.json").read_text())["cases"]["case1"]["position"]
    largest = max(axis["largest[m]"] for axis in case.values())
    return (
        "quadstep reproduce",
        f"{took:.1f} s, {peak / 1e6:.0f} MB in all processes",
        "< 10 s, < 500 MB",
        f"import matplotlib alone {matplotlib:.2f} s ({took / matplotlib:.1f} times less)",
        f"Case 1: largest error {1e6 * largest:.0f} um",
    )


def installed_size(_: Path) -> tuple[str, str, str, str, str]:
    """Files of the package and everything it requires."""
    sizes: dict[str, int] = {}
    waiting = ["quadstep"]
    while waiting:
        name = waiting.pop()
        if name in sizes:
            continue
        try:
            distribution = metadata.distribution(name)
        except metadata.PackageNotFoundError:  # a requirement of another platform
            continue
        files = [Path(str(file.locate())) for file in distribution.files or []]
        sizes[name] = sum(path.stat().st_size for path in files if path.exists())
        for requirement in distribution.requires or []:
            if "extra ==" not in requirement:
                waiting.append(re.split(r"[ ;<>=!~\[(]", requirement, maxsplit=1)[0])
    largest = max(sizes, key=lambda name: sizes[name])
    total = sum(sizes.values())
    return (
        "installed core",
        f"{total / 1e6:.0f} MB in {len(sizes)} packages",
        "< 450 MB",
        f"{largest} alone {sizes[largest] / 1e6:.0f} MB ({total / sizes[largest]:.1f} times less)",
        "-",
    )
