"""The folder of `--target c99`: header, source, parameters, a test with golden vectors, a build file, a data sheet."""

from quadstep.c99.compiler import BITS, WARNINGS
from quadstep.c99.golden import golden, golden_header, test_source
from quadstep.c99.source import Exported, header, parameters, source
from quadstep.flight.engines import FlightPlan

CMAKE = """# {label}: builds the law as a static library, and its test.
#     cmake -B build && cmake --build build && ctest --test-dir build
cmake_minimum_required(VERSION 3.13)
project({name} C)

add_library({name} STATIC {name}.c {name}_params.c)
target_include_directories({name} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})
set_target_properties({name} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF)
# each operation rounded by itself: the bits of the flight that was judged
target_compile_options({name} PRIVATE {bits} {warnings})
find_library(LIBM m)
if(LIBM)
    target_link_libraries({name} PUBLIC ${{LIBM}})
endif()

if(CMAKE_SOURCE_DIR STREQUAL CMAKE_CURRENT_SOURCE_DIR)
    enable_testing()
    add_executable(test_{name} test_{name}.c)
    target_link_libraries(test_{name} PRIVATE {name})
    add_test(NAME {name} COMMAND test_{name})
endif()
"""


def c99_files(exported: Exported, plan: FlightPlan) -> dict[str, str]:
    """Name and text of every file but the data sheet. Raises UserError for a number that does not fit f32."""
    name = exported.name
    vectors = golden(exported, lambda t: plan.loop.path.reference(t, plan.parameters.path))
    cmake = CMAKE.format(
        label=exported.subject.controller.label or name, name=name, bits=" ".join(BITS), warnings=" ".join(WARNINGS)
    )
    return {
        f"{name}.h": header(exported),
        f"{name}.c": source(exported),
        f"{name}_params.c": parameters(exported),
        f"{name}_golden.h": golden_header(exported, vectors),
        f"test_{name}.c": test_source(exported),
        "CMakeLists.txt": cmake,
    }
