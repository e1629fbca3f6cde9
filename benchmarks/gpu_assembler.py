"""NVIDIA's assembler, where it is installed: it compiles PTX without a graphics processor at hand."""

import importlib.util
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple


class Assembled(NamedTuple):
    """Of a kernel. registers: of a thread. stack, stores, loads: bytes of its local memory, written and read by spills."""

    registers: int
    stack: int
    stores: int
    loads: int


def ptxas() -> str | None:
    """The assembler from the path or from the wheel nvidia-cuda-nvcc, if there is one."""
    found = shutil.which("ptxas")
    package = importlib.util.find_spec("nvidia")
    for folder in package.submodule_search_locations or () if package else ():
        found = found or next((str(path) for path in Path(folder).glob("**/bin/ptxas*")), None)
    return found


def assembled(text: str, architecture: int, registers: int | None = None) -> Assembled:
    """What the assembler says of PTX with one kernel, held to so many registers. RuntimeError where it refuses."""
    tool = ptxas()
    if tool is None:
        raise RuntimeError("no ptxas: neither on the path nor from the wheel nvidia-cuda-nvcc")
    limit = [f"-maxrregcount={registers}"] if registers else []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "kernel.ptx")
        source.write_text(text)
        command = [tool, "-v", f"-arch=sm_{architecture}", *limit, str(source), "-o", str(source.with_suffix(".cubin"))]
        answer = subprocess.run(command, capture_output=True, text=True, check=False)
    if answer.returncode:
        raise RuntimeError(f"ptxas: {answer.stderr.strip()}")
    numbers = [
        re.search(pattern, answer.stderr)
        for pattern in (r"Used (\d+) registers", r"(\d+) bytes stack", r"(\d+) bytes spill st", r"(\d+) bytes spill lo")
    ]
    return Assembled(*(int(number.group(1)) if number else 0 for number in numbers))
