"""What `quadstep --version` says."""

import platform


def version_lines() -> list[str]:
    """Version; engine, processor and what code is written for; Python and what computes. Raises UserError."""
    import llvmlite
    import numpy as np

    from quadstep.engines.kernel import host
    from quadstep.io.version import __version__

    processor = host()
    llvm = ".".join(map(str, llvmlite.binding.llvm_version_info))
    return [
        f"quadstep {__version__}",
        f"engine lanes: LLVM {llvm}, {processor.doubles} numbers in f64 at once, for {processor.name}",
        f"Python {platform.python_version()}, NumPy {np.__version__}, {platform.system()} on {platform.machine()}",
    ]
