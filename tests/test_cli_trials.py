"""Faults that a hostile trial found stay fixed."""

import json

import pytest

from quadstep.engines.fly import fly
from quadstep.io.errors import UserError
from quadstep.mission.read import check_mission, read_mission
from quadstep.report.publish import publishing, write_json

LINE = {"type": "minimum-jerk", "end": [1.0, 0.0, 1.0], "duration": 3.0}


def publish(folder, identity, name):
    with publishing(folder, identity, overwrite=False) as out:
        write_json(out / "metrics.json", {"name": name})


def test_a_run_that_finishes_after_another_mission_took_the_folder_is_refused(tmp_path):
    folder = tmp_path / "out"
    with pytest.raises(UserError, match="other results"), publishing(folder, "b", overwrite=False) as out:
        write_json(out / "metrics.json", {"name": "B"})
        publish(folder, "a", "A")
    assert json.loads((folder / "metrics.json").read_text())["name"] == "A"
    assert [path.name for path in folder.iterdir()] == ["metrics.json"]


def test_rotors_that_cannot_lift_the_vehicle_are_warned_of():
    mission = check_mission({"path": LINE, "vehicle": {"rotors": {"limits": [0.0, 2.4]}}}, "m.toml")
    assert any("lift at most 9.6 N" in warning for warning in mission.plan().warnings)
    slow = {**LINE, "duration": 6.0}
    mission = check_mission({"path": slow, "vehicle": {"rotors": {"limits": [0.0, 2.6]}}}, "m.toml")
    assert mission.plan().warnings == ()


def test_a_mission_with_a_byte_order_mark_is_read(tmp_path):
    path = tmp_path / "m.toml"
    path.write_bytes(b'\xef\xbb\xbf[path]\ntype = "minimum-jerk"\nend = [1.0, 0.0, 1.0]\nduration = 3.0\n')
    assert fly(read_mission(path).plan()).ended == 3.0
