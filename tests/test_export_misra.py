"""The check for MISRA C:2012 ends, and every deviation that it finds has a reason."""

import pytest

from quadstep.export import law_sheet
from quadstep.io.errors import UserError
from tests.exports import plane_mission, real_mission, written
from tests.needs import CPPCHECK, POLICY, needs


def found(folder, kind, mission=real_mission):
    law = written(folder, mission({"type": kind}).plan(), False)
    return law_sheet.deviations(folder, [f"{law.name}.c", f"{law.name}_params.c"])


@needs(CPPCHECK)
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param("mpc", marks=pytest.mark.thorough),
        "mppi",
        pytest.param("raptor", marks=[needs(POLICY), pytest.mark.thorough]),
    ],
)
def test_every_deviation_of_a_long_law_has_a_reason(tmp_path, kind):
    """Each rule that `mpc` and `raptor` deviate from, `mppi` does too."""
    rules = found(tmp_path, kind)
    assert {"21.15"} <= rules.keys() <= law_sheet.REASONS.keys()


@needs(CPPCHECK)
@pytest.mark.parametrize(
    ("kind", "mission"), [("planar-pd", plane_mission), pytest.param("pid", real_mission, marks=pytest.mark.thorough)]
)
def test_where_values_are_followed_changes_no_deviation(tmp_path, monkeypatch, kind, mission):
    rules = found(tmp_path, kind, mission)
    assert rules
    monkeypatch.setattr(law_sheet, "STOP", "")
    assert found(tmp_path, kind, mission) == rules


@needs(CPPCHECK)
def test_a_check_that_does_not_end_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(law_sheet, "LONGEST", 0.01)
    with pytest.raises(UserError, match=r"cppcheck did not finish in 0\.01 s"):
        found(tmp_path, "pid")
