"""The folder of `--target c99`: header, source, parameters, a test with golden vectors, a build file, a data sheet."""

from pathlib import Path

from quadstep.engines.fly import FlightPlan
from quadstep.export.c.compiler import BITS, WARNINGS
from quadstep.export.c.golden import golden, golden_header, test_source
from quadstep.export.c.interface import Exported, header, title
from quadstep.export.c.source import parameters, source
from quadstep.export.c.templates import filled

TEMPLATES = Path(__file__).parent / "templates"


def c99_files(exported: Exported, plan: FlightPlan) -> dict[str, str]:
    """Name and text of every file but the data sheet. Raises UserError for a number that does not fit f32."""
    name = exported.name
    vectors = golden(exported, lambda t: plan.loop.wanted(t, plan.parameters))
    words = {
        "LABEL": title(exported),
        "LAW": name,
        "test_LAW": f"test_{name}",
        "BITS": " ".join(BITS),
        "WARNINGS": " ".join(WARNINGS),
    }
    return {
        f"{name}.h": header(exported),
        f"{name}.c": source(exported),
        f"{name}_params.c": parameters(exported),
        f"{name}_golden.h": golden_header(exported, vectors),
        f"test_{name}.c": test_source(exported),
        "CMakeLists.txt": filled(TEMPLATES / "CMakeLists.txt", words),
    }


def as_they_are(_: Exported, files: dict[str, str]) -> dict[str, str]:
    """The files of C99 itself."""
    return files
