"""Figures of the pages, each computed again as the command beside it prints it. Those of docs/theory.md are apart."""

import re
from pathlib import Path

import pytest

from benchmarks import firmware
from benchmarks.rare.__main__ import FLOWN, KNOWN, kept, read, row
from quadstep.metrics.statistics import share
from quadstep.studies.campaign.run import looks
from quadstep.studies.campaign.schema import Method
from tests.needs import CORTEX_M, CORTEX_M_12, needs

DOCS = Path(__file__).parents[1] / "docs"


def page(name: str) -> str:
    """A page without line breaks."""
    return " ".join((DOCS / name).read_text(encoding="utf-8").split())


def test_the_looks_of_a_campaign_that_flies_until_it_is_sure():
    text = page("rare.md")
    for number, look in zip(range(1, 7), looks(1e-4), strict=False):
        assert f"| {number} | {look.flights:,} | {look.failures} |" in text
    assert f"at least {next(looks(1e-4)).flights * 1e-4:.1f} / P flights" in text
    assert share(0, 10_000).high * 10_000 < 4
    assert "fewer than 4 in 10,000" in text


def share_held(case: str, method: Method) -> int:
    """How many per cent of the intervals held, as printed."""
    return int(printed(case, method)[6].removesuffix(" %"))


def printed(case: str, method: Method) -> list[str]:
    """The cells of a line of the benchmark's table."""
    return re.split(r"  +", row(case, method).strip())


@pytest.mark.parametrize(
    ("case", "method"),
    [*((case, Method.SUBSET) for case in KNOWN), *((case, Method.CROSS_ENTROPY) for case in (*KNOWN, *FLOWN))],
)
def test_the_cases_are_as_measured(case, method):
    lines = re.findall(rf"\| {case} \|(.*?)\|\n", (DOCS / "rare.md").read_text(encoding="utf-8"))
    cells = [cell.strip() for cell in lines[0 if method is Method.CROSS_ENTROPY else -1].split("|")]
    one, found = printed(case, method), read(kept(method, case))
    warned = f"{sum(bool(one['warnings']) for one in found)} of {len(found)}"
    assert cells[:-1] == [one[1], one[2], one[3], one[6], one[10], warned, f"{int(one[8]):,}"]
    assert float(cells[-1].removesuffix(" times")) == pytest.approx(float(one[9]), rel=0.15)


def test_how_often_the_intervals_held():
    held = {case: share_held(case, Method.CROSS_ENTROPY) for case in (*KNOWN, *FLOWN)}
    known, measured = ([held[case] for case in cases] for cases in (KNOWN, FLOWN))
    said = f"{sum(known) / 5:.0f} % where the probability is known and {sum(measured) / 5:.0f} % where it was measured"
    assert said in page("rare.md")
    assert {case: share for case, share in held.items() if share < 90} == {"edge": 86}
    assert "nine of the ten cases reach 90 %, `edge` has 86 %" in page("rare.md")
    said = f"probability in {min(held.values())} to {max(held.values())} % of fifty repetitions with cross-entropy"
    assert said in page("certain.md")
    saved = sorted(round(float(printed(case, Method.CROSS_ENTROPY)[9])) for case in FLOWN)
    said = f"{saved[0]} times as many flights in `gusts`, where failure depends on the noise, {saved[1]} to {saved[-1]}"
    assert said in page("rare.md")
    held = [share_held(case, Method.SUBSET) for case in KNOWN]
    assert f"in {min(held)} to {max(held)} % with subset simulation" in page("certain.md")
    assert min(held) >= 90
    assert "subset simulation all five cases reach a coverage of 90 %" in page("rare.md")


@needs(CORTEX_M, CORTEX_M_12)
@pytest.mark.parametrize("law", ["rotation-backstepping", "backstepping", "pid", "geometric", "mpc"])
def test_what_an_exported_law_takes(law):
    one = firmware.cells(law)
    (line,) = re.findall(rf"\| {law}(?:(?:,| \().*?)? \|(.*)\|\n", (DOCS / "export.md").read_text(encoding="utf-8"))
    state, code, alone, stack, count, took = (cell.strip() for cell in line.split("|"))
    assert (state, code, alone, stack) == (f"{one.state} B", f"{one.code} B", f"{one.alone} B", f"{one.stack} B")
    if "guide" in took:
        guide, share = one.worst["guide"]
        assert (count, took) == (f"{guide} guide, {one.worst['law'][0]} law", f"{100 * share:.2f} % of guide's 20 ms")
    else:
        assert (count, took) == (str(one.together), f"{100 * one.share:.2f} %")


@needs(CORTEX_M, CORTEX_M_12)
def test_the_aims_of_exported_laws():
    limited = firmware.cells("pid", most_tilt=0.5)
    said = f"With `most_tilt` set, `pid` takes {limited.together} instructions ({100 * limited.share:.2f} %)"
    assert said in page("export.md")
    assert max(firmware.cells(law).share for law in ("pid", "geometric")) < 0.007
    assert firmware.cells("rotation-backstepping").alone < 5000
