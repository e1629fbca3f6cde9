"""A TOML file with a few values changed."""

import tomllib

import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st

from quadstep.studies.tuning.run import edited

NEW = [9.0, 8.0, 7.5]


def changed(text, **controller):
    """The text with keys of the controller set, read back."""
    old = tomllib.loads(text)
    new = {**old, "controller": {**old.get("controller", {}), **controller}}
    result = edited(text, old, new)
    assert tomllib.loads(result) == new
    return result


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("[controller] # c\n  k = [1, 2, 3] # why\nb = 1\n", "[controller] # c\n  k = [9.0, 8.0, 7.5]\nb = 1\n"),
        ("[controller]\nk = [\n  1, # one ]\n  2,\n  3,\n] # end\nb = 1", "[controller]\nk = [9.0, 8.0, 7.5]\nb = 1"),
        ("controller.k = [1, 2]\n[path]\nk = [1, 2]\n", "controller.k = [9.0, 8.0, 7.5]\n[path]\nk = [1, 2]\n"),
        ('[ controller ]\n"k"\t=\t[1]', '[ controller ]\n"k"\t=\t[9.0, 8.0, 7.5]'),
        ("[a]\nk = 1\n[controller]\nx = 2 # x\n\n[b]\n", "[a]\nk = 1\n[controller]\nx = 2 # x\nk = [9.0, 8.0, 7.5]\n\n[b]\n"),
        ("[controller]\n", "[controller]\nk = [9.0, 8.0, 7.5]\n"),
        ("[controller]", "[controller]\nk = [9.0, 8.0, 7.5]\n"),
        ("a = 1", "a = 1\n\n[controller]\nk = [9.0, 8.0, 7.5]\n"),
        (
            'a = "[controller]\\" # k = 1"\n[controller]\nk = 1\n',
            'a = "[controller]\\" # k = 1"\n[controller]\nk = [9.0, 8.0, 7.5]\n',
        ),
        (
            "a = '''\n[controller]\nk = 1\n'''\n[controller]\nk=1",
            "a = '''\n[controller]\nk = 1\n'''\n[controller]\nk=[9.0, 8.0, 7.5]",
        ),
        ('a = """x\\""""\n[controller]\nk=1', 'a = """x\\""""\n[controller]\nk=[9.0, 8.0, 7.5]'),
        ("# k = 1\n[controller]\n#k = 1\nk = 1\n", "# k = 1\n[controller]\n#k = 1\nk = [9.0, 8.0, 7.5]\n"),
        ("[[e]]\nk = 1\n[[e]]\nk = 2\n[controller]\nk = 1", "[[e]]\nk = 1\n[[e]]\nk = 2\n[controller]\nk = [9.0, 8.0, 7.5]"),
        ('controller = { type = "x", k = 1 } # one line\n', 'controller = { type = "x", k = [9.0, 8.0, 7.5] } # one line\n'),
    ],
)
def test_only_the_value_changes(text, wanted):
    assert changed(text, k=NEW) == wanted


def test_nested_tables():
    text = "[controller]\ntype = 'x'\nnets.start = 1.0 # late\n[controller.more]\nF1 = 2.0\n"
    result = changed(text, nets={"start": 3.0}, more={"F1": 4.0, "F2": 5.0})
    assert result == "[controller]\ntype = 'x'\nnets.start = 3.0\n[controller.more]\nF1 = 4.0\nF2 = 5.0\n"


def test_what_cannot_be_edited_is_written_anew():
    text = "controller.type = 'x' # gone\na = 'b \"c\" \\ \t'\n[[e]]\nk = [{ z = true }]\n"
    old = tomllib.loads(text)
    new = {**old, "controller": {"type": "x", "k": NEW}, "e": [{"k": [{"z": False}]}]}
    result = edited(text, old, new)
    assert tomllib.loads(result) == new


def test_nothing_to_change_leaves_the_text():
    text = "[a]\r\nb = 1 # c\r\n"
    assert edited(text, tomllib.loads(text), tomllib.loads(text)) == text


NAMES = st.text(st.characters(exclude_categories=("Cs",)), max_size=4)
SCALARS = st.integers(-9, 9) | st.floats(allow_nan=False, allow_infinity=False) | st.booleans() | NAMES
VALUES = st.recursive(SCALARS, lambda one: st.lists(one, max_size=3) | st.dictionaries(NAMES, one, max_size=3), max_leaves=8)


@given(st.dictionaries(NAMES, VALUES, max_size=4))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_any_content_reads_back(content):
    assert tomllib.loads(tomlkit.dumps(content)) == content


@given(st.dictionaries(NAMES, VALUES, max_size=3), st.dictionaries(NAMES, VALUES, max_size=3))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_any_change_reads_back(old, more):
    new = {**old, **more}
    assert tomllib.loads(edited(tomlkit.dumps(old), old, new)) == new
