"""Writers of results whose n-th operation on files fails, is cut short or ends the process, for every n.

After each, nothing outside the folder has changed, what is in it can be used again by the same command, and that ends with the
same bytes as if nothing had happened, without anything half-written.
"""

import atexit
import errno
import os
import shutil
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest

from quadstep.io import results_folder as folder_module
from quadstep.io.errors import UserError
from quadstep.io.parts import GO_ON, parts_in
from quadstep.io.results_folder import RUNNING
from quadstep.report.publish import publishing
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.store import opened as open_campaign
from quadstep.studies.comparison.training import Journal, JournalPlace, read_lines
from quadstep.studies.rare.run_folder import FinishedPiece
from quadstep.studies.rare.run_folder import opened as open_estimate
from quadstep.studies.tuning.objective import Judged
from quadstep.studies.tuning.trial import Tried
from tests.campaigns import MASS
from tests.campaigns import campaign as made_campaign
from tests.commands import files

CALLS = ("open", "mkdir", "replace", "unlink", "rmdir", "fsync", "fdopen")
"""Functions of `os` that change something, or begin to."""


@pytest.fixture(autouse=True)
def no_disk(monkeypatch):
    """The disk of a test may be slow, and no test looks at what a loss of power leaves."""
    monkeypatch.setattr(os, "fsync", lambda _: None)


class Killed(BaseException):
    """The end of the process, at which nothing more can be written or removed."""


