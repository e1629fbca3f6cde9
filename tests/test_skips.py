"""Skipped tests are listed at the end of a run with the remedy; `--complete` fails for anything that could be installed."""

import subprocess
import sys

from tests.needs import CHROMIUM, CRAZYPAD, GRAPHICS, NEEDS, Need, needs

SEVERAL = """
import pytest
from tests.needs import CHROMIUM, GRAPHICS, without
def test_runs(): pass
@pytest.mark.parametrize("n", range(3))
def test_page(n): without(CHROMIUM)
@pytest.mark.skipif(True, reason=GRAPHICS.reason)
def test_device(): pass
"""
WHOLE_MODULE = "import pytest\npytest.importorskip('no_such_package')\ndef test_more(): pass\n"
SPARED = "from tests.needs import GRAPHICS, without\ndef test_runs(): pass\ndef test_device(): without(GRAPHICS, 'detail')\n"


def run(folder, texts, *options):
    """Exit code and lines of a run of pytest on files of its own."""
    for number, text in enumerate(texts):
        (folder / f"test_{number}.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.conftest", "-p", "no:cacheprovider", folder, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout.splitlines()


def test_what_was_skipped_is_counted_and_says_how_to_have_it_run(tmp_path):
    code, lines = run(tmp_path, [SEVERAL, WHOLE_MODULE])
    assert code == 0
    assert f"   3 tests  {CHROMIUM.reason}. To run: {CHROMIUM.cure}" in lines
    assert f"    1 test  {GRAPHICS.reason}. To run: {GRAPHICS.cure}" in lines
    assert any(line.startswith("    1 test  could not import 'no_such_package'") for line in lines)
    assert "To run 4 of them on Debian or Ubuntu: .ci/run, which installs what they need" in lines
    assert lines[-1].startswith("1 passed, 5 skipped in ")


def test_complete_fails_where_something_could_be_installed(tmp_path):
    code, lines = run(tmp_path, [SEVERAL, WHOLE_MODULE], "--complete", "-n", "2")
    assert code == 1
    assert "--complete: 4 skipped tests count as a failure" in lines
    assert lines[-1].startswith("1 passed, 5 skipped in ")


def test_complete_accepts_what_nobody_can_install(tmp_path):
    code, lines = run(tmp_path, [SPARED], "--complete")
    assert code == 0
    assert lines[-1].startswith("1 passed, 1 skipped in ")


def test_only_what_a_machine_may_well_lack_is_spared():
    assert {need.what for need in NEEDS if need.spared} == {
        "an NVIDIA graphics processor",
        "a machine without a graphics processor",
        "a processor with other instructions",
        "the NanoBench flights",
        "the CrazyPAD recordings",
        "a tree of the Crazyflie firmware",
        "a tree of PX4",
        "a tree of ArduPilot",
        "ArduPilot's simulator",
        "a tree of Betaflight 4.5",
        "Betaflight's simulator and network namespaces",
        "Firefox",
        "version 12.2 of the compiler for Cortex-M, whose sizes docs/export.md gives",
    }
    assert len({need.reason for need in NEEDS}) == len(NEEDS)


def test_a_test_is_skipped_for_the_first_thing_that_is_missing():
    here, absent, more = Need("a", ""), Need("b", "", lambda: False), Need("c", "", lambda: False)
    assert needs(here).args == (False,)
    assert needs(here, absent, more).mark.kwargs["reason"] == absent.reason
    assert needs(here, absent).args == (True,)


def test_shared_data_are_looked_for_beside_the_checkout():
    assert CRAZYPAD.parts[-3:] == ("shared", "data", "crazypad")
