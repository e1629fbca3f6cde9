"""The same flight gives the same bits on every processor that LLVM can write for, optimised or not, with NumPy and BLAS of
another kind, and on ARM; so do functions on floats, arrays and in JavaScript. Whole flights of these are compared beside each
engine.
"""

import importlib
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from quadstep.engines import kernel
from quadstep.engines.sweep import Sweep
from quadstep.io.errors import UserError
from quadstep.numbers import atan2, exp, sqrt, where
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import read_campaign
from tests.bits.arm import swept_on_arm
from tests.bits.flights import CAMPAIGNS, SPECIAL, functions, inputs, same
from tests.campaigns import written
from tests.flights import through_lanes
from tests.needs import ARM_COMPILER, PROCESSOR, QEMU, needs, without
from tests.pages import needs_node
from tests.scripts import through_script


def numpy_features():
    """What NumPy chooses its loops by, of this processor."""
    core = importlib.import_module("numpy._core._multiarray_umath")
    return [name for name in core.__cpu_dispatch__ if core.__cpu_features__[name]]


OTHER_NUMPY = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_features())}
MACHINES = {cpu: {"QUADSTEP_CPU": cpu} for cpu in kernel.WIDTHS} | {
    "other NumPy and BLAS": OTHER_NUMPY,
    "nehalem with other NumPy and BLAS": {"QUADSTEP_CPU": "nehalem", **OTHER_NUMPY},
    "skylake-avx512, not optimised": {"QUADSTEP_CPU": "skylake-avx512", "QUADSTEP_OPTIMISE": "0"},
}
USUAL = ("nehalem with other NumPy and BLAS", "skylake-avx512, not optimised")
"""In an ordinary run: the narrowest vectors with none of the newer instructions; and the widest with all of them, as most
tests compile their code.
"""

X86 = kernel.host().features.find("+sse2") >= 0


@pytest.fixture(scope="module")
def digests(tmp_path_factory):
    """What `tests.bits.flights` prints in a process with these variables set; None where an instruction kills it."""
    cache = str(tmp_path_factory.mktemp("cache"))

    def run(*turn, **variables):
        command = [sys.executable, "-m", "tests.bits.flights", *turn]
        answer = subprocess.run(
            command,
            env={**os.environ, "QUADSTEP_OPTIMISE": "1", "QUADSTEP_CACHE": cache, **variables},
            capture_output=True,
            text=True,
            check=False,
        )
        if answer.returncode == -signal.SIGILL:
            return None
        assert not answer.returncode, answer.stderr
        return json.loads(answer.stdout)

    return run


@pytest.fixture(scope="module")
def native(digests):
    return digests()


@pytest.mark.parametrize(
    ("machine", "turn"),
    [
        pytest.param(name, turn, marks=() if (name, turn) in zip(USUAL, "01", strict=True) else pytest.mark.thorough)
        for name in MACHINES
        for turn in "01"
    ],
)
def test_flights_campaigns_and_functions_are_the_same_bytes_on_another_processor(machine, turn, digests, native):
    if "QUADSTEP_CPU" in MACHINES[machine] and not X86:
        without(PROCESSOR, f"this one is no x86-64, so none of {machine} is run")
    other = digests(turn, **MACHINES[machine])
    if other is None:
        without(PROCESSOR, machine)
    assert (len(native), len(other)) == (10, 7)
    assert other.items() <= native.items()


def test_what_is_not_known_of_a_processor_or_its_code_is_refused_in_one_line(monkeypatch):
    monkeypatch.setenv("QUADSTEP_CPU", "pentium")
    kernel.host.cache_clear()
    with pytest.raises(UserError, match=r"QUADSTEP_CPU: unknown processor 'pentium'; allowed: "):
        kernel.host()
    monkeypatch.delenv("QUADSTEP_CPU")
    kernel.host()
    monkeypatch.setenv("QUADSTEP_OPTIMISE", "yes")
    with pytest.raises(UserError, match=r"QUADSTEP_OPTIMISE: unknown value 'yes'; allowed: 0, 1"):
        kernel.optimised()


@needs(QEMU, ARM_COMPILER)
@pytest.mark.parametrize(
    ("name", "precision"),
    [
        pytest.param(name, precision, marks=pytest.mark.thorough if place and precision == "f32" else ())
        for place, name in enumerate(CAMPAIGNS)
        for precision in ("f64", "f32")
    ],
)
def test_arm_flies_what_this_machine_flies(name, precision, tmp_path):
    mission, vary = CAMPAIGNS[name]
    flown = []

    class Both(Sweep):
        def __init__(self, loop, ticks, start, parameters, varying, double):
            super().__init__(loop, ticks, start, parameters, varying, double)
            self.given = start, parameters

        def fly(self, values, **_):
            swept = super().fly(values)
            flown.append((swept, swept_on_arm(self, *self.given, values, tmp_path)))
            return swept

    campaign = read_campaign(written(tmp_path / "campaign", vary, mission, f'precision = "{precision}"'))
    Flyer(campaign, Both).fly(0, 24)
    assert flown
    for here, there in flown:
        assert (here.outcome == there.outcome).all()
        assert (here.ended == there.ended).all()
        assert here.metrics.tobytes() == there.metrics.tobytes()


@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_functions_are_the_same_bits_in_lanes_of_every_width(double):
    x = inputs(2000, double)
    y = x[::-1].copy()
    one, *others = (same(through_lanes(functions, x, y, double=double, width=width)) for width in (1, 2, 4, 8, 16))
    assert others == [one] * 4


def test_functions_are_the_same_bits_on_floats_arrays_and_lanes():
    x = inputs(20_000)
    y = x[::-1].copy()
    with np.errstate(all="ignore"):
        arrays = same(functions(x, y))
    assert same(through_lanes(functions, x, y)) == arrays
    assert same(np.array([functions(*pair) for pair in zip(x.tolist(), y.tolist(), strict=True)]).T) == arrays


def folding(x, y):
    """Zeros and ones wherever they fold while a law is traced."""
    return [
        x * 0, 0.0 * x + y, x + 0, 0.0 + x, x - 0.0, 0 - x, x * 1, 1.0 * x, -1 * x, x / 1, 0.0 / x + y, (x * 0.0) * y + x,
        where(x * 0.0 > y, x, y), atan2(x * 0.0, y), atan2(y, 0.0 * x), sqrt(0.0 * x) + exp(0.0 * y), abs(x * 0.0 - y),
    ]  # fmt: skip


@needs_node
def test_folding_changes_no_finite_result():
    x = inputs(800)
    x = x[np.isfinite(x) & (x != 0.0)]
    y = x[::-1].copy()
    with np.errstate(all="ignore"):
        floats = np.array([np.broadcast_to(one, x.shape) for one in folding(x, y)])
    finite = np.isfinite(floats)
    assert finite.mean() > 0.9
    script = np.hstack(
        [through_script(folding, *np.ascontiguousarray(part)) for part in np.array_split(np.array([x, y]), 4, axis=1)]
    )
    for traced in (through_lanes(folding, x, y), script):
        assert (traced[finite] == floats[finite]).all()


@needs_node
def test_functions_are_the_same_bits_in_javascript():
    x = inputs(1200)
    y = np.concatenate([np.roll(x, 1), np.repeat(SPECIAL, len(SPECIAL))])
    x = np.concatenate([x, np.tile(SPECIAL, len(SPECIAL))])
    for part in np.array_split(np.array([x, y]), 4, axis=1):  # a command line has its limits
        with np.errstate(all="ignore"):
            assert same(through_script(functions, *part)) == same(functions(*np.ascontiguousarray(part)))
