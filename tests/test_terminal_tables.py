"""Tables at every width: each word is whole, each value is there, nothing is wider than the screen."""

import contextlib
import io
import re

import pytest
from rich.cells import cell_len

from quadstep.mission.listings import load_preset, parameters
from quadstep.proofs.verify import registry
from quadstep.proofs.verify.registry import all_rows
from quadstep.report.screen import fitted, plain, say, say_whole, show_table

VEHICLE = (("key", "value", "unit", "meaning", "source"), [tuple(row) for row in parameters(load_preset("x500"))])
EQUATIONS = (
    registry.HEADER,
    [(row.number, row.what, row.where.removeprefix("quadstep."), row.verdict.value, row.reason) for row in all_rows()],
)
ERRORS = (("", "RMSE", "largest", "final"), [("theta [mrad]", "54.14", "150.6", "116.5"), ("x [mm]", "1", "2", "3")])
TABLES = {"vehicle": VEHICLE, "equations": EQUATIONS, "errors": ERRORS}


def printed(monkeypatch, columns, show, *arguments):
    """What a terminal of this width is sent."""
    monkeypatch.setenv("COLUMNS", str(columns))
    with contextlib.redirect_stdout(io.StringIO()) as out:
        show(*arguments)
    return out.getvalue()


def words(*texts):
    return {word for text in texts for word in text.split()}


@pytest.mark.parametrize("columns", [20, 40, 60, 80, 100, 120, 160, 200, 400])
@pytest.mark.parametrize("name", TABLES)
def test_every_word_is_whole_and_lines_fit_the_screen(monkeypatch, name, columns):
    header, rows = TABLES[name]
    text = printed(monkeypatch, columns, show_table, "", header, rows)
    cells = words(*(cell for row in rows for cell in row))
    assert cells <= words(text)
    assert not any(line.endswith(" ") for line in text.splitlines())
    longest = 4 + max(map(cell_len, cells | {f"{name}:" for name in header} | {row[0] for row in rows}))
    assert all(cell_len(line) <= max(columns, longest) for line in text.splitlines())


def test_a_column_is_no_narrower_than_its_words_and_what_is_short_is_not_broken():
    rows = [("a key of several words", "value", "a long text that goes on and on, further than any screen " * 3)]
    for columns in range(20, 300):
        widths = fitted([("key", "v", "text"), *rows], columns)
        if widths is None:
            assert columns < 22 + 5 + 24 + 2 * 2
            continue
        assert sum(widths) + 2 * 2 <= columns
        assert widths[:2] == [22, 5]
        assert widths[2] >= 24


def test_where_a_table_does_not_fit_every_row_is_a_block(monkeypatch):
    text = printed(monkeypatch, 40, show_table, "X500", VEHICLE[0], VEHICLE[1][:1])
    assert text.startswith("X500\n\nmass\n  value: 2.28\n  unit: kg\n  meaning: total mass\n  source: ")


def test_nothing_in_a_cell_or_sentence_speaks_to_the_terminal(monkeypatch):
    evil = "\x1b[31mred\x07\u202eback"
    for show in (say, say_whole, lambda text: show_table(text, ("a", "b"), [(text, text)])):
        text = printed(monkeypatch, 80, show, evil)
        assert not re.search("[\x00-\x09\x0b-\x1f\u202e]", text)
        assert r"\x1b[31mred\x07\u202eback" in text


def test_what_is_to_be_copied_is_never_broken(monkeypatch):
    line = "Report: " + "a folder/" * 30
    assert printed(monkeypatch, 40, say_whole, line) == line + "\n"
    assert plain("Γ 飛行 ±") == "Γ 飛行 ±"
