"""docs/extending.md against the package: what a user can add, by the names of `quadstep.own`."""

import importlib.util
import re
from pathlib import Path

import pytest

from quadstep import own
from tests.doors import DOORS

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| a[^|]*\| `(\w+)`[^|]*\| `([\w/.]+\.py)`", TEXT, re.MULTILINE)


def test_every_kind_has_a_row():
    assert [base for base, _ in ROWS] == [
        "Controller",
        "Plant",
        "Path",
        "Wind",
        "Disturbance",
        "Metric",
        "Sensor",
        "Estimator",
    ]


@pytest.mark.parametrize(("base", "example"), ROWS)
def test_the_example_of_a_row_is_one_and_imports_nothing_but_public_names(base, example):
    spec = importlib.util.spec_from_file_location("example", ROOT / example)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    kind = getattr(own, base)
    assert any(isinstance(one, type) and issubclass(one, kind) and one is not kind for one in vars(module).values())
    inner = re.findall(r"^from (quadstep\S*) import", (ROOT / example).read_text(encoding="utf-8"), re.MULTILINE)
    assert set(inner) == {"quadstep.own"}


def test_every_door_has_a_row():
    assert all(f"`{door.group}`" in TEXT for door in DOORS)
