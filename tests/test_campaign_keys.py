"""Keys of a campaign file, and what makes two campaigns the same."""

import json

import pytest

from quadstep.io.errors import UserError
from quadstep.mission.fields import overridden, with_value
from quadstep.mission.read import check_mission
from quadstep.studies.campaign.schema import read_campaign
from tests.campaigns import MASS, NOISY, SHORT, campaign, of, written

DEFAULTS = {"a": {"list": (1.0, 2.0, 3.0), "none": None}, "b": 5.0}


def test_a_value_is_set_in_a_copy():
    content = {"a": {"x": 1, "deep": {"y": 2}}, "b": 3, "list": [{"c": 1}, {"c": 2}]}
    before = json.dumps(content)
    assert with_value(content, "a.deep.y", 7, {}) == {**content, "a": {"x": 1, "deep": {"y": 7}}}
    assert with_value(content, "b", [1, 2], {})["b"] == [1, 2]
    assert with_value(content, "new.table.key", "x", {})["new"] == {"table": {"key": "x"}}
    assert with_value(content, "list.1.c", 5, {})["list"] == [{"c": 1}, {"c": 5}]
    assert json.dumps(content) == before


def test_a_list_that_is_not_there_or_is_one_number_comes_from_the_defaults():
    assert with_value({}, "a.list.1", 9.0, DEFAULTS) == {"a": {"list": [1.0, 9.0, 3.0]}}
    assert with_value({"a": {"list": 4.0}}, "a.list.0", 9.0, DEFAULTS) == {"a": {"list": [9.0, 2.0, 3.0]}}
    assert with_value({"a": {"list": [7.0, 8.0]}}, "a.list.0", 9.0, DEFAULTS) == {"a": {"list": [9.0, 8.0]}}


BAD_KEYS = ["", ".", "a.", ".a", "a..b", "a.list.3", "a.none.0", "b.c", "b.0", "c.0", "a.list.x", "a.list.-1", "a.list.²"]


@pytest.mark.parametrize("key", [*BAD_KEYS, "a.list." + "9" * 5000])
def test_a_key_that_leads_nowhere_is_one_line(key):
    with pytest.raises(UserError) as caught:
        with_value({"a": {"list": [1, 2, 3]}, "b": 5.0}, key, 1, DEFAULTS)
    assert key[:20] in str(caught.value)


def test_a_checked_mission_takes_anything_in_place_of_a_number():
    mission = check_mission({"path": {"type": "minimum-jerk", "end": [1, 2, 3], "duration": 2}}, "m")
    changed = overridden(overridden(mission, "path.end.1", "anything"), "vehicle.mass", None)
    assert changed.path.end == (1.0, "anything", 3.0)
    assert changed.vehicle.mass is None
    assert mission.path.end == (1.0, 2.0, 3.0)
    with pytest.raises(TypeError):
        overridden(mission, "vehicle.mass.x", 1)


# The file


def test_nested_and_quoted_keys_are_the_same():
    quoted = of('[vary]\n"a.b" = {type="uniform", low=0, high=1}\n"c.d.0" = {type="choice", values=[{type="x"}]}')
    dotted = of('[vary]\na.b = {type="uniform", low=0, high=1}\nc.d.0 = {type="choice", values=[{type="x"}]}')
    tables = of('[vary.a]\nb = {type="uniform", low=0, high=1}\n[vary.c.d.0]\ntype="choice"\nvalues=[{type="x"}]')
    assert quoted == dotted == tables
    assert quoted.keys == ["a.b", "c.d.0"]


def test_a_key_may_be_called_type():
    assert of('[vary.controller]\ntype = {type="choice", values=["pid"]}').keys == ["controller.type"]
    assert of('[vary]\n"controller.type" = {type="choice", values=["pid"]}').keys == ["controller.type"]


def test_nested_keys_draw_the_same_flights(tmp_path):
    first = campaign(tmp_path, '"vehicle.mass" = {type="uniform", low=1, high=2}')
    other = campaign(tmp_path, 'vehicle.mass = {type="uniform", low=1, high=2}')
    assert first.fingerprint == other.fingerprint


