"""`make bench`: speed, memory and size, each beside a yardstick run in the same session, accuracy beside speed."""

import subprocess
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.airframes import calm_vehicle, estimated_vehicle, full_vehicle, opaque_controller
from benchmarks.campaigns import cost, double_precision, ready, single_precision
from benchmarks.flights import case_1_flight, compilation, throughput
from benchmarks.gpu import gpu
from benchmarks.million import million_flights
from benchmarks.page import case_1_page, gusts_page, paper_page
from benchmarks.peers import crazyflow, rotorpy
from benchmarks.processes import import_time, installed_size, one_mission, one_question, reproduction
from benchmarks.vehicles import noisy_in_double, noisy_in_single, quiet_in_double, quiet_in_single

Row = tuple[str, str, str, str, str]

MEASURES = (
    import_time, one_mission, one_question, compilation, case_1_flight, throughput, full_vehicle, calm_vehicle,
    estimated_vehicle, opaque_controller, single_precision, double_precision, noisy_in_single, noisy_in_double,
    quiet_in_single, quiet_in_double, ready, cost, million_flights, case_1_page, paper_page, gusts_page, gpu, crazyflow,
    rotorpy, reproduction, installed_size,
)  # fmt: skip


def main() -> None:
    """Measure and print; nothing here fails a build."""
    processor = next((line.partition(":")[2].strip() for line in cpu_lines() if line.startswith("model name")), "unknown")
    columns = ("what", "measured", "target", "yardstick, same session", "accuracy")
    table = Table(*columns, title=f"quadstep on {processor}", show_lines=True)
    with tempfile.TemporaryDirectory() as folder:
        for measure in MEASURES:
            table.add_row(*measure(Path(folder)))
    Console(width=150, highlight=False).print(table)


def cpu_lines() -> list[str]:
    """What the system says of its processor."""
    path = Path("/proc/cpuinfo")
    if path.exists():
        return path.read_text().splitlines()
    answer = subprocess.run(["sysctl", "-n", "machdep.cpu.brand_string"], capture_output=True, text=True, check=False)
    return [f"model name: {answer.stdout}"] if answer.stdout else []


if __name__ == "__main__":
    main()
