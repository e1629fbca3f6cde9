"""Figures of the pages, each computed again as the command beside it prints it. Those of docs/theory.md are apart."""

import re
from pathlib import Path

import pytest

from benchmarks.rare.__main__ import FLOWN, KNOWN, kept, read, row, truth
from quadstep.analysis.statistics import share
from quadstep.campaign.until import looks

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


@pytest.mark.parametrize("case", [*KNOWN, *FLOWN])
def test_the_ten_cases_are_as_measured(case):
    (line,) = re.findall(rf"\| {case} \|(.*?)\|\n", (DOCS / "rare.md").read_text(encoding="utf-8"))
    cells = [cell.strip() for cell in line.split("|")]
    printed, true, found = re.split(r"  +", row(case).strip()), truth(case), read(kept("estimates", case))
    assert cells[0] == f"{true.value:.2e}"
    assert cells[1] == printed[2]
    assert cells[2] == printed[3]
    assert cells[3] == printed[6]
    assert cells[4] == f"{sum(bool(one['warnings']) for one in found)} of {len(found)}"
    assert float(cells[5].removesuffix(" times")) == pytest.approx(float(printed[9]), rel=0.15)


def test_how_often_the_intervals_held():
    held = [int(re.split(r"  +", row(case).strip())[6].removesuffix(" %")) for case in (*KNOWN, *FLOWN)]
    assert f"on the ten cases there it held in {min(held)} to {max(held)} % of the repetitions" in page("certain.md")
    assert sum(one >= 90 for one in held) == 5
    assert "Five of ten reach nine in ten" in page("rare.md")
