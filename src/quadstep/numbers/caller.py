"""The line of a law that is being evaluated, for errors about numbers."""

import sys
from pathlib import Path

HERE = str(Path(__file__).parent)


def place() -> str:
    """File and line of the code that uses a number now."""
    frame = sys._getframe(1)
    while frame.f_back and frame.f_code.co_filename.startswith(HERE):
        frame = frame.f_back
    return f"{Path(frame.f_code.co_filename).name}, line {frame.f_lineno}"