class Faults:
    """Operations on files, the n-th of which goes wrong. how: "fails", "kills"; of those that write, "breaks" or "tears" after
    half of it: with an error, or with the end of the process.
    """

    def __init__(self, how, place):
        self.how, self.place, self.count, self.dead = how, place, 0, False

    def __call__(self, real, *given, **more):
        """One operation. Once killed, a process does nothing more, whatever its code would do on the way out."""
        if self.dead:
            raise Killed
        if self.how in ("tears", "breaks"):
            return real(*given, **more)
        self.count += 1
        if self.count != self.place:
            return real(*given, **more)
        if self.how == "fails":
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        self.dead = True
        raise Killed

    def fdopen(self, real, handle, *given, **more):
        """A file whose content may come to half of it only."""
        file = self(real, handle, *given, **more)
        self.count += self.how in ("tears", "breaks")
        if self.how in ("tears", "breaks") and self.count == self.place:
            write = file.write

            class Torn:
                def __enter__(inner):  # noqa: N805
                    return inner

                def __exit__(inner, *_):  # noqa: N805
                    file.close()

                def write(inner, content):  # noqa: N805
                    write(content[: len(content) // 2])
                    file.flush()
                    if self.how == "breaks":
                        raise OSError(errno.EIO, os.strerror(errno.EIO))
                    self.dead = True
                    raise Killed

            return Torn()
        return file


@contextmanager
def faults(how, place):
    """Everything that these modules do with files goes through it."""
    layer = Faults(how, place)
    with pytest.MonkeyPatch.context() as patch:
        for name in CALLS:
            real, through = getattr(os, name), layer.fdopen if name == "fdopen" else layer
            patch.setattr(os, name, lambda *given, real=real, through=through, **more: through(real, *given, **more))
        rmtree = shutil.rmtree
        patch.setattr(folder_module.shutil, "rmtree", lambda *given, **more: None if layer.dead else rmtree(*given, **more))
        yield layer


# Writers


def flight(out):
    """A run that publishes a folder, in place of an earlier one with other files."""
    with publishing(out, "new", overwrite=True) as draft:
        (draft / "figures").mkdir()
        for name in ("flight.csv", "report.html", "figures/new.svg"):
            (draft / name).write_text(f"new {name}")
        (draft / "metrics.json").write_text('{"name": "new"}')


@cache
def mission():
    """A folder with a mission and campaigns of it."""
    folder = Path(mkdtemp())
    atexit.register(shutil.rmtree, folder)
    return folder


@cache
def flown(failure=""):
    """A campaign of three files, and its flights. failure: its limits."""
    made = made_campaign(mission(), MASS, head=f"chunk = 16\nflights = 48\n{failure}")
    return made, Flyer(made).fly(0, 48)


def campaign(out, failure=""):
    """`quadstep campaign` without its flying."""
    made, table = flown(failure)
    with open_campaign(out, made, 48, "lanes", resume=(out / "campaign.json").exists()) as store:
        for chunk in store.missing:
            store.write(chunk, table.slice(chunk.first, chunk.past - chunk.first))
        store.report(report)
        store.save(complete=True)


def estimate(out):
    """`quadstep campaign --rare` without its flying."""
    event = {
        "failure": "any",
        "score": ["a"],
        "probability": 0.1,
        "crude": 9,
        "crude_failures": 1,
        "failures": 1,
        "levels": [],
    }
    with open_estimate(out, flown()[0], (out / "rare.json").exists(), False) as kept:
        for number in range(len(kept.pieces), 2):
            kept.add(FinishedPiece(kind=f"{number}", method="subset", probability=0.1, flights=9, events=[event]))
        kept.report(report)
        kept.save(complete=True)


def report(out):
    """Write one."""
    (out / "report.html").write_text("report")
    (out / "figures/a.svg").write_text("figure")


def comparison(out):
    """A run that keeps parts, and publishes them."""
    with parts_in(out) as parts, publishing(out, "new", overwrite=True, code="mine") as draft:
        if parts.read("gains", "a") is None:
            journal = Journal(JournalPlace(out, ".writing-kept/journals/a.jsonl"))
            for number in range(2):
                if journal.next_generation([{"k": number}]) is None:
                    journal.add(number, [{"k": number}], [Tried(Judged(1.0, {"x": 2.0}, 0, 0.0, 1.0))])
            parts.add("gains", "a", b"gains of a")
        parts.publish(draft, [("gains", "a")])
        (draft / "metrics.json").write_text("{}")


def half_written(out):
    """What is, but for parts that are kept for the next run."""
    return [path for path in out.rglob(".writing-*") if "kept" not in path.name]


@pytest.mark.parametrize("writer", [flight, campaign, estimate, comparison])
@pytest.mark.parametrize("how", ["fails", "breaks", "kills", "tears"])
def test_whatever_goes_wrong_when_the_next_run_ends_as_if_nothing_had(tmp_path, writer, how):
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "thesis.txt").write_text("precious")

    def begun(out):
        if writer not in (campaign, estimate):
            with publishing(out, "old", overwrite=False) as draft:
                (draft / "figures").mkdir()
                for name in ("flight.csv", "old.html", "figures/old.svg"):
                    (draft / name).write_text("old")
                (draft / "metrics.json").write_text("{}")
            (out / "link").symlink_to(victim)

    begun(tmp_path / "straight")
    writer(tmp_path / "straight")
    wanted = files(tmp_path / "straight")
    for place in range(1, 1000):
        out = tmp_path / f"out{place}"
        begun(out)
        with faults(how, place) as layer, suppress(Killed):
            try:
                writer(out)
            except UserError as error:
                assert os.strerror(errno.EIO) in str(error), place
            except OSError:
                assert writer not in (campaign, estimate), place
        if layer.count < place:
            break
        assert files(victim) == {"thesis.txt": b"precious"}
        assert how != "breaks" or not half_written(out), place
        writer(out)
        assert files(out) == wanted, (how, place)
        assert not half_written(out), (how, place)
        shutil.rmtree(out)
    assert place > (20 if how in ("fails", "kills") else 2)
    assert files(tmp_path / f"out{place}") == wanted
    assert read_lines(JournalPlace(tmp_path / "straight", ".writing-kept/journals/a.jsonl")) == []


@pytest.mark.parametrize("writer", [campaign, estimate, comparison])
def test_a_folder_that_is_deleted_meanwhile_is_said_to_be_and_no_advice_goes_on_from_it(tmp_path, monkeypatch, writer):
    out, real, left = tmp_path / "out", folder_module.Folder.write, [2]

    def write(folder, *given, **more):
        left[0] -= 1
        if left[0] == 0:
            shutil.rmtree(out)
        real(folder, *given, **more)

    monkeypatch.setattr(folder_module.Folder, "write", write)
    if writer is comparison:
        left[0] = 1
    with pytest.raises(UserError) as raised:
        writer(out)
    assert str(raised.value) == f"{out}: was deleted, or replaced, while results were written into it; none are kept"


def test_a_comparison_on_a_full_disk_says_that_what_is_finished_is_kept_and_how_to_go_on(tmp_path):
    said = set()
    for place in range(1, 1000):
        out = tmp_path / f"out{place}"
        with faults("fails", place) as layer, suppress(OSError):
            try:
                comparison(out)
            except UserError as error:
                if list(out.glob(f"{RUNNING}/gains/a-*")) and "cannot be read" not in str(error):
                    said.add(str(error).replace(str(out), "out"))
        if layer.count < place:
            break
    assert said == {f"out: cannot be written: {os.strerror(errno.EIO)}; {GO_ON}"}


def test_a_campaign_whose_judging_was_cut_short_is_judged_as_whoever_resumes_it_says(tmp_path):
    campaign(tmp_path / "straight")
    wanted = files(tmp_path / "straight")
    strict = "[failure]\nlargest_error = 1e-9\n"
    for place in range(1, 1000):
        out = tmp_path / f"out{place}"
        shutil.copytree(tmp_path / "straight", out)
        with faults("kills", place) as layer, suppress(Killed):
            campaign(out, strict)
        if layer.count < place:
            break
        campaign(out)
        assert files(out) == wanted, place
        shutil.rmtree(out)
    assert place > 20
    assert files(out) != wanted
