"""Bars as a terminal shows them."""

from tests.campaigns import MASS, written
from tests.terminals import in_terminal


def test_a_campaign_without_a_number_of_flights_on_its_command_line_has_a_bar(tmp_path):
    file = written(tmp_path, MASS, head="flights = 6")
    shown = in_terminal("campaign", file, "--out", tmp_path / "out")
    assert shown.code == 0, shown.text
    assert "Traceback" not in shown.text
    assert "6/6" in shown.text
    assert "flights" in shown.text
