"""`python -m benchmarks.instructions`: vector instructions of compiled loops, which a busy machine cannot distort.

Of the whole object file, as `objdump` reads it: the loop, what is done once before it, and functions that it calls.
"""

import re
import subprocess
import tempfile
from pathlib import Path

from llvmlite import binding as llvm

from benchmarks.airframes import FULL, plans
from benchmarks.many_flights import VARYING, plan
from quadstep.engines.kernel import host, host_width, object_code
from quadstep.engines.scored import scored
from quadstep.engines.sweep import places
from quadstep.engines.sweep_trace import SweepTrace

KEYS = tuple(f"parameters.key.words.{i}" for i in range(4))
LOOPS = {
    "the paper's loop": (plan(), 0.02, VARYING),
    "a real vehicle, full controller": (plans(FULL, 1)[0], 1.0, KEYS),
}
"""A flight, the time between two looks at its score [s], and what varies."""


def vector_instructions(name: str, double: bool) -> int:
    """For the processor of this machine, or the one that $QUADSTEP_CPU names."""
    one, every, varying = LOOPS[name]
    cpu, features, _ = host()
    target = llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=3, jit=True)
    loop, _ = scored(one.loop, one.ticks, every)
    given = frozenset(places(one.start, one.parameters, varying))
    trace = SweepTrace(loop, one.start, one.parameters, given, double, host_width(double))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "loop.o"
        path.write_bytes(object_code(str(trace.module), target))
        text = subprocess.run(["objdump", "-d", "--no-show-raw-insn", path], capture_output=True, text=True, check=True).stdout
    return len(re.findall(r"^\s+[0-9a-f]+:\s+v", text, re.MULTILINE))


if __name__ == "__main__":
    for loop_name in LOOPS:
        single, precise = (vector_instructions(loop_name, double) for double in (False, True))
        print(f"{loop_name}: {single} in f32, {precise} in f64 ({host().name})")
