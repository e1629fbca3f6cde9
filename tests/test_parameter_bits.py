"""The numbers that flights are set up with have the same bits whatever the processor has NumPy and BLAS do."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from quadstep.studies.campaign import draws
from tests.needs import PROCESSOR, without

try:
    from numpy._core._multiarray_umath import __cpu_dispatch__ as dispatched
    from numpy._core._multiarray_umath import __cpu_features__ as features
except ImportError:  # NumPy 1
    from numpy.core._multiarray_umath import __cpu_dispatch__ as dispatched
    from numpy.core._multiarray_umath import __cpu_features__ as features

NEWER = {name for name in dispatched if features[name]}
"""Instructions that NumPy uses here beside those that it was compiled for."""

WIDE = {name for name in NEWER if name.startswith("AVX512") or name == "X86_V4"}

MACHINES = {
    "no AVX": ("Nehalem", NEWER, "SSE42"),
    "AVX2": ("Haswell", WIDE, "AVX2"),
    "AVX-512": ("SkylakeX", set(), "AVX512F"),
}
"""The kernel of OpenBLAS, what NumPy leaves alone, and what the processor must have."""

BLAS = np.__config__.show(mode="dicts")["Build Dependencies"]["blas"]["name"]

TEETH = {"BLAS": BLAS == "scipy-openblas", "NumPy's exp": bool(WIDE)}
"""What is not to be equal, or nothing would have been tried: BLAS itself, and NumPy's exponential where it has AVX-512."""


DRAWN = {2: "1126a3cb7223bb40e1fd757a1e4e8c95428485abc86bd9408b83df33a2c80f14"}
"""What a campaign with every distribution draws, by the version of the draws."""


def of_machine(name, every):
    """Every digest on a machine like this one."""
    kernel, left_alone, _ = MACHINES[name]
    unused = " ".join(sorted(left_alone))
    environment = {**os.environ, "OPENBLAS_CORETYPE": kernel, "NPY_DISABLE_CPU_FEATURES": unused}
    command = [sys.executable, Path(__file__).parent / "parameter_bits.py", *["every"] * every]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_the_numbers_of_every_flight_are_the_same_to_the_bit_whatever_the_processor(every):
    """An ordinary run tries the oldest instructions and the newest ones, with every law and every preset but not each pair."""
    names = [name for name, (*_, needed) in MACHINES.items() if features.get(needed)]
    if len(names) < 2:
        without(PROCESSOR, "only one of the kernels of OpenBLAS runs on this one")
    names = names if every else [names[0], names[-1]]
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(names, pool.map(of_machine, names, [every] * len(names)), strict=True))
    first = found[names[0]]
    assert len(first) > 70
    assert first["draws of every distribution"] == DRAWN[draws.VERSION], "other draws need another version"
    for name in names[1:]:
        different = {one for one in first if found[name][one] != first[one]}
        assert not different - TEETH.keys(), f"{name}: {sorted(different)}"
    for one, bites in TEETH.items():
        assert not bites or len({digests[one] for digests in found.values()}) > 1, one
