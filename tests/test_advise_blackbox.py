"""Betaflight's blackbox: a log of our own making is read, its loops are measured, and what tells nothing is refused."""

import math
from functools import cache

import numpy as np
import pytest

from quadstep.identify.excited import excited
from quadstep.identify.logs.read import read_topics
from quadstep.identify.measured import measured
from quadstep.io.errors import UserError
from quadstep.report.sheet import sheet
from quadstep.studies.advise import advise

pytest.importorskip("betaflight_chirp_core")

WEAK = 4.0
STEP, DURATION, DELAY = 0.002, 40.0, 4
P_SCALE, I_SCALE, D_SCALE = 0.032029, 0.244381, 0.000529
"""Betaflight's own."""

HEADERS = {
    "Data version": 2, "I interval": 32, "P interval": "1/1", "Firmware revision": "Betaflight 4.5.1 (abc) STM32F7X2",
    "gyro_scale": "0x3f800000", "motorOutput": "158,2047", "pidsum_limit": 500, "pidsum_limit_yaw": 400,
    "rollPID": "50,60,30", "pitchPID": "50,60,30", "yawPID": "50,60,0", "d_min": "0,0,0", "dyn_notch_count": 1,
    "dyn_notch_min_hz": 100, "dyn_notch_max_hz": 200,
}  # fmt: skip


def unsigned(value: int) -> bytes:
    """A whole number, seven bits a byte, the lowest first."""
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def signed(value: int) -> bytes:
    return unsigned((value << 1) if value >= 0 else (-value << 1) - 1)


def blackbox(columns, headers=HEADERS, flags=1) -> bytes:
    """A log of columns of whole numbers (n,): whole frames every 32, differences to the one before between."""
    names = ["loopIteration", "time", *columns]
    count = len(next(iter(columns.values())))
    step = round(1e6 * STEP)
    rows = np.column_stack([np.arange(count), step * np.arange(count), *columns.values()]).astype(int)
    fields = {
        "Field I name": ",".join(names), "Field I signed": ",".join("1" for _ in names),
        "Field I predictor": ",".join("0" for _ in names), "Field I encoding": ",".join("0" for _ in names),
        "Field P predictor": ",".join(["6", *("1" for _ in names[1:])]),
        "Field P encoding": ",".join(["9", *("0" for _ in names[1:])]),
        "Field S name": "flightModeFlags", "Field S signed": "0", "Field S predictor": "0", "Field S encoding": "1",
    }  # fmt: skip
    product = {"Product": "Blackbox flight data recorder by Nicholas Sherlock"}
    out = [f"H {name}:{value}\n".encode() for name, value in {**product, **fields, **headers}.items()]
    out.append(b"S" + unsigned(flags))
    for number, row in enumerate(rows):
        if number % 32 == 0:
            out.append(b"I" + b"".join(map(signed, row.tolist())))
        else:
            out.append(b"P" + b"".join(map(signed, (row - rows[number - 1])[1:].tolist())))
    return b"".join(out)