UNIFORM = '{type="uniform", low=0, high=1}'
TWICE = {
    "in vary and correlated": f'[vary]\n"a.b" = {UNIFORM}\n[[correlated]]\nkeys=["a.b", "c"]\nmean=[0,0]\n'
    "covariance=[[1,0],[0,1]]",
    "in two sets": "".join(f'[[correlated]]\nkeys=["a.b", "{c}"]\nmean=[0,0]\ncovariance=[[1,0],[0,1]]\n' for c in "cd"),
    "quoted and nested": f'[vary]\n"a.b" = {UNIFORM}\na.b = {UNIFORM}',
}


@pytest.mark.parametrize("name", TWICE)
def test_what_varies_twice_is_refused(name):
    with pytest.raises(UserError, match="is varied twice"):
        of(TWICE[name])


def test_a_place_has_one_spelling():
    with pytest.raises(UserError, match=r"'a\.00' is not a key"):
        of(f'[vary]\n"a.0" = {UNIFORM}\n"a.00" = {UNIFORM}')


def test_what_varies_as_a_whole_cannot_vary_inside():
    for text in (f'"a" = {UNIFORM}\n"a.b" = {UNIFORM}', f'"a.b.0" = {UNIFORM}\n"a.b" = {UNIFORM}'):
        with pytest.raises(UserError, match="is inside a"):
            of("[vary]\n" + text)
    assert of(f'[vary]\n"a.b" = {UNIFORM}\n"a.bc" = {UNIFORM}').keys == ["a.b", "a.bc"]


@pytest.mark.parametrize("key", ["name", "seed", "score_from"])
def test_what_changes_no_flight_cannot_vary(key):
    with pytest.raises(UserError, match=key):
        of(f'[vary]\n"{key}" = {UNIFORM}')


def test_what_counts_as_failure_is_a_metric_without_its_unit(tmp_path):
    assert of("[failure]\nposition_rmse = 0.1\neffort_thrust = 9").failure == {"position_rmse": 0.1, "effort_thrust": 9.0}
    for text in ("position_rmse = 0", "position_rmse = -1", 'position_rmse = "a"'):
        with pytest.raises(UserError, match="failure"):
            of("[failure]\n" + text)
    for text in ("speed = 1", '"position_rmse[m]" = 1'):
        with pytest.raises(UserError, match=r"failure\..*: unknown key; allowed here: position_rmse, largest_error, effort"):
            campaign(tmp_path, '"path.end.0" = ' + UNIFORM + "\n[failure]\n" + text)


def test_flights_left_out_are_all_combinations_of_the_grids(tmp_path):
    grids = '"vehicle.mass" = {type="grid", values=[1.0, 2.0]}\n"limits.rate" = {type="grid", low=1, high=2, count=7}\n'
    assert campaign(tmp_path, grids + '"path.end.0" = ' + UNIFORM).flights == 14
    assert campaign(tmp_path, grids, head="flights = 5").flights == 5
    assert campaign(tmp_path, '"path.end.0" = ' + UNIFORM).flights == 1


# What makes a campaign the same


BASE = "seed = 3\nchunk = 64\nflights = 10\nname = 'one'\n[failure]\nposition_rmse = 0.1\n"
SAME = {
    "flights": BASE.replace("flights = 10", "flights = 99"),
    "no flights": BASE.replace("flights = 10\n", ""),
    "name": BASE.replace("one", "two"),
    "failure": BASE.replace("position_rmse = 0.1", "position_rmse = 0.2"),
    "no failure": BASE.partition("[failure]")[0],
    "a remark": "# remark\n" + BASE,
}
OTHER = {
    "seed": BASE.replace("seed = 3", "seed = 4"),
    "precision": "precision = 'f32'\n" + BASE,
    "score period": "score_period = 0.1\n" + BASE,
}


def fingerprint(folder, head=BASE, vary=MASS, mission=SHORT):
    return campaign(folder, vary, mission, head).fingerprint


@pytest.mark.parametrize("name", SAME)
def test_a_campaign_is_the_same_whatever_decides_no_result(name, tmp_path):
    assert fingerprint(tmp_path, SAME[name]) == fingerprint(tmp_path)


@pytest.mark.parametrize("name", OTHER)
def test_another_head_is_another_campaign(name, tmp_path):
    assert fingerprint(tmp_path, OTHER[name]) != fingerprint(tmp_path)


CHANGED = {
    "a bound": MASS.replace("0.6", "0.5"),
    "another distribution": '"vehicle.mass" = {type="uniform", low=0.6, high=1.4}',
    "another key": MASS.replace("mass", "gravity"),
    "one more": MASS + '"path.end.0" = ' + UNIFORM,
    "fewer": "",
}


