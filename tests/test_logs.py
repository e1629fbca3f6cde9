"""Reading logs and judging them: what contradicts a mapping is named, with evidence."""

import dataclasses
import re

import numpy as np
import pytest

from quadstep.identify.logs.consistency import Finding, clocks
from quadstep.identify.logs.flight import lag, slopes
from quadstep.identify.logs.judge import FASTER, in_few_lines, judge, never_flew
from quadstep.identify.logs.mapping import Mapping, load_mapping, mapping_names
from quadstep.identify.logs.read import read_log
from quadstep.identify.replay import ready
from quadstep.io.errors import UserError
from tests import calm_flights
from tests.made_flights import MAPPING, logged, start, table, write


@pytest.fixture(scope="module")
def flight():
    return logged(0, guidance=0.01, shaken=True)[0]


@pytest.fixture
def folder(tmp_path, flight):
    """A log, and a mapping that fits it."""
    write(tmp_path / "log.csv", *table(flight))
    (tmp_path / "map.toml").write_text(MAPPING)
    return tmp_path


def judged(folder, text):
    (folder / "map.toml").write_text(text)
    found = judge(read_log(folder / "log.csv", str(folder / "map.toml")), start().geometry())
    return [one.text for one in found if one.wrong]


def test_a_log_reads_back_as_it_was_made(folder, flight):
    read = read_log(folder / "log.csv", str(folder / "map.toml"))
    assert np.array_equal(read.motors * 1.5, flight.motors) or np.allclose(read.motors * 1.5, flight.motors, rtol=1e-15)
    for name, values in flight.channels.items():
        assert np.allclose(read.channels[name], values, rtol=0, atol=1e-12), name
    assert read.measured.all()
    assert read.flying.sum() > 1000


def test_a_flight_a_little_too_short_is_not_said_to_be_long_enough(flight):
    rows = np.flatnonzero(flight.flying)[round(2.96 / flight.period) - 1] + 1
    short = dataclasses.replace(
        flight,
        **{name: getattr(flight, name)[:rows] for name in ("time", "motors", "lost")},
        channels={name: values[:rows] for name, values in flight.channels.items()},
    )
    assert judge(short)[0].text.startswith("flew too briefly: 2.9 s in the air")
    assert judge(short)[0].text.endswith("at least 3 s are needed")


def test_a_right_mapping_is_not_contradicted(folder):
    assert judged(folder, MAPPING) == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("rad/s", "deg/s"), "rates: x: radians where degrees are expected"),
        (('["p", "q", "r"]', '["q", "p", "r"]'), "rates: x goes with y"),
        (('unit = "rad/s"', 'unit = "rad/s", signs = [1, -1, 1]'), "rates: the sign of y is inverted"),
        (('"wxyz"', '"xyzw"'), "rates"),
        (('["m1", "m2", "m3", "m4"]', '["m1", "m4", "m3", "m2"]'), "motors: their roll torque turns the other axis"),
        (('["m1", "m2", "m3", "m4"]', '["m3", "m4", "m1", "m2"]'), "motors: their roll torque is against"),
        (('unit = "V"', 'unit = "mV"'), "voltage"),
        (('["vx", "vy", "vz"]', '["vy", "vx", "vz"]'), "velocity: x goes with y"),
        (('unit = "m"', 'unit = "mm"'), "never flew"),
        (("full = 1.5", "full = 0.4"), "motors"),
        (("[columns]", '[columns]\nestimated_attitude = { columns = ["qw", "qx", "qy", "qz"], signs = [1, 1, -1, 1] }'),
         "estimated_attitude: the sign of y is inverted"),
    ],
)  # fmt: skip
def test_what_contradicts_a_mapping_is_named(folder, change, said):
    assert any(one.startswith(said) for one in judged(folder, MAPPING.replace(*change)))