@cache
def flight(factor: float):
    """Setpoint and gyro [deg/s], P, I, D and feed-forward of a roll whose gains are so many times those of the headers; the
    sticks snap, feed-forward follows them.
    """
    random = np.random.default_rng(7)
    count = round(DURATION / STEP)
    asked = np.repeat(random.uniform(-300.0, 300.0, count // 100), 100)
    setpoint = np.convolve(asked, np.ones(15) / 15.0, "same")
    p, i, d = P_SCALE * 50 * factor, I_SCALE * 60 * factor, D_SCALE * 30 * factor
    rate, lagged, integral, before, rows, waiting = 0.0, 0.0, 0.0, 0.0, [], [0.0] * DELAY
    last = 0.0
    for r in setpoint:
        gyro = rate + 0.5 * random.normal()
        error = r - gyro
        parts = p * error, integral + i * STEP * error, -d * (gyro - before) / STEP, 0.02 * (r - last) / STEP * 0.1
        integral, before, last = parts[1], gyro, r
        waiting = [*waiting[1:], sum(parts)]
        lagged += (1.0 - math.exp(-STEP / 0.02)) * (waiting[0] - lagged)
        rate += STEP * EFFECT * lagged
        rows.append((r, gyro, *parts))
    return np.array(rows).T


EFFECT = 40.0
"""Of a thousandth of a motor's range [deg/s^2]."""


def truth(factor: float) -> tuple[float, float]:
    """Crossover [rad/s] and phase margin [rad]."""
    omega = np.geomspace(3.0, 400.0, 20_000)
    z = np.exp(1j * omega * STEP)
    p, i, d = P_SCALE * 50 * factor, I_SCALE * 60 * factor, D_SCALE * 30 * factor
    law = p + i * STEP * z / (z - 1.0) + d * (1.0 - 1.0 / z) / STEP
    share = 1.0 - math.exp(-STEP / 0.02)
    turn = z ** (1 - DELAY) * share / (1.0 - (1.0 - share) / z) * STEP * EFFECT / (z - 1.0)
    opened = law * turn
    at = np.flatnonzero(np.diff(np.abs(opened) > 1.0))[-1]
    return float(omega[at]), float(np.angle(-opened[at]))


def logged(tmp_path, factor, headers=HEADERS, flags=1, tenths=False):
    by = 10.0 if tenths else 1.0
    headers = {**headers, "blackbox_high_resolution": int(tenths)}
    r, y = (np.round(by * one) for one in flight(factor)[:2])
    p, i, d, f = (np.round(one) for one in flight(factor)[2:])
    idle = 0.0 * r
    columns = {"setpoint[0]": r, "gyroADC[0]": y, "axisP[0]": p, "axisI[0]": i, "axisD[0]": d, "axisF[0]": f}
    columns |= {"rcCommand[3]": idle + by * 1400.0, "setpoint[3]": idle + 400.0}
    columns |= {f"motor[{place}]": 900.0 + sign * (p + i + d + f) for place, sign in enumerate((1, -1, 1, -1))}
    path = tmp_path / "flight.bbl"
    path.write_bytes(
        blackbox(columns, {**headers, "rollPID": f"{50 * factor:.0f},{60 * factor:.0f},{30 * factor:.0f}"}, flags)
    )
    return path


def test_a_log_of_betaflight_is_read(tmp_path):
    found = read_topics(logged(tmp_path, 1.0), ["main.gyroADC[0]", "main.axisSum[0]", "main.motor[3]"])
    r, y, *parts = flight(1.0)
    assert found.columns["main.gyroADC[0]"].value == pytest.approx(np.round(y), abs=1e-6)
    assert found.columns["main.gyroADC[0]"].time == pytest.approx(STEP * np.arange(len(r)))
    assert found.columns["main.axisSum[0]"].value == pytest.approx(sum(map(np.round, parts)))
    assert (found.parameters["p_roll"], found.parameters["motorOutput[1]"], found.damaged) == (50.0, 2047.0, 0)


@pytest.mark.parametrize("factor", [1.0, WEAK])
def test_a_flight_with_betaflight_tells_crossover_and_phase_margin(tmp_path, factor):
    now = measured(excited(logged(tmp_path, factor), None).measured)
    at, phase = truth(factor)
    assert now.phase.at.value == pytest.approx(at, rel=0.05)
    assert now.phase.value.value == pytest.approx(phase, abs=math.radians(3.0))


def test_a_log_of_high_resolution_tells_the_same(tmp_path):
    """Its rates, setpoints and sticks are in tenths, what the loop asks of the motors is not."""
    coarse = measured(excited(logged(tmp_path, 1.0), None).measured)
    path = logged(tmp_path, 1.0, tenths=True)
    fine = read_topics(path, ["main.gyroADC[0]", "main.setpoint[0]", "main.rcCommand[3]", "main.setpoint[3]"]).columns
    r, y, *_ = flight(1.0)
    assert np.abs(fine["main.gyroADC[0]"].value - y).max() < 0.051
    assert np.abs(fine["main.setpoint[0]"].value - r).max() < 0.051
    assert (fine["main.rcCommand[3]"].value[0], fine["main.setpoint[3]"].value[0]) == (1400.0, 400.0)
    now = measured(excited(path, None).measured)
    assert now.phase.at.value == pytest.approx(coarse.phase.at.value, rel=0.02)
    assert now.phase.value.value == pytest.approx(coarse.phase.value.value, abs=math.radians(1.0))


def test_advice_for_betaflight_is_whole_numbers_to_paste(tmp_path):
    found = advise(logged(tmp_path, WEAK), None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    lines = (tmp_path / "out" / "advised.txt").read_text().split("\n")
    assert lines[-2:] == ["save", ""]
    written = {line.split()[1]: int(line.split()[3]) for line in lines[:-2]}
    factor = found.record["factor"]
    assert written == {"p_roll": round(200 * factor), "i_roll": round(240 * factor), "d_roll": round(120 * factor)}
    assert truth(WEAK)[1] < math.radians(30.0) < truth(WEAK * factor)[1]


def test_logs_of_betaflight_that_tell_nothing_are_refused(tmp_path):
    with pytest.raises(UserError, match="flew in a mode other than acro"):
        excited(logged(tmp_path, 1.0, flags=3), None)
    with pytest.raises(UserError, match=r"should be from Betaflight, not INAV 7\.1\.0"):
        excited(logged(tmp_path, 1.0, {**HEADERS, "Firmware revision": "INAV 7.1.0 (abc)"}), None)
    for interval in ("0/1", "1/2000000000"):  # the decoder would count for ever
        with pytest.raises(UserError, match="interval between frames"):
            excited(logged(tmp_path, 1.0, {**HEADERS, "P interval": interval}), None)
    path = tmp_path / "noise.bbl"
    path.write_bytes(np.random.default_rng(0).bytes(5_000))
    with pytest.raises(UserError, match="contains no Betaflight blackbox flight"):
        excited(path, None)