@pytest.mark.parametrize("name", CHANGED)
def test_what_varies_otherwise_is_another_campaign(name, tmp_path):
    assert fingerprint(tmp_path, vary=CHANGED[name]) != fingerprint(tmp_path)


def test_the_order_of_keys_decides_what_is_drawn(tmp_path):
    first, second = '"vehicle.mass" = {type="uniform", low=1, high=2}\n', '"path.end.0" = ' + UNIFORM + "\n"
    assert fingerprint(tmp_path, vary=first + second) != fingerprint(tmp_path, vary=second + first)


def test_another_mission_is_another_campaign_but_not_a_remark_in_it(tmp_path):
    assert fingerprint(tmp_path, mission=SHORT.replace("0.1, 0.2", "0.1, 0.3")) != fingerprint(tmp_path)
    assert fingerprint(tmp_path, mission="# remark\n" + SHORT) == fingerprint(tmp_path)


def weights(neurons=4, value=0.0):
    return json.dumps({"neurons": neurons, "seed": 1, "W1": [[value] * 3] * neurons, "W2": [[0.0] * 3] * neurons})


NETS = SHORT + '[controller]\ntype = "backstepping"\nnets = { neurons = 4, seed = 1, weights = "%s" }\n'


@pytest.mark.parametrize("name", ["weights.json", "weights", "x" * 220 + ".json", "deep/weights.json"])
def test_the_content_of_a_file_that_the_mission_names_counts(name, tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / name).write_text(weights())
    before = fingerprint(tmp_path, mission=NETS % name)
    assert fingerprint(tmp_path, mission=NETS % name) == before
    (tmp_path / name).write_text(weights(value=0.5))
    assert fingerprint(tmp_path, mission=NETS % name) != before


def test_the_content_of_a_file_that_varies_counts(tmp_path):
    for name in ("a.json", "b.json"):
        (tmp_path / name).write_text(weights())
    vary = '"controller.nets.weights" = {type="grid", values=["a.json", "b.json"]}'
    before = fingerprint(tmp_path, vary=vary, mission=NETS % "a.json")
    (tmp_path / "b.json").write_text(weights(value=0.5))
    assert fingerprint(tmp_path, vary=vary, mission=NETS % "a.json") != before


def test_the_content_of_a_file_inside_a_table_that_varies_counts(tmp_path):
    (tmp_path / "a.json").write_text(weights())
    inside = '{type="backstepping", nets={neurons=4, weights="a.json"}}'
    vary = f'"controller" = {{type="grid", values=[{inside}]}}'
    before = fingerprint(tmp_path, vary=vary)
    (tmp_path / "a.json").write_text(weights(value=0.5))
    assert fingerprint(tmp_path, vary=vary) != before


@pytest.mark.parametrize("changed", ["mine.toml", "base.toml"])
def test_a_vehicles_file_counts_and_so_does_the_file_that_it_starts_from(changed, tmp_path):
    text = NOISY.replace('preset = "research-2.6kg"', 'file = "mine.toml"')
    (tmp_path / "mine.toml").write_text('file = "base.toml"\ndescription = "mine"\n')
    (tmp_path / "base.toml").write_text('preset = "research-2.6kg"\n')
    before = fingerprint(tmp_path, mission=text)
    with (tmp_path / changed).open("a") as file:
        file.write("mass = 2.5\n")
    assert fingerprint(tmp_path, mission=text) != before


def test_a_mission_may_stand_in_the_campaign(tmp_path):
    path = tmp_path / "camp.toml"
    inside = SHORT.replace("[path]", "[mission.path]").replace("[simulation]", "[mission.simulation]").replace(
        "[start]", "[mission.start]")  # fmt: skip
    path.write_text(f"seed = 3\n[vary]\n{MASS}\n{inside}", encoding="utf-8")
    one = read_campaign(path)
    assert one.defaults["path"]["duration"] == 0.4
    assert one.content == campaign(tmp_path / "other", MASS, head="seed = 3").content


def test_a_campaign_reads_its_mission_from_its_own_folder(tmp_path, monkeypatch):
    path = written(tmp_path / "there", MASS)
    monkeypatch.chdir(tmp_path)
    assert read_campaign(path.relative_to(tmp_path)).content["path"]["duration"] == 0.4