def swapped(flight, name, order):
    values = flight.motors if name == "motors" else flight.channels[name]
    moved = values[:, order]
    return (
        dataclasses.replace(flight, motors=moved)
        if name == "motors"
        else dataclasses.replace(flight, channels={**flight.channels, name: moved})
    )


WRONG = [
    ("rates", [1, 0, 2]),
    ("rates", [0, 2, 1]),
    ("velocity", [1, 0, 2]),
    ("motors", [0, 3, 2, 1]),
    ("motors", [2, 3, 0, 1]),
]


@pytest.mark.parametrize("seed", range(20))
def test_calm_flights_with_a_right_mapping_are_accepted_and_with_a_wrong_one_refused(seed):
    geometry = start().geometry()
    flights = [dataclasses.replace(one, motors=one.motors / 1.5) for one in logged(seed)]
    assert [one.text for flight in flights for one in judge(flight, geometry) if one.wrong] == []
    for name, order in WRONG if seed < 5 else WRONG[seed % 5 :][:1]:
        found = [one.text for flight in flights for one in judge(swapped(flight, name, order), geometry) if one.wrong]
        assert any(one.startswith(f"{name}: ") for one in found), (name, order)


BARE = MAPPING.replace('rates = { columns = ["p", "q", "r"], unit = "rad/s" }\n', "").replace(
    'velocity = { columns = ["vx", "vy", "vz"], unit = "m/s" }\n', ""
)


def test_an_order_of_quaternions_is_contradicted_even_where_neither_rates_nor_velocity_were_logged(folder):
    assert judged(folder, BARE) == []
    for order in ("xyzw", "roll-pitch-yaw"):
        columns = '["qw", "qx", "qy", "qz"]' if order == "xyzw" else '["qx", "qy", "qz"]'
        wrong = BARE.replace('["qw", "qx", "qy", "qz"]', columns).replace('"wxyz"', f'"{order}"')
        assert any(one.startswith("attitude: ") for one in judged(folder, wrong)), order
    turned = BARE.replace('["qw", "qx", "qy", "qz"], order = "wxyz"', '["qx", "qy", "qz", "qw"], order = "wxyz"')
    assert any(one.startswith("attitude: ") for one in judged(folder, turned))


@pytest.mark.parametrize("path", ["circle", "eight"])
def test_a_flight_in_wind_does_not_contradict_its_attitude(path):
    wind = {"mean": [8.0, 0.0, 0.0], "turbulence": {"intensity": "severe"}}
    flight = calm_flights.logged("x500", path, 1, 30.0, wind=wind)
    assert [one.text for one in judge(flight, calm_flights.start("x500").geometry()) if one.wrong] == []


def test_commands_that_are_missing_or_slow_are_told_from_large_ones(flight):
    slow = dataclasses.replace(
        flight, period=0.1, time=flight.time[::10], motors=flight.motors[::10] / 1.5, lost=flight.lost[::10].copy(),
        channels={name: values[::10] for name, values in flight.channels.items()},
    )  # fmt: skip
    slow.lost[40:60] = True
    found = [one for one in judge(slow) if "motors" in one.text or "command" in one.text]
    assert any(one.text == "20 rows without a command; left out" for one in found)
    assert any(one.wrong and "a command every 100 ms" in one.text and "LOG_BITMASK" in one.text for one in found)
    lost = dataclasses.replace(flight, motors=1.2 * flight.motors / flight.motors.max(), lost=np.arange(flight.rows) % 3 == 0)
    assert any("times full; is `full` correct?" in one.text for one in judge(lost) if one.wrong)


def refused(folder, header, rows, text=MAPPING):
    write(folder / "log.csv", header, rows)
    (folder / "map.toml").write_text(text)
    with pytest.raises(UserError) as error:
        read_log(folder / "log.csv", str(folder / "map.toml"))
    return str(error.value)


