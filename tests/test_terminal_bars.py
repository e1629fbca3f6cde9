"""Bars as a terminal shows them."""

from quadstep.report import bars
from tests.campaigns import MASS, written
from tests.terminals import in_terminal


def test_a_campaign_without_a_number_of_flights_on_its_command_line_has_a_bar(tmp_path):
    file = written(tmp_path, MASS, head="flights = 6")
    shown = in_terminal("campaign", file, "--out", tmp_path / "out")
    assert shown.code == 0, shown.text
    assert "Traceback" not in shown.text
    assert "6/6" in shown.text
    assert "flights" in shown.text


def test_where_there_is_no_terminal_a_long_stage_is_told_a_line_a_minute(monkeypatch, capsys):
    clock = [0.0]
    monkeypatch.setattr(bars.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(bars, "EVERY", 60.0)
    with bars.bar("tuning", "flights") as shown:
        for second in range(200):
            clock[0] = float(second)
            shown.to(10 * second, 20_000)
        shown.doing("flying")
        clock[0] = 239.0
        shown.to(0, 100)
        clock[0] = 241.0
        shown.to(50, 100)
        shown.doing("linearising and costing", "jobs")
        clock[0] = 302.0
        shown.to(7, 10)
    assert capsys.readouterr().err.splitlines() == [
        "quadstep: tuning: 600 of 20,000 flights, about 32 min left",
        "quadstep: tuning: 1,200 of 20,000 flights, about 31 min left",
        "quadstep: tuning: 1,800 of 20,000 flights, about 30 min left",
        "quadstep: flying: 50 of 100 flights, about 1 min left",
        "quadstep: linearising and costing: 7 of 10 jobs",
    ]


def test_a_short_stage_says_nothing_where_there_is_no_terminal(capsys):
    with bars.bar("flying", "flights") as shown:
        shown.to(3, 10)
    assert capsys.readouterr().err == ""
