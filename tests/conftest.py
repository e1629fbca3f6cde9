"""Fixtures of many files; and what was skipped, why, and how to have it run, as a table at the end of a run."""

import gc
import math
import os
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does; before NumPy is loaded
os.environ.setdefault("QUADSTEP_OPTIMISE", "0")  # most tests fly little; tests/test_equal_bits.py: the bits are the same

from quadstep.commands.cli import SELDOM
from quadstep.report import bars
from tests import durations
from tests.browsers import browsers, chromium, open_page  # noqa: F401 (fixtures)
from tests.commands import replace, without_figures, without_grade
from tests.needs import NEEDS, POLICY, Need, needs

ROOMS = "certify", "completion", "proofs", "prove", "region", "theory", "verify"
PROOFS = tuple(f"test_{name}" for name in (*ROOMS, "control_mutations"))
"""Files on rooms that prove things or judge the paper, which nothing else depends on, and one that judges tests of control:
`make test-proofs` runs them.
"""

QUICK, BROWSED = 0.04, 1.5
"""About what a test takes that is not recorded as slow, and one that opens a page in a browser [s]."""
BROWSERS = frozenset(("browsers", "firefox"))
"""Fixtures."""

bars.EVERY = math.inf  # on a busy machine a stage may take a minute, and would say so
gc.set_threshold(SELDOM)  # as the command line does
sys.warnoptions.append("default")  # the command line hides warnings of libraries from users, not from tests


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    without_figures(monkeypatch)


@pytest.fixture
def ungraded(monkeypatch: pytest.MonkeyPatch) -> None:
    without_grade(monkeypatch)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are laid out and written, but blank, where their looks are not the point; not a flight's (`no_figures`)."""
    from matplotlib.artist import Artist

    monkeypatch.setattr("quadstep.report.canvas.Typeset.draw", Artist.draw)


@pytest.fixture
def studies_here(monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.studies import studies_in_this_process

    studies_in_this_process(monkeypatch)
    replace(monkeypatch, "quadstep.studies.comparison.cost.nanoseconds", lambda law, idle: (2.0, 1.0))


@pytest.fixture(scope="module")
def optimised() -> Iterator[None]:
    """The code of users: where code itself is the point, or where flights take longer than to compile it."""
    from quadstep.engines.kernel import Kernels

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("QUADSTEP_OPTIMISE", "1")
        for engine in ("kernel", "sweep"):
            patch.setattr(f"quadstep.engines.{engine}.KERNELS", Kernels())
        yield


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--complete", action="store_true", help="fail if a test was skipped, unless for want of what no one can install"
    )
    parser.addoption("--thorough", action="store_true", help="run the cases of products that an ordinary run leaves out")
    parser.addoption(
        "--proofs-apart", action="store_true", help="leave out what `make test-proofs` runs, unless files are named"
    )
    parser.addoption("--record-durations", action="store_true", help="measure what tests cost (tests/durations.py)")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("record_durations"):
        config.pluginmanager.register(durations.Recorder())


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Files of the group that does not run are not even read, unless they are named."""
    if config.args_source is not config.ArgsSource.TESTPATHS or not collection_path.name.startswith("test_"):
        return None
    mine = collection_path.name.startswith(PROOFS)
    ignored = config.getoption("proofs_apart") if mine else config.option.markexpr == "proofs"
    return True if ignored else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests recorded as slow are marked. The dearest files come first, so that no worker is alone with one at the end; what a
    browser takes is not recorded. Cases of the learned policy need its weights, also in tests of all controllers.
    """
    for item in items:
        if item.path.name.startswith(PROOFS):
            item.add_marker(pytest.mark.proofs)
    if not config.getoption("thorough"):
        left_out = [item for item in items if item.get_closest_marker("thorough")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("thorough")]
    seconds = durations.recorded()
    cost: defaultdict[Path, float] = defaultdict(float)
    for item in items:
        one = seconds.get(durations.function(item.nodeid))
        if one is not None:
            item.add_marker(pytest.mark.slow)
        cost[item.path] += one or (QUICK if BROWSERS.isdisjoint(getattr(item, "fixturenames", ())) else BROWSED)
    items.sort(key=lambda item: -cost[item.path])
    for item in items:
        parameters = item.callspec.params.values() if isinstance(item, pytest.Function) and hasattr(item, "callspec") else ()
        said = [getattr(one, "name", one) for one in parameters]
        if any(isinstance(one, str) and one == "raptor" for one in said):
            item.add_marker(needs(POLICY))


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """What has been loaded and collected stays: it is not searched for garbage again, nor copied by a fork's searches."""
    gc.freeze()


def need_of(reason: str) -> Need | None:
    """The need that a reason for skipping names, if it is in tests/needs.py."""
    return next((need for need in NEEDS if reason == need.reason or reason.startswith(f"{need.reason}: ")), None)


def skipped(config: pytest.Config) -> Counter[str]:
    """Reasons for skipping, each with the number of tests."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    reports = reporter.stats.get("skipped", []) if reporter else []
    texts = (report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr) for report in reports)
    return Counter(text.removeprefix("Skipped: ") for text in texts)


def unexcused(config: pytest.Config) -> list[str]:
    """Reasons for skipping that `--complete` does not accept."""
    return [reason for reason in skipped(config) if not ((need := need_of(reason)) and need.spared)]


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    if session.config.getoption("complete") and exitstatus == pytest.ExitCode.OK and unexcused(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    counts = skipped(config)
    if not counts:
        return
    terminalreporter.section("not run here")
    for reason, count in counts.most_common():
        need = need_of(reason)
        tests = f"{count} test{'s' if count > 1 else ''}"
        terminalreporter.line(f"{tests:>10}  {reason}" + (f". To run: {need.cure}" if need else ""))
    refused = sum(counts[reason] for reason in unexcused(config))
    if refused and config.getoption("complete"):
        terminalreporter.line(f"--complete: {refused} skipped tests count as a failure", red=True)
    elif refused:
        terminalreporter.line(f"To run {refused} of them on Debian or Ubuntu: .ci/run, which installs what they need")
