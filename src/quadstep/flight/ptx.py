"""The same laws for NVIDIA's graphics processors: PTX, their assembly language, written by LLVM without anything of CUDA."""

from functools import lru_cache

from llvmlite import binding as llvm

from quadstep.errors import UserError
from quadstep.flight import kernel
from quadstep.flight.gpu_driver import NoDeviceError
from quadstep.flight.loop import Numbers
from quadstep.flight.scored import Scored
from quadstep.flight.sweep_trace import Generate, SweepTrace
from quadstep.numbers.lane_opaque import SYMBOL

TRIPLE = "nvptx64-nvidia-cuda"
NEWEST = 90
"""PTX of this architecture (times ten) runs on it and all later ones."""

OLDEST = 70
FEATURES = "+ptx78"

OPTIONS = ("-nvptx-prec-divf32=2", "-nvptx-prec-sqrtf32=1")
"""Quotients and roots rounded as IEEE 754 has it, in f32 too: the same bits as on the lanes of any processor."""

SCHEDULER = "-pre-RA-sched=default"
"""As this machine's own code has another, and the option is LLVM's for all it writes; here it would cost registers."""


@lru_cache(maxsize=1)
def prepare() -> llvm.Target:
    """LLVM ready to write PTX. ValueError where it was built without."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    try:
        target = llvm.Target.from_triple(TRIPLE)
    except RuntimeError as error:
        raise ValueError("this LLVM cannot write PTX") from error
    for option in OPTIONS:
        llvm.set_option("", option)
    return target


def ptx(
    loop: Scored,
    start: tuple[object, ...],
    parameters: Numbers,
    varying: frozenset[int],
    double: bool = False,
    architecture: int = NEWEST,
    generate: Generate | None = None,
) -> str:
    """PTX of a kernel `sweep`, see `SweepTrace`. architecture: compute capability times ten, 90 for 9.0."""
    if architecture < OLDEST:
        raise NoDeviceError(f"compute capability {architecture / 10}: {OLDEST / 10} or later is needed")
    return assembly(program(loop, start, parameters, varying, double, generate), architecture)


def program(
    loop: Scored,
    start: tuple[object, ...],
    parameters: Numbers,
    varying: frozenset[int],
    double: bool = False,
    generate: Generate | None = None,
) -> str:
    """The kernel as LLVM writes it down, not yet optimised."""
    trace = SweepTrace(loop, start, parameters, varying, double, 1, gpu=True, generate=generate)
    if SYMBOL in trace.module.globals:
        raise UserError("a controller that calls Python cannot fly on a graphics processor")
    trace.function.calling_convention = "ptx_kernel"
    trace.module.triple = TRIPLE
    return str(trace.module)


def assembly(text: str, architecture: int = NEWEST) -> str:
    """PTX of a program, optimised."""
    machine = prepare().create_target_machine(cpu=f"sm_{min(architecture, NEWEST)}", features=FEATURES, opt=3)
    module = llvm.parse_assembly(text)
    module.verify()
    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    tuning.loop_unrolling = tuning.slp_vectorization = tuning.loop_vectorization = False
    passes = llvm.create_pass_builder(machine, tuning)
    passes.getModulePassManager().run(module, passes)
    llvm.set_option("", SCHEDULER)
    try:
        written: str = machine.emit_assembly(module)
    finally:
        kernel.host.cache_clear()  # it sets its own again
    return written
