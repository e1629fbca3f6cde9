"""The figures of docs/theory.md that no other test computes: each as the page says it."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from proofs.__main__ import all_statements
from quadstep.control.completed_backstepping import CompletedBackstepping
from quadstep.engines.fly import fly
from quadstep.engines.kernel import Kernels
from quadstep.linear.analysis import analyse_rest
from quadstep.proofs.theory.edge import default_region, level_at_start, mission
from quadstep.proofs.theory.inequalities import STATEMENTS
from quadstep.proofs.theory.trials import COMPLETED, COUNTER_ONLY, PAPER, UNCOUNTERED, disturbance_over_weight, grid, summarise
from quadstep.studies.paper.cases import case_1, line

TEXT = (Path(__file__).parents[1] / "docs" / "theory.md").read_text(encoding="utf-8")
PAGE = " ".join(TEXT.split())


def said(text: str) -> None:
    assert text in PAGE


@cache
def flown():
    """The whole grid of `quadstep study completion`."""
    return grid()


def test_the_grid_of_flights_is_the_one_of_the_page():
    cells = flown()
    for law, name in ((COUNTER_ONLY, "counter-term and $P e_2$ alone"), (COMPLETED, "completed"), (UNCOUNTERED, UNCOUNTERED)):
        s = summarise(cells, law)
        said(
            f"| {name} | {s.law_flies} | {s.gained} | {s.lost} | {s.best_ratio:.2g} to {s.worst_ratio:.4g} times | {s.worse} |"
        )
    said(f"| the paper's | {s.other_flies} | | | | |")
    assert s.flights == 216
    u = summarise(cells, UNCOUNTERED, COMPLETED)
    said(f"flies {u.law_flies} of the 216, with it {u.other_flies}")
    said(f"{u.best_ratio:.4g} to {u.worst_ratio:.4g} times that with it (median {u.median_ratio:.3g})")
    assert (u.lost, summarise(cells, COMPLETED).worse) == (0, 0)

    def flying(law: str, *scales: float) -> list[float]:
        return [cell.rmse for cell in cells if cell.law == law and cell.scale in scales and cell.rmse is not None]

    assert (len(flying(COMPLETED, 0.0, 1.0)), len(flying(PAPER, 0.0, 1.0))) == (144, 97)
    said("At scales 0 and 1 the completed law completes all 144 flights, the paper's law 97.")
    slow = [c for c in cells if c.slope <= 3.0 and c.nets and c.scale < 5.0]
    assert [sum(c.rmse is not None for c in slow if c.law == law) for law in (PAPER, COMPLETED)] == [1, 36]
    said("completes 1 of 36 such flights, the completed law all")
    assert not flying(PAPER, 5.0)
    assert not flying(COMPLETED, 5.0)
    hard = [c.rmse for c in cells if c.law == COMPLETED and (c.time, c.scale, c.nets) == (3.0, 1.0, True)]
    said(f"{min(hard):.2g} to {max(hard):.2g} m off with nets")


def test_the_disturbance_along_the_path_is_as_said():
    said(f"the disturbance along the path is {disturbance_over_weight((3.0,))[3.0]:.1f} times the weight")


def test_the_condition_of_theorem_a_in_numbers():
    k1, k2, l2 = 3.0 - 1.0, 250.0 - 10.0 * 15.0, 15.0
    most = 2.0 * l2 * (k1 * k2) ** 0.5
    said(f"($k_1$ = {k1:.0f}, $k_2$ = {k2:.0f}, $l_2$ = {l2:.0f}) condition (A) reads $u_{{max}}$ < {most:.0f} N")
    asked = (9.81**2 / (4.0 * k1 * 0.5)) ** (1.0 / 3.0)  # K_r2 = 10.5 Lambda_2: k2 = 0.5 Lambda_2
    said(rf"$K_{{r2}} = 10.5\, \Lambda_2$ is stable at hover from $\Lambda_2$ = 1.10 on, while (A) requires {asked:.2f}")


@pytest.mark.parametrize(("slope", "stable"), [(1.10, False), (1.105, True)])
def test_hover_is_stable_from_where_the_page_says(slope, stable):
    gains = {"type": "backstepping", "K_r2": 10.5 * slope, "Lambda2": slope, "nets": {"enabled": False}}
    assert analyse_rest(case_1(controller=gains, disturbance={"scale": 0.0})).analysis.stable is stable


def test_small_figures():
    low, high = np.linalg.eigvalsh([[1.8, 0.2], [0.2, 0.04]])
    said(rf"\begin{{bmatrix}} 1.8 & 0.2 \\ 0.2 & 0.04 \end{{bmatrix}}$, whose eigenvalues are {low:.4f} and {high:.2f}")
    said(f"{10**0.5 / 0.01:.0f} for N = 10, $\\kappa$ = 0.01")
    said(rf"$|r| \le 1 / (F \kappa T)$ = {1.0 / (5.0 * 0.01 * 0.002):,.0f}")
    for w in (100.0, 200.0):
        said(f"+{100.0 * 0.001 / (2.0 / w):.0f} % at{' 100 rad/s' if w == 100 else ' 200'}")


def test_starts_that_the_region_holds():
    region = default_region()
    (text,) = re.findall(r"Starts inside it, one at a time: (.*?)\. ", PAGE)
    numbers = [float(number) for number in re.findall(r"[\d.]*\d", text)]
    sections = ("position", "position", "velocity", "velocity", "attitude", "attitude")
    for number, section, axis in zip(numbers, sections, (0, 2, 0, 2, 1, 0), strict=True):
        off = [0.0, 0.0, 0.0]
        off[axis] = -number if axis == 2 else number
        assert level_at_start(mission({section: tuple(off)}, nets=False).plan(), region) == pytest.approx(0.05, rel=0.02)
    said(f"thrust | {float(region.bounds.thrust):.2g} N")


def test_case_1_stays_far_inside_the_end_values():
    log = fly(mission({}, nets=False).plan())
    off = np.linalg.norm(log.table("x_d", "y_d", "z_d") - log.table("x", "y", "z"), axis=1)
    said(f"Case 1 itself, nets off, stays within {1e3 * off.max():.2f} mm")


def test_yaw_without_its_acceleration(monkeypatch):
    right = CompletedBackstepping.law

    def law(self, memory, measured, reference, gains, t, period):
        return right(self, memory, measured, reference._replace(yaw_acceleration=0.0), gains, t, period)

    monkeypatch.setattr(CompletedBackstepping, "law", law)
    monkeypatch.setattr("quadstep.engines.kernel.KERNELS", Kernels())  # those that are there have the right law,
    monkeypatch.setattr("quadstep.engines.kernel.described", lambda _: "")  # and so have the files
    flight = line(
        "turn", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], controller={"type": "completed-backstepping"}, simulation={"duration": 8.0}
    )
    content = flight.model_dump(exclude_unset=True)
    content["path"] = {"type": "minimum-jerk", "start": [0, 0, 0], "end": [1, 0, 0], "duration": 3.0, "yaw_end": 3.0}
    log = fly(type(flight).model_validate(content).plan())
    said(f"without it {1e3 * np.abs(log.column('psi_d') - log.column('psi')).max():.3g} mrad")


def test_every_statement_has_its_number_its_place_in_the_text_and_its_check():
    text, _, checks = TEXT.partition("## Which check proves which statement")
    rows = [line for line in checks.splitlines() if re.match(r"\| T\d", line)]
    numbered = [(number, row) for row in rows for number in re.findall(r"T\d+", row.split("|")[1])]
    assert sorted(number for number, _ in numbered) == sorted(f"T{k}" for k in range(1, 19))
    assert {number for number, _ in numbered} <= set(re.findall(r"\bT\d+\b", text))
    assert {number for number, row in numbered if "samples" in row} == {statement.number for statement in STATEMENTS}
    table = [line for line in checks.partition("How tight")[0].splitlines() if re.match(r"\| (T\d|the )", line)]
    assert set(rows) < set(table)
    assert all(re.search(r"Coq `|rationals", row) for row in table)
    proved = {statement.name for statement in all_statements()}
    named = {name for row in table if "Coq" in row for name in re.findall(r"`(\w+)`", row.split("Coq")[1].split(";")[0])}
    assert named <= proved
    assert {name for name in proved if re.fullmatch(r"T\d+(_near|_lines)?|B_norm|B_rate|C_norm", name)} <= named
