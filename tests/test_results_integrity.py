"""No byte of a result is used that is not what was written, and none is continued by code other than began it."""

import ast
import json
import re
from pathlib import Path

import pytest

import quadstep
from quadstep.io import parts
from quadstep.io.errors import UserError
from quadstep.io.parts import parts_in, read_sealed, sealed
from quadstep.studies.campaign import cluster, manifest
from quadstep.studies.campaign.store import opened
from tests.campaigns import MASS, campaign, fly, refused, written
from tests.commands import quadstep as run_quadstep
from tests.commands import without_figures

SOURCE = Path(quadstep.__file__).parent
HEAD = "chunk = 16\nflights = 32\n"
CONTENT = {"name": "a é", "pieces": [1.5, {"x": 2}], "files": ["report.html"]}


def flipped(content):
    """This content with one bit flipped in every 64 bytes, at changing places."""
    for place in range(0, len(content), 64):
        spoilt = bytearray(content)
        spoilt[min(place + place // 64 % 64, len(content) - 1)] ^= 1 << place // 64 % 8
        yield bytes(spoilt)


def other_digits(text):
    """This text with each of its digits changed, one at a time."""
    for found in re.finditer("[0-9]", text):
        yield text[: found.start()] + str((int(found[0]) + 1) % 10) + text[found.end() :]


# Manifests


def test_a_manifest_reads_as_it_was_written(tmp_path):
    path = tmp_path / "m.json"
    path.write_bytes(sealed(CONTENT))
    assert read_sealed(path) == {**CONTENT, "sha256": json.loads(path.read_bytes())["sha256"]}
    assert sealed(read_sealed(path)) == path.read_bytes()


def test_a_manifest_with_a_changed_bit_or_digit_is_refused(tmp_path):
    path, whole = tmp_path / "m.json", sealed(CONTENT)
    bits = (whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :] for place in range(len(whole)))
    for spoilt in (*bits, *(text.encode() for text in other_digits(whole.decode()))):
        path.write_bytes(spoilt)
        try:
            assert "sha256" not in read_sealed(path)  # its name has changed: of an earlier version, which nothing continues
        except UserError as error:
            assert str(path) in str(error)


# Parts of comparisons


@pytest.mark.parametrize("kind", ["gains", "costs"])
def test_a_part_with_a_changed_bit_is_refused_by_its_name(tmp_path, kind):
    with pytest.raises(RuntimeError), parts_in(tmp_path) as one:
        one.add(kind, "key", json.dumps(CONTENT).encode())
        (path,) = tmp_path.glob(f".writing-kept/{kind}/*")
        whole = path.read_bytes()
        for spoilt in (*flipped(whole), *(text.encode() for text in other_digits(whole.decode()))):
            path.write_bytes(spoilt)
            with pytest.raises(UserError, match=re.escape(f"{path}: was changed")):
                one.read(kind, "key")
        path.write_bytes(whole)
        assert json.loads(one.read(kind, "key")).items() >= CONTENT.items()
        raise RuntimeError


# Campaigns and estimates


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A campaign: (its file, its folder)."""
    folder = tmp_path_factory.mktemp("whole")
    path = written(folder, MASS, head=HEAD)
    assert fly(path, folder / "out").code == 0
    return path, folder / "out"


def test_every_stored_file_of_a_campaign_is_checked_before_it_is_resumed(whole):
    path, out = whole
    same = campaign(path.parent, MASS, head=HEAD)
    for file in (out / "campaign.json", *sorted((out / "flights").iterdir())):
        content = file.read_bytes()
        spoilt = [*flipped(content)]
        if file.suffix == ".json":
            spoilt += [text.encode() for text in other_digits(content.decode())][::4]
        for one in spoilt:
            file.write_bytes(one)
            with (
                pytest.raises(UserError, match=f"{re.escape(str(file))}|its manifest has changed"),
                opened(out, same, 32, "lanes", resume=True),
            ):
                pass
        file.write_bytes(content)
    assert fly(path, out, "--resume").code == 0


def test_an_estimate_is_checked_before_it_is_resumed(tmp_path):
    path = written(tmp_path, MASS, head="[failure]\nposition_rmse = 1e-5\n")
    content = {
        "name": "camp", "version": quadstep.__version__, "decides": {}, "seed": 1, "precision": "f64", "campaign": "",
        "mission": "m", "machine": {}, "wanted": 6,
    }  # fmt: skip
    (tmp_path / "out").mkdir()
    file = tmp_path / "out" / "rare.json"
    file.write_bytes(sealed(content).replace(b'"wanted": 6', b'"wanted": 7'))
    refused(
        run_quadstep("campaign", path, "--rare", "--out", file.parent, "--resume"), file, "was changed after quadstep wrote it"
    )
    file.write_text(json.dumps(content))
    refused(run_quadstep("campaign", path, "--rare", "--out", file.parent, "--resume"), file.parent, "cannot be resumed")


# The code


def package():
    """The sources of the package."""
    return {path.relative_to(SOURCE).as_posix(): path.read_bytes() for path in SOURCE.rglob("*.py")}


LAWS = sorted(f"{room}/{path.name}" for room in ("control", "plants") for path in (SOURCE / room).glob("*.py"))


def changed_line(source):
    """The source with one operator or number of a function replaced, on one line; None where there is none."""
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.BinOp)
            and isinstance(node.op, ast.Mult | ast.Add)
            and node.left.end_lineno == node.right.lineno
        ):
            lines = source.splitlines()
            line, place = node.left.end_lineno - 1, node.left.end_col_offset
            sign = "*" if isinstance(node.op, ast.Mult) else "+"
            raw = lines[line].encode()
            lines[line] = (raw[:place] + raw[place:].replace(sign.encode(), b"-", 1)).decode()
            return "\n".join(lines)
    return None


def test_a_changed_line_of_any_law_or_plant_changes_the_digest_and_a_comment_or_docstring_does_not():
    tried = 0
    for name in LAWS:
        source = (SOURCE / name).read_text(encoding="utf-8")
        before = parts.meaning(ast.parse(source))
        commented = source.replace("\n\n\n", "\n\n# Another comment.\n\n", 1) + "\n# and one at the end\n"
        renamed = re.sub(r'"""([A-Z])', r'"""Otherwise said. \1', commented)
        assert parts.meaning(ast.parse(renamed)) == before, name
        other = changed_line(source)
        if other is not None:
            assert parts.meaning(ast.parse(other)) != before, name
            tried += 1
    assert tried > 30


def test_all_that_flies_counts_and_what_only_shows_does_not():
    files = {
        "control/law.py": b"x = 1", "control/weights.toml": b"w = 1",
        "studies/campaign/flyer.py": b"from quadstep.other import thing",
        "other/thing.py": b"y = 2", "other/__init__.py": b"", "studies/campaign/report.py": b"z = 3",
        "report/markup.py": b"p = 4",
        "other/alone.py": b"q = 5",
    }  # fmt: skip
    whole = parts.digest(files)
    assert {name: parts.digest({**files, name: content + b"5"}) != whole for name, content in files.items() if content} == {
        "control/law.py": True, "control/weights.toml": True, "studies/campaign/flyer.py": True, "other/thing.py": True,
        "studies/campaign/report.py": False, "report/markup.py": False, "other/alone.py": False,
    }  # fmt: skip


def test_what_decides_is_in_the_package():
    names = package()
    assert all(f"{name.replace('.', '/')}.py" in names for name in parts.ROOTS)
    places = {name.rpartition("/")[0] for name in names} | {name.removesuffix(".py") for name in names}
    assert places >= {one.replace(".", "/") for one in (*parts.ROOMS, *parts.SHOWING)}
    assert len(parts.code_digest()) == 16


@pytest.fixture
def other_code(monkeypatch):
    """The package after a change of a law."""
    monkeypatch.setattr(manifest, "code_digest", lambda: "another")


@pytest.mark.parametrize("complete", [True, False])
def test_a_campaign_is_not_continued_by_other_code(whole, tmp_path, other_code, complete):
    path, out = written(tmp_path, MASS, head=HEAD), tmp_path / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(manifest, "code_digest", parts.code_digest)
        assert fly(path, out).code == 0
    if not complete:
        (out / "flights/00001.parquet").unlink()
    refused(fly(path, out, "--resume"), out, "cannot be resumed: it was flown by other code of quadstep", "--overwrite")
    result = fly(path, out)
    refused(result, out, "cannot be resumed: it was flown by other code of quadstep", "--overwrite")
    assert "--resume" not in result.err


def test_a_replay_by_other_code_says_so_in_one_line(whole, tmp_path, other_code, monkeypatch):
    without_figures(monkeypatch)
    path, out = whole
    run = run_quadstep("fly", path, "--flight", "3", "--results", out, "--out", tmp_path / "again")
    assert run.code == 0
    assert re.fullmatch(r"quadstep: warning: .*this flight may differ .* flown by other code of quadstep\n", run.err)


def test_a_replay_of_a_changed_mission_says_so_in_one_line(whole, tmp_path, monkeypatch):
    without_figures(monkeypatch)
    path, out = whole
    mission = path.parent / "mission.toml"
    before = mission.read_text()
    mission.write_text(before.replace("0.4, 0.1, 0.2", "0.4, 0.1, 0.3"))
    try:
        run = run_quadstep("fly", path, "--flight", "3", "--results", out, "--out", tmp_path / "again")
    finally:
        mission.write_text(before)
    assert run.code == 0
    assert "this flight may differ" in run.err
    assert "its mission or a file it names has changed" in run.err


def test_parts_of_a_comparison_and_workers_of_a_cluster_are_those_of_the_same_code(monkeypatch):

    key, needs = parts.key("one"), cluster.needs()
    assert parts.key("one") == key
    for module in (parts, cluster):
        monkeypatch.setattr(module, "code_digest", lambda: "another")
    assert parts.key("one") != key
    assert cluster.needs() != needs
    with pytest.raises(UserError, match="has code of quadstep another"):
        cluster.refuse_others("here", needs)
