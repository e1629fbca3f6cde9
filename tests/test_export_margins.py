"""Margins of a loop in a firmware: the gyro behind its filter, the outputs late."""

import re

import numpy as np
import pytest
from scipy import signal

from quadstep.linear.analysis import analyse_rest
from quadstep.linear.grade import PATHS, as_in_firmware, in_firmware
from quadstep.metrics.registry import UNGRADED
from tests.commands import quadstep, write
from tests.exports import real_mission


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_a_gyro_is_as_far_behind_as_its_filter_makes_it(path):
    low = signal.butter(2, 2.0 * np.pi * path.cutoff, analog=True)
    omega = np.array([1.0, 0.1 * 2.0 * np.pi * path.cutoff])
    phase = np.angle(signal.freqs(*low, worN=omega)[1])
    np.testing.assert_allclose(-phase / omega, path.behind, rtol=0.02)


def test_what_lies_between_costs_margin_and_is_said(tmp_path):
    mission = real_mission({"type": "geometric"}, "x500")
    alone, filtered = (analyse_rest(one).analysis for one in (mission, as_in_firmware(mission, PATHS["px4"])))
    for before, after in zip(alone.margins[1:3], filtered.margins[1:3], strict=True):
        lost = (before.phase - after.phase) / before.phase_at
        assert 0.5 * PATHS["px4"].behind < lost < 2.0 * (PATHS["px4"].behind + PATHS["px4"].outputs)
    said, short = in_firmware(mission, "px4")
    assert short
    assert said.startswith("The phase margin on PX4 is ")
    assert "below 30.0°: choose slower gains. " in said
    text = '[vehicle]\npreset = "x500"\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 4.0\n'
    run = quadstep("export", write(tmp_path, text), "--target", "px4", "--out", tmp_path / "o")
    assert run.code == 0
    assert "warning: " in run.err.splitlines()[0]
    assert "on PX4" in " ".join(run.err.split())


def test_plain_c_of_a_loop_without_margin_is_warned_of(tmp_path):
    path = 'type = "step"\nend = [0.0, 0.0, 1.0]\nduration = 4.0\n'
    text = f'[vehicle]\npreset = "x500"\n[path]\n{path}[controller]\ntype = "pid"\n'
    good, hot = (quadstep("export", write(tmp_path, text + more), "--out", tmp_path / "o", "--overwrite")
                 for more in ("", "rate = [60.0, 60.0, 10.0]\n"))  # fmt: skip
    assert "Hovering at the start of its path, the loop is sound" in good.out
    large = quadstep("export", write(tmp_path, text.replace('"pid"', '"mpc"')), "--out", tmp_path / "o", "--overwrite")
    assert UNGRADED in " ".join(large.out.split())
    assert "warning: " in hot.err
    assert "Hovering at the start of its path, the loop is fragile: phase margin " in " ".join(hot.err.split())
    assert "(less than 30.0°)" in " ".join(hot.err.split())


def test_slow_gains_are_not_warned_of_but_where_more_is_asked():
    slow = {"k_x": [1.5] * 3, "k_v": [2.2] * 3, "k_i": [0.2] * 3, "k_R": [60.0, 60.0, 20.0], "k_Omega": [14.0, 14.0, 8.0]}
    mission = real_mission({"type": "geometric", **slow}, "x500")
    said, short = in_firmware(mission, "crazyflie")
    assert not short, said
    strict = real_mission({"type": "geometric", **slow}, "x500", margins={"gain": 40.0})
    said, short = in_firmware(strict, "crazyflie")
    assert short
    assert re.match(r"The gain margin on the Crazyflie is [\d.]+ dB, below 40.0 dB: choose slower gains\. Smallest", said)