def test_broken_logs_are_refused_in_a_line_that_says_where(folder, flight):
    header, rows = table(flight)
    assert "10 fields" in refused(folder, header, [*rows[:50], rows[50][:10]])
    assert "column 'm3' is missing" in refused(folder, [name if name != "m3" else "other" for name in header], rows)
    assert "more than once" in refused(folder, [name if name != "m3" else "m2" for name in header], rows)
    assert "0 rows of data" in refused(folder, header, [])
    assert "line 32, column 'm1': 'abc' is not a number" in refused(
        folder, header, [*rows[:30], [rows[30][0], "abc", *rows[30][2:]], *rows[31:]]
    )
    assert "the motor's command is missing" in refused(
        folder, header, [*rows[:30], [rows[30][0], "nan", *rows[30][2:]], *rows[31:]]
    )
    assert "time goes backward" in refused(folder, header, [*rows[:30], rows[5], *rows[31:]])
    assert "is the unit correct" in refused(folder, header, rows, MAPPING.replace('"s"', '"ms"'))
    for text in ("", "\0" * 5000):
        (folder / "empty.csv").write_text(text)
        for mapping in (None, str(folder / "map.toml")):
            with pytest.raises(UserError, match="is empty"):
                read_log(folder / "empty.csv", mapping)
    with pytest.raises(UserError, match="unsupported log format"):
        read_log(folder / "log.txt")


def test_mappings_say_what_is_wrong_with_them(folder):
    for change, said in (
        (('"m/s"', '"knots"'), "unknown unit 'knots'"),
        (('["vx", "vy", "vz"]', '["vx", "vy"]'), "2 columns given, 3 are needed"),
        (("velocity", "speed"), "columns: unknown channel 'speed'"),
    ):
        (folder / "map.toml").write_text(MAPPING.replace(*change))
        with pytest.raises(UserError, match=said):
            read_log(folder / "log.csv", str(folder / "map.toml"))


def test_the_mappings_of_the_package_are_whole():
    assert {"crazypad", "idsia", "nanobench"} <= set(mapping_names())
    assert all(isinstance(load_mapping(name), Mapping) for name in mapping_names())


def test_a_log_without_pitch_is_said_to_lack_it_and_not_its_whole_attitude(flight):
    lacking = {name: values for name, values in flight.channels.items() if name not in ("attitude", "rates")}
    with pytest.raises(UserError, match="no attitude about all axes and no rates in the log, which can be checked"):
        ready([dataclasses.replace(flight, channels=lacking)], start())


def test_rows_after_a_gap_start_anew(flight):
    time = flight.time.copy()
    time[500:] += 0.05
    gapped = type(flight)(**{**vars(flight), "time": time})
    assert gapped.runs()[499] == 499
    assert gapped.runs()[500] == 0


def test_a_lag_is_found_with_its_sign():
    time = np.arange(0.0, 20.0, 0.01)
    signal = np.sin(7.0 * time) + np.sin(3.1 * time)
    late = np.sin(7.0 * (time - 0.03)) + np.sin(3.1 * (time - 0.03))
    assert abs(lag(signal, late, 0.01).lag - 0.03) < 1e-3
    assert abs(lag(late, signal, 0.01).lag + 0.03) < 1e-3


def test_how_late_the_attitude_is_comes_with_the_correlation_that_says_so(flight):
    t = 0.01 * np.arange(2000)
    angle, turn = 0.1 * np.sin(7.0 * (t - 0.03)) + 0.1 * np.sin(3.1 * (t - 0.03)), np.zeros((2000, 3))
    turn[:, 0] = 0.7 * np.cos(7.0 * t) + 0.31 * np.cos(3.1 * t)
    attitude = np.stack([np.cos(0.5 * angle), np.sin(0.5 * angle), 0.0 * t, 0.0 * t], axis=1)
    channels = {"attitude": attitude, "rates": turn}
    one = dataclasses.replace(flight, time=t, channels=channels, derived=(), lost=np.zeros(2000, bool))
    (found,) = clocks(one, np.ones(2000, dtype=bool))
    assert re.fullmatch(r"attitude lags the rates by (29|30|31) ms \(correlation (0\.9\d|1\.00)\)", found.text)


def test_findings_that_differ_only_in_numbers_are_one_line_with_the_least_and_the_greatest():
    calm, span = "yaw is barely excited ({} rad/s): wide", "position lags the setpoint by {} ms along {}"
    found = {
        "a": [Finding(False, one) for one in (calm.format("0.081"), span.format(461, "x"), span.format(95, "y"))],
        "b": [Finding(False, calm.format("0.0094")), Finding(False, "2 rows repeat in 3.2 m/s^2")],
        "c": [Finding(False, calm.format("0.05")), Finding(False, span.format(99, "x"))],
    }  # fmt: skip
    assert in_few_lines(found) == [
        "3 of 3 flights: yaw is barely excited (0.0094 to 0.081 rad/s): wide",
        "2 of 3 flights (a and c): position lags the setpoint by 99 to 461 ms along x",
        "a: position lags the setpoint by 95 ms along y",
        "b: 2 rows repeat in 3.2 m/s^2",
    ]
    four = in_few_lines({name: [Finding(False, "1 row")] * (name != "e") for name in "abcde"})
    assert four == ["4 of 5 flights: 1 row"]


def test_a_slope_and_the_axis_that_explains_best_are_found():
    random = np.random.default_rng(1)
    x = random.normal(size=(500, 3))
    one = slopes(x, np.column_stack([-2.0 * x[:, 1], x[:, 1], x[:, 2]]), np.ones(500, dtype=bool))
    assert one[0].axis == 1
    assert abs(one[0].best + 2.0) < 1e-12
    assert abs(one[1].slope - 1.0) < 1e-12


def test_a_log_that_begins_on_the_ground_flies_once_it_has_left_that_height(flight):
    t = 0.01 * np.arange(1000)
    height = np.interp(t, [0.0, 4.0, 5.0, 6.0, 10.0], [0.0, 0.0, -0.5, 1.0, 1.0])  # it dips after the start
    motors = np.where(t < 2.0, 0.0, 0.5)[:, None] * np.ones(4)
    position = np.stack([0.0 * t, 0.0 * t, height], axis=1)
    one = dataclasses.replace(flight, time=t, motors=motors, channels={"position": position}, lost=np.zeros(1000, bool))
    assert t[one.flying].min() == pytest.approx(4.4, abs=0.3)
    airborne = dataclasses.replace(one, time=t[200:], motors=motors[200:], channels={"position": position[200:]})
    assert airborne.flying[0]


def test_a_log_that_begins_in_level_flight_flies(flight):
    t = 0.01 * np.arange(500)
    motors, still = np.full((500, 4), 0.5), 0.0 * t
    for there, flies in ((np.sin(t), True), (0.01 * np.sin(t), False)):
        position = np.stack([there, still, still + 3.0], axis=1)
        one = dataclasses.replace(flight, time=t, motors=motors, channels={"position": position}, lost=np.zeros(500, bool))
        assert one.flying.all() == one.flying.any() == flies


def test_rotors_that_never_turned_are_named(flight):
    still = [dataclasses.replace(flight, motors=flight.motors * np.array(share)) for share in ([0] * 4, [1, 0, 1, 0])]
    apart = flight.motors * (np.arange(flight.rows)[:, None] % 4 == np.arange(4))
    said = [never_flew(one) for one in (*still, dataclasses.replace(flight, motors=apart))]
    assert said == [
        f"never flew: {what}"
        for what in ("the rotors never turned", "rotors 2 and 4 never turned", "the rotors never all turned at once")
    ]


def test_a_log_without_a_flight_is_not_told_to_be_logged_faster(flight, monkeypatch):
    monkeypatch.setattr("quadstep.identify.logs.judge.SLOWEST", 0.5 * flight.period)
    assert any(FASTER in one.text for one in judge(flight))
    grounded = dataclasses.replace(flight, motors=0.0 * flight.motors)
    assert not any(FASTER in one.text for one in judge(grounded))
