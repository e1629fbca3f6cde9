"""`quadstep serve --class`: what students can do, and what a hostile one cannot."""

import http.client
import json
import re
import socket
import time
from html import escape
from itertools import product
from typing import get_args
from urllib.parse import urlencode

import pytest

from quadstep.control.registry import controllers
from quadstep.interfaces.controller import Measured
from quadstep.io import user_code
from quadstep.io.errors import UserError
from quadstep.linear.grade import grade
from quadstep.mission.air import WindSection, in_words
from quadstep.mission.derived import section_of
from quadstep.mission.fields import Quantity
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.page import build
from quadstep.page.folder import FILE_KEYS
from quadstep.page.sharing import Access
from quadstep.report import units
from quadstep.studies import class_flight, classroom
from quadstep.studies.class_flight import (
    LARGEST_FILE,
    MANIFEST,
    MEMORY,
    NO_MISSION,
    SubmissionResult,
    flown_apart,
    fly_submission,
    submitted,
)
from quadstep.studies.class_pages import board, first_text, setting, student_page
from quadstep.studies.class_server import MOST_AT_ONCE, class_server
from quadstep.studies.classroom import ATTEMPTS, DRAFT, MOST_ATTEMPTS, MOST_LINES, SUBMISSION, Attempt, Room
from quadstep.vehicle.paper import State
from tests.browsers import axe
from tests.commands import quadstep
from tests.pages import STAND_IN, serving
from tests.patience import PATIENCE

MISSION = '[path]\ntype = "minimum-jerk"\nend = [0.0, 0.0, 1.0]\nduration = 1.0\n[vehicle]\nmass = 1.2\n'
CLASS = 'mission = "mission.toml"\nstudents = ["Ada", "Group <2>"]\n'
CODE = "raise SystemExit(open('{}', 'w').write('ran'))\nclass Law: pass\n"


@pytest.fixture
def room(tmp_path):
    (tmp_path / "mission.toml").write_text(MISSION)
    (tmp_path / "class.toml").write_text(CLASS.replace("<2>", "2"))
    (tmp_path / "out").mkdir()
    return Room(tmp_path / "class.toml", tmp_path / "out")


def flown(room, text):
    """What the class does with a submission, without a process of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(user_code, "refused", "never code")
        patch.setattr(build, "template", lambda: STAND_IN)
        patch.setattr(classroom, "flown_apart", lambda text, ground, out, _: attempted(text, ground, out))
        member = next(iter(room.members.values()))
        room.waiting.put((member, text))
        room.fly_next()
        return member


def attempted(text, ground, out):
    try:
        return fly_submission(text, ground, out)
    except UserError as error:
        return SubmissionResult(str(error))


def test_gains_are_flown_in_the_class_s_mission_and_the_best_two_flights_are_kept(room, tmp_path):
    values = [flown(room, f"[controller]\nK_r1 = {gain}\n").value for gain in (6.0, 8.0, 2.0)]
    member = next(iter(room.members.values()))
    assert values[0] > values[1] == values[2] > 0.0, "the worst flight changes nothing"
    assert sorted(one.name for one in member.folder.iterdir()) == ["2", "3", ATTEMPTS]
    content = json.loads((member.folder / "2" / MANIFEST).read_text())
    assert content["mission"]["controller"]["K_r1"] == [8.0] * 3
    assert content["mission"]["vehicle"]["mass"] == 1.2
    again = next(iter(Room(tmp_path / "class.toml", tmp_path / "out").members.values()))
    assert (again.value, again.best.number, again.latest.number) == (member.value, 2, 3), "the board outlives the server"
    assert again.attempts == member.attempts and len(again.attempts) == 3, "so does what became of each"


def test_a_student_is_told_what_was_wrong_with_a_flight_that_was_not_lost(room):
    told = flown(room, "[controller]\nK_r1 = 8.0\n").message
    assert told.startswith("Flown to its end, as commanded. Hovering at the start of its path, the loop is sound: ")
    member = flown(room, "[controller]\nK_r1 = 0.3\n")
    reasons = json.loads((member.folder / f"{member.latest.number}" / MANIFEST).read_text())["grade_reasons"]
    assert reasons and member.message.startswith(
        f"Flown to its end, but {' and '.join(reasons[:2])}. Hovering at the start of its path, "
    )
    assert "the loop is unstable: " in member.message and "A longer flight" not in member.message


def test_board_and_attempts_say_that_a_loop_is_fragile_and_what_limits_it(room, port, tmp_path):
    ada = flown(room, "[controller]\nLambda2 = 60.0\n")
    rest = grade(submitted(ada.text or ada.latest.text, room.ground))
    assert (rest.word, ada.latest.rest) == ("fragile", {"grade": "fragile", "why": rest.why})
    assert rest.why.startswith("phase margin ")
    short = re.fullmatch(r"(\w+ margin [\d.]+ ?(dB|°|ms)) in [^()]+ \(less than [^()]+\)", rest.why.partition(";")[0])[1]
    said = f"</span> fragile</b>: {escape(short)}</td>"
    text = ask(port, "/", next(iter(room.members)))[2]
    assert said in text.split('id="board"')[1].split("</table>")[0] and escape(rest.why) in text.split('id="attempts')[1]
    assert "A fragile loop may fail on a vehicle that differs" in text and ada.ranked
    assert ask(port, "/board.csv", room.teacher)[2].splitlines()[-1].endswith(",fragile")
    again = next(iter(Room(tmp_path / "class.toml", tmp_path / "out").members.values()))
    assert again.latest.rest == ada.latest.rest


@pytest.mark.parametrize(("asked", "ranked", "words"), [
    ("sound", ["sound"], " with a sound loop"), ("fragile", ["fragile", "sound"], " with a stable loop"),
    ("", ["", "fragile", "sound", "unstable"], ""),
])  # fmt: skip
def test_a_class_may_ask_for_a_loop_at_rest(tmp_path, asked, ranked, words):
    (tmp_path / "mission.toml").write_text(MISSION)
    (tmp_path / "class.toml").write_text(f'{CLASS.replace("<2>", "2")}loop = "{asked}"\n')
    (tmp_path / "out").mkdir()
    room = Room(tmp_path / "class.toml", tmp_path / "out")
    ada = next(iter(room.members.values()))
    for word in ("unstable", "fragile", "sound", ""):
        ada.attempts = []
        ada.counts("", SubmissionResult("", "as commanded", {ada.metric: 0.01}, {"grade": word} if word else {}))
        assert ada.ranked == (word in ranked) == bool(room.board()), word
        said = f"Attempt {ada.latest.number}: 10.0\u00a0mm, not ranked: the loop is {word or 'not known'}."
        assert (said in student_page(room, ada)) == (word not in ranked), word
        ada.counts("", SubmissionResult("", "as commanded", {ada.metric: 0.03}, {"grade": "sound", "why": "all margins"}))
        assert ada.ranked and ada.value == (0.01 if word in ranked else 0.03)
    text = student_page(room, ada)
    assert (
        f"of a flight as commanded{words} wins." in text
        and f"with the smallest position RMSE{words.replace(' with', ' and')}." in text
    )
    room.own = SubmissionResult("", "as commanded", {ada.metric: 0.02})
    names = re.findall(r"<tr><td>.</td><td>(?:<[bi]>)?([^<]*)<", board(room, ada))
    assert names[:2] == ["Ada (you)", "the class's own gains"], "which nobody knows to be sound"
    assert "<th>rank</th>" in board(room), "also where nobody is ranked"


def test_a_class_goes_on_where_a_student_s_folder_cannot_be_tidied(room):
    member = next(iter(room.members.values()))
    member.folder.write_text("in the way")
    said = flown(room, "[controller]\nK_r1 = 6.0\n").message
    assert said.startswith("This machine could not fly it:")
    assert not member.waits


def test_a_student_begins_with_the_gains_of_the_class(room):
    text = first_text(room.mission, room.ground)
    assert "# K_r1 = 3.0                # N s/m; gain of r1, the filtered error; the theorem requires K_r1 > m Lambda1" in text
    assert submitted(text.replace("\n# ", "\n"), room.ground).controller.K_r1 == (3.0, 3.0, 3.0)
    lines = text.splitlines()
    (one,) = first_text(room.mission, room.ground._replace(free=("controller.K_r1",))).splitlines()[2:]
    believed = [place for place, line in enumerate(lines) if "value assumed by the controller" in line]
    assert believed and lines.index(one) < min(believed)  # gains first
    assert not any(line.startswith("# K_") for line in lines[min(believed) :])
    ground = room.ground._replace(free=("path",))
    text = first_text(room.mission, ground)
    assert "# path.duration = 1.0\n" in text and "controller" not in text
    assert submitted(text.replace("# ", ""), ground).path == room.mission.path


def test_a_whole_mission_is_taken_where_only_free_keys_differ(room):
    law = '[controller]\ntype = "backstepping"\nnets.enabled = false\n'
    assert submitted(MISSION + law, room.ground).controller.nets.enabled is False
    assert submitted('[controller]\ntype = "completed-backstepping"\n', room.ground).vehicle.mass == 1.2


REFUSED = [
    ("[path]\nduration = 9.0\n", "path.duration: only controller may differ"),
    ("[vehicle]\nmass = 0.1\n", "vehicle.mass: only controller may differ"),
    ("[simulation]\nduration = 1e9\n", "simulation.duration: only controller may differ"),
    ('"controller.x" = 1\n[controller]\nx = 2\n', "is varied twice"),
    ('[controller]\ntype = "evil.py:Law"\n', "user code is not run"),
    ('[controller]\ntype = "os:system"\n', "user code is not run"),
    ('metrics = ["evil.py:Law"]\n', "metrics: only controller may differ"),
    ('[controller]\nnets.weights = "/etc/passwd"\n', "names a file"),
    ('[vehicle]\nfile = "/etc/passwd"\n', "vehicle.file: only controller may differ"),
    ('[controller]\ntype = "px4"\nconnect = "10.0.0.1:4560"\n', "controller"),
    ("[controller]\nK_r1 = nan\n", "K_r1"),
    ("controller = 3\n", "controller"),
    ("[" * 500, "nested too deep"),
    ("\x00\x1b[2J", "not valid TOML"),
    ("__import__('os').system('true')", "not valid TOML"),
]


@pytest.mark.parametrize(("text", "said"), REFUSED, ids=range(len(REFUSED)))
def test_code_files_and_other_missions_are_refused_and_leave_nothing(room, tmp_path, text, said):
    ran = tmp_path / "ran"
    (tmp_path / "evil.py").write_text(CODE.format(ran))
    try:
        member = flown(room, text)
    except ValueError as error:  # which the process of a flight turns into a sentence
        assert said in str(error)
        member = next(iter(room.members.values()))
    else:
        assert said in member.message
    assert not ran.exists()
    assert not member.folder.exists() or [one.name for one in member.folder.iterdir()] == [ATTEMPTS]
    assert member.value is None


AIRFRAME = MISSION.replace("mass = 1.2", 'preset = "x500"') + '[controller]\ntype = "pid"\n'


@pytest.mark.parametrize(
    "text", ['[controller]\ntype = "px4"\nconnect = "127.0.0.1:4560"\n', '[controller]\ntype = "ardupilot"\n']
)
def test_no_submission_opens_a_connection(tmp_path, text):
    (tmp_path / "mission.toml").write_text(AIRFRAME)
    (tmp_path / "class.toml").write_text(CLASS.replace("<2>", "2"))
    with pytest.raises(UserError, match="cannot be flown by an autopilot"):
        submitted(text, Room(tmp_path / "class.toml", tmp_path).ground)


def test_no_submission_reads_a_file_of_parameters(tmp_path):
    (tmp_path / "mission.toml").write_text(AIRFRAME)
    (tmp_path / "class.toml").write_text(CLASS.replace("<2>", "2"))
    (tmp_path / "secret").write_text("the first line")
    with pytest.raises(UserError, match="parameters: names a file, which a class does not read"):
        submitted(
            '[controller]\ntype = "px4-cascade"\nparameters = "secret"\n', Room(tmp_path / "class.toml", tmp_path).ground
        )


def test_every_key_of_a_mission_that_names_a_file_is_known():
    """What strangers send is checked by these names: a key that is new, and says so, must be among them."""
    laws = [section_of(law) for measures in (State, Measured) for law in controllers(measures).values()]
    assert {one for kind in (LagrangeMission, MultirotorMission, *laws) for one in file_keys(kind)} == {"name", *FILE_KEYS}, (
        "name is the file's own"
    )


def file_keys(kind):
    """The keys below a section whose meaning is that of a file."""
    for key, field in kind.model_fields.items():
        if any(isinstance(note, Quantity) and re.search(r"\bfile\b|\.json", note.meaning) for note in field.metadata):
            yield key
        for inner in sections_in(field.annotation):
            yield from file_keys(inner)


def sections_in(kind):
    if isinstance(kind, type):
        return [kind] if hasattr(kind, "model_fields") else []
    return [one for part in get_args(kind) for one in sections_in(part)]


def test_an_endless_mission_ends_with_its_time(room, tmp_path):
    ground = room.ground._replace(free=("simulation", "path"))
    text = "[simulation]\nduration = 20000.0\nlog_period = 1.0\nstep = 0.0002\n"
    found = flown_apart(text, ground, tmp_path / "flight", 1.0)
    assert found.message == "Not flown: it takes more memory, or more than 1 s of computing."
    assert not found.grade


def hoards(text, ground, out):
    return bytearray(2 * MEMORY)


def fills(text, ground, out):
    out.write_bytes(bytes(LARGEST_FILE + 1))


def idles(text, ground, out):
    time.sleep(PATIENCE)


def fails(text, ground, out):
    raise ValueError


@pytest.mark.parametrize(("does", "said"), [
    (hoards, "it takes more than 4 GB of memory."),
    (fills, "its files are larger than 100 MB: log less often, or for a shorter time."),
    (idles, "it takes more memory, or more than 1 s of computing."),
    (fails, "it is not a mission that can be flown."),
])  # fmt: skip
def test_each_limit_of_a_flight_says_which_it_is(room, tmp_path, monkeypatch, does, said):
    monkeypatch.setattr(class_flight, "fly_submission", does)
    monkeypatch.setattr(class_flight, "SLOWER", 1)
    found = flown_apart("", room.ground, tmp_path / "flight", 1.0 if does is idles else PATIENCE)
    assert found == SubmissionResult(f"Not flown: {said}")
    assert not (tmp_path / "flight").exists() or (tmp_path / "flight").stat().st_size == LARGEST_FILE


def test_a_class_that_is_restarted_says_what_it_kept(room, tmp_path):
    text = "[controller]\nK_r1 = 6.0\n"
    flown(room, text)
    ada, other = Room(tmp_path / "class.toml", tmp_path / "out").members.values()
    assert ada.message == "The class was restarted: your attempts were kept. Please resend anything still waiting."
    assert (ada.text, ada.latest.number, ada.waits) == (text, 1, False)
    assert other.message == "Nothing of yours has been flown yet."


def test_names_of_every_script_are_names(tmp_path):
    names = ["Ada", "अदिति", "José", "Jose\u0301 B", "王芳", "O'Neil, 2nd"]
    (tmp_path / "mission.toml").write_text(MISSION)
    (tmp_path / "class.toml").write_text(f'mission = "mission.toml"\nstudents = {json.dumps(names, ensure_ascii=False)}\n')
    assert [one.name for one in Room(tmp_path / "class.toml", tmp_path).members.values()] == names


def test_names_and_metrics_of_a_class_are_checked(tmp_path, monkeypatch):
    (tmp_path / "mission.toml").write_text(MISSION)
    for content, said in (
        (CLASS, r"students\[1\]: should be a name: at most 60 letters, digits"),
        (CLASS.replace("Group <2>", "../up"), "students"),
        (CLASS.replace("Group <2>", "ＡDA"), "'Ada' and 'ＡDA' are the same name to a reader"),
        (CLASS.replace("Group <2>", " Ada"), "should be a name"),
        (CLASS.replace("<2>", "2") + 'metric = "fame"\n', "class.toml: metric: 'fame' is not a metric"),
        (CLASS.replace("<2>", "2") + 'free = ["controler"]\n', "free: unknown key 'controler'; did you mean controller?"),
        (CLASS.replace("<2>", "2") + "seconds = 0.0\n", "seconds"),
        (CLASS.replace("<2>", "2").replace("mission.toml", "none.toml"), "file not found"),
    ):
        (tmp_path / "class.toml").write_text(content)
        with pytest.raises(UserError, match=said):
            Room(tmp_path / "class.toml", tmp_path)
        assert not (tmp_path / classroom.SECRET_NAME).exists()
    monkeypatch.setattr(user_code, "refused", "")  # put back when it has been served
    assert quadstep("serve", tmp_path, "--class", tmp_path / "class.toml").refused


# Requests


@pytest.fixture
def port(room):
    with serving(class_server(room, 0, Access())) as where:
        yield where


def ask(port, path, token=None, body=None, headers=None):
    """Status, headers and text of an answer; with a body to a POST."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    cookie = {"Cookie": f"quadstep-{port}={token}"} if token else {}
    connection.request("GET" if body is None else "POST", path, body, {**cookie, **(headers or {})})
    response = connection.getresponse()
    text = response.read().decode()
    connection.close()
    return response.status, dict(response.getheaders()), text


def test_a_student_submits_by_link_or_form_and_sees_the_board(room, port):
    ada, other = room.members
    status, headers, _ = ask(port, f"/?token={ada}")
    assert (status, headers["Location"]) == (303, "/")
    assert headers["Set-Cookie"].startswith(f"quadstep-{port}={ada}; Path=/; HttpOnly")
    assert ask(port, f"/submit?token={ada}", body="[controller]\n")[0] == 303
    assert ask(port, "/submit", other, urlencode({"mission": "[controller]\nK_r1 = 3.0\n"}))[0] == 303
    assert [room.waiting.get() for _ in range(2)] == [
        (room.members[ada], "[controller]\n"),
        (room.members[other], "[controller]\nK_r1 = 3.0\n"),
    ]
    room.members[other].counts("", SubmissionResult("", "flew, but", {room.ground.metric: 0.0123}))
    text = ask(port, "/", ada)[2]
    assert re.search(r'<td>Group 2</td><td[^>]*>12.3.mm</td><td><b class="fair">.*? flew, but not as commanded</b></td>', text)
    assert "Waiting to be flown" in text
    assert '<h2 id="submit">Submit</h2>' in text, "no level of headings is left out"
    assert "The smallest position RMSE of a flight as commanded wins. Other flights are not ranked." in text
    assert "You may change only the <code>[controller]</code> table." in text
    room.members[other].waits = False
    assert "[controller]\nK_r1 = 3.0\n</textarea>" in ask(port, "/", other)[2]
    assert ask(port, "/mission.toml", ada)[2] == MISSION


def test_nothing_of_others_and_nothing_else_is_sent(room, port):
    ada = next(iter(room.members))
    for member in room.members.values():
        (member.folder / "1").mkdir(parents=True)
        (member.folder / "1" / "page.html").write_text(f"page of {member.name}")
        member.attempts = [Attempt(1, 0.0, f"text of {member.name}", "", "as commanded", {})]
    assert ask(port, "/mine", ada)[2] == "page of Ada"
    assert ask(port, "/mine?student=Group%202", ada)[2] == "page of Ada"
    for path in (
        "/Group%202/1/page.html",
        "/mine/../Group%202/1/page.html",
        "/files/.class",
        "/.class",
        "/fly/Ada/1/",
        "//etc/passwd",
        "/2/1/page.html",
        "/1/1/page.html",
        "/mine/2/page.html",
        "/mine/1/flight.csv",
        "/board.csv",
        "/attempts.csv",
        "/links.csv",
    ):
        assert ask(port, path, ada)[0] == 404, path
    assert ask(port, "/mine/1/mission.toml", ada)[2] == "text of Ada"
    forged = ["", "0" * 32, ada[:-1], ada + "0", ada.upper(), "Ada", "é", "../" + ada]
    for token in forged:
        for path, body in (("/", None), ("/mine", None), ("/submit", "[controller]\n")):
            assert ask(port, path, token.encode("utf-8").decode("latin-1"), body)[0] == 403
    assert room.waiting.empty()
    assert ask(port, "/", ada, headers={"Host": "evil.example"})[0] == 421


def test_the_teacher_sees_everybody_s_attempts_and_sends_none(room, port):
    ada, other = room.members
    room.members[other].counts('name = "<b>"', SubmissionResult("Lost at 1 s.", "lost", {room.ground.metric: 1e-9}))
    text = ask(port, "/", room.teacher)[2]
    assert "1 of 2 students has flown" in text and "nothing sent" in text and "Lost at 1 s." in text
    room.members[ada].waits = True
    waiting = ask(port, "/", room.teacher)[2]
    assert "1 submission waiting" in waiting and "waiting</td>" in waiting and "nothing sent" not in waiting
    assert ada not in text and other not in text, "a projector shows no student's link"
    assert ask(port, "/2/1/mission.toml", room.teacher)[2] == 'name = "<b>"'
    for path in (
        "/0/1/mission.toml",
        "/3/1/mission.toml",
        "/1/1/mission.toml",
        "/2/1/page.html",
        "/mine",
        "/mine/1/mission.toml",
    ):
        assert ask(port, path, room.teacher)[0] == 404, path
    assert ask(port, "/submit", room.teacher, "[controller]\n")[0] == 403
    assert ask(port, "/links.csv", room.teacher)[2].splitlines()[1] == f"Ada,http://127.0.0.1:{port}/?token={ada}"
    assert ask(port, "/board.csv", room.teacher)[2].count("\n") == 1, "a lost flight is not ranked"
    assert re.search(r"\nGroup 2,1,[-\dT:]+,,lost,Lost at 1 s.,\n", ask(port, "/attempts.csv", room.teacher)[2])


def test_a_student_chooses_a_controller_and_finds_an_earlier_text_again(room, port):
    ada = next(iter(room.members))
    assert [*room.laws][:2] == ["backstepping", "completed-backstepping"]
    text = ask(port, "/laws", ada)[2]
    assert '<a href="/?law=completed-backstepping#submit">' in text
    assert "<td>more than 0</td>" in text and "<td>gain of the integral of r<sub>1</sub> (Eq. 24)</td>" in text
    assert "type = &quot;completed-backstepping&quot;" in ask(port, "/?law=completed-backstepping", ada)[2]
    assert "type = &quot;backstepping&quot;" in ask(port, "/?law=../x&again=9", ada)[2]
    for gain in (5.0, 6.0):
        room.members[ada].counts(f"# K_r1 = {gain} <", SubmissionResult("Refused."))
    assert "# K_r1 = 5.0 &lt;</textarea>" in ask(port, "/?again=1", ada)[2]
    assert "not flown" in ask(port, "/live", ada)[2]


def test_what_is_no_mission_of_the_class_is_refused_before_it_waits(room, port):
    ada = next(iter(room.members))
    for text, said in (
        ("[controler]\nK_r1 = 3.0\n", "controler: unknown key; did you mean controller? Allowed here: controller, "),
        ('"controller.x" = 1\n[controller]\nx = 2\n', f"{NO_MISSION}\n"),
        ("[controller\n", "not valid TOML"),
        ("[controller]\nK_rr1 = 3.0\n", "K_rr1"),
    ):
        status, _, answer = ask(port, "/submit", ada, text)
        assert status == 422 and said in answer
    assert room.waiting.empty() and not room.members[ada].attempts
    assert ask(port, "/submit", ada, "[controller]\n" + "# much\n" * MOST_LINES + "K_rr1 = 3.0\n")[0] == 303, "and no pause"


def test_the_class_s_own_flight_is_to_be_beaten(room, port, monkeypatch):
    ada = next(iter(room.members))
    assert [ask(port, path, ada)[0] for path in ("/try", "/path.svg")] == [404, 404]
    monkeypatch.setattr(build, "template", lambda: STAND_IN)
    monkeypatch.setattr(classroom, "flown_apart", lambda text, ground, out, _: attempted(text, ground, out))
    room.fly_own()
    text = ask(port, "/", ada)[2]
    own = units.quantity(room.own.numbers[room.ground.metric], "m")
    task = f"Ada: fly “{room.mission.name}” with the smallest position RMSE. The class’s own gains reach {own}."
    assert f'<p class="answer">{task}</p>' in text
    assert "Nobody has flown it yet." in text and re.search(rf"<i>the class’s own gains</i></td><td[^>]*>{own}<", text)
    assert ask(port, "/try", ada)[1]["Content-Type"] == "text/html; charset=utf-8"
    assert "<svg" in ask(port, "/path.svg", ada)[2]
    assert "<figcaption>Line: the class’s own gains. Pale band: the path asked for.</figcaption>" in text
    alone = ask(port, "/path.svg", ada)[2]
    flown(room, "[controller]\nK_r1 = 2.0\n")
    both = ask(port, "/path.svg?1", ada)[2]
    assert "stroke-dasharray" in both and "stroke-dasharray" not in alone
    assert "<b>Solid: your attempt 1.</b> Dashed: the class’s own gains." in ask(port, "/", ada)[2]
    assert ask(port, "/path.svg", room.teacher)[2] == alone, "the teacher sees the class's"
    room.members[ada].counts(
        "", SubmissionResult("", "as commanded", {room.ground.metric: 0.5 * room.own.numbers[room.ground.metric]})
    )
    assert "Beat" not in ask(port, "/", ada)[2], "what is beaten already"


def test_a_flight_that_was_not_as_commanded_is_not_ranked_and_all_rows_stand_by_value(room, port):
    ada, other = room.members.values()
    for word, value in (("as commanded", 0.03), ("flew, but", 0.001), ("as commanded", 0.04)):
        ada.counts("", SubmissionResult("", word, {room.ground.metric: value}))
    other.counts("", SubmissionResult("", "flew, but", {room.ground.metric: 0.002}))
    room.own = SubmissionResult("", "as commanded", {room.ground.metric: 0.035})
    assert (ada.value, other.value, room.board()) == (0.03, 0.002, [ada])
    token = list(room.members)[1]
    text = ask(port, "/", token)[2]
    rows = re.findall(r"<tr><td>(.)</td><td>(?:<[bi]>)?([^<]*)<", text.split('id="board"')[1])
    assert rows[:3] == [("1", "Ada"), ("–", "the class’s own gains"), ("–", "Group 2 (you)")]
    assert "Your smallest: 2.00\u00a0mm, not ranked: none of yours was as commanded. The best of the class: 30.0" in text
    mine = next(iter(room.members))
    assert "Your best: 30.0\u00a0mm, rank 1 of 1." in ask(port, "/", mine)[2], "and not behind the class’s own 35 mm"
    room.own = room.own._replace(numbers={room.ground.metric: 0.025})
    assert "Your best: 30.0\u00a0mm, behind the class’s own gains." in ask(port, "/", mine)[2]
    rows = re.findall(r"<tr><td>(.)</td><td>(?:<[bi]>)?([^<]*)<", ask(port, "/", token)[2].split('id="board"')[1])
    assert [name for _, name in rows[:2]] == ["the class’s own gains", "Ada"]


def test_the_record_of_attempts_has_an_end_and_keeps_the_best(room, tmp_path):
    member = next(iter(room.members.values()))
    for value in (1.0, *(2.0 for _ in range(MOST_ATTEMPTS + 3))):
        member.counts("", SubmissionResult("", "as commanded", {member.metric: value}))
    assert [one.number for one in member.attempts[:2]] == [1, 5]
    assert member.best.number == 1 and member.latest.number == MOST_ATTEMPTS + 4
    (member.folder / DRAFT).mkdir()
    assert len(next(iter(Room(tmp_path / "class.toml", tmp_path / "out").members.values())).attempts) == MOST_ATTEMPTS + 1
    assert not (member.folder / DRAFT).exists(), "what was being flown when it stopped"
    (member.folder / ATTEMPTS).write_text('[{"number": 1}]')
    with pytest.raises(UserError, match="is not the record of a student's attempts"):
        Room(tmp_path / "class.toml", tmp_path / "out")


def test_tokens_differ_between_students_and_classes_and_stay(room, tmp_path):
    again = Room(tmp_path / "class.toml", tmp_path / "out")
    assert list(again.members) == list(room.members)
    (tmp_path / "elsewhere").mkdir()
    others = Room(tmp_path / "class.toml", tmp_path / "elsewhere")
    assert len({*room.members, *others.members}) == 4
    assert (tmp_path / "out" / classroom.SECRET_NAME).stat().st_mode & 0o077 == 0


def test_a_flood_of_one_student_is_one_submission(room, port):
    ada, other = room.members
    statuses = [ask(port, "/submit", ada, "[controller]\n")[0] for _ in range(5)]
    assert statuses == [303, 429, 429, 429, 429]
    room.waiting.get()
    room.members[ada].waits = False
    status, _, text = ask(port, "/submit", ada, "[controller]\n")
    assert (status, text[:26]) == (429, "You can submit again in 20")
    room.members[ada].last = time.monotonic() - room.section.pause
    assert ask(port, "/submit", ada, "[controller]\n")[0] == 303
    assert ask(port, "/submit", other, "[controller]\n")[0] == 303, "others are not kept waiting"


def test_a_reader_whose_submission_is_refused_has_the_text_still_and_a_way_back(room, port):
    ada = next(iter(room.members))
    browser = {"Accept": "text/html,*/*;q=0.8"}
    assert ask(port, "/submit", ada, "[controller]\n")[0] == 303
    status, headers, text = ask(port, "/submit", ada, urlencode({"mission": "# <b>mine</b>\n"}), headers=browser)
    assert (status, headers["Content-Type"]) == (429, "text/html; charset=utf-8")
    assert "<b>Your last submission has not been flown yet.</b>" in text, "not rejected: nothing was judged"
    assert '<a href="/">' in text and "http-equiv" not in text
    assert "# &lt;b&gt;mine&lt;/b&gt;\n</textarea>" in text and "<b>mine" not in text
    status, _, text = ask(port, "/submit", ada, b"\xff", headers=browser)
    assert status == 400 and "text in UTF-8" in text and '<a href="/">' in text
    assert "Waiting to be flown" in ask(port, "/submit", ada)[2], "reloaded, it is the board"
    assert ask(port, "/submit", ada, "[controller]\n")[1]["Content-Type"].startswith("text/plain"), "in a terminal, one line"


@pytest.mark.parametrize(("length", "status"), [
    ("1" * 5000, 411),
    ("999999999", 413),
    (f"{3 * SUBMISSION.most + 1}", 413),
    ("-1", 411),
    ("1e3", 411),
    ("", 411),
    ("٣", 411),
])  # fmt: skip
def test_a_huge_submission_is_refused_before_it_is_read(room, port, length, status):
    ada = next(iter(room.members))
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as line:
        head = f"POST /submit?token={ada} HTTP/1.0\r\nHost: 127.0.0.1:{port}\r\nContent-Length: {length}\r\n\r\n"
        line.sendall(head.encode())
        assert f" {status} ".encode() in line.recv(100)
    assert room.waiting.empty()


@pytest.mark.parametrize("body", [b"\xff\xfe", b" ", b"x" * (SUBMISSION.most + 1), b"mission=a&mission=b&c=d", b"mission=%ff"])
def test_what_is_no_text_of_that_size_is_refused(room, port, body):
    assert ask(port, "/submit", next(iter(room.members)), body)[0] == 400
    assert room.waiting.empty()


def test_markup_in_a_submission_reaches_no_page(room, port):
    evil = "<script>alert(1)</script>"
    flown(room, f'name = "{evil}"\n[controller]\n"{evil}" = 1\n')
    text = ask(port, "/", next(iter(room.members)))[2]
    assert "alert(1)" in text
    assert evil not in text
    flown(room, f'name = "{evil}"\n')
    ada, member = next(iter(room.members.items()))
    assert member.latest.number == 2
    status, headers, text = ask(port, "/mine", ada)
    assert status == 200
    assert evil not in text
    assert "default-src 'none'" in headers["Content-Security-Policy"]


def test_one_address_cannot_keep_the_others_out(room, port):
    lines = [socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) for _ in range(MOST_AT_ONCE + 4)]
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as one:
            answer = one.makefile("rb").read().decode()
            assert answer.startswith("HTTP/1.0 503 "), "one more is answered at once"
            assert answer.endswith("\r\n\r\nToo many requests at once from your address: reload the page in a moment.\n")
    finally:
        for line in lines:
            line.close()
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            assert ask(port, "/", next(iter(room.members)))[0] == 200
            break
        except (ConnectionError, http.client.BadStatusLine):
            time.sleep(0.02)


def test_a_student_s_page_follows_the_class_and_keeps_what_is_written(room, port, browsers):
    ada, other = room.members
    page, errors = browsers[False].page(), []
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.goto(f"http://127.0.0.1:{port}/?token={ada}")
    assert axe(page) == []
    page.fill("textarea", "[controller]\nK_r1 = 6.0\n")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.locator("#said", has_text="Waiting to be flown.").wait_for()
    page.fill("textarea", "# the next one")
    room.members[ada].waits, room.members[ada].message = False, "Flown."
    room.members[other].counts("", SubmissionResult("", "as commanded", {room.ground.metric: 0.01}))
    page.locator("#board", has_text="as commanded").wait_for()
    page.locator("#said", has_text="Flown.").wait_for()
    assert page.input_value("textarea") == "# the next one"
    assert not errors
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.locator(".scroll").evaluate_all("all => all.filter(one => one.scrollWidth > one.clientWidth).length") == 0
    page.set_viewport_size({"width": 1280, "height": 720})
    page.goto(f"http://127.0.0.1:{port}/laws")
    page.click("summary")
    assert axe(page) == []
    page.goto(f"http://127.0.0.1:{port}/")
    for text, becomes in (
        ("[controller]\n# K_r1 = 3.0  # N s/m\n", "[controller]\nK_r1 = 3.0  # N s/m\n"),
        ("[controller]\nLambda1 = 2.0\n", "[controller]\nK_r1 = 3.0\nLambda1 = 2.0\n"),
        ("", "[controller]\nK_r1 = 3.0\n"),
        ("[controller]\nK_r1 = 7.5\n", "[controller]\nK_r1 = 7.5\n"),
    ):
        page.fill("textarea", text)
        page.get_by_label("Change K_r1").click()
        chosen = page.evaluate("text.value.slice(text.selectionStart, text.selectionEnd)")
        assert (page.input_value("textarea"), chosen) == (becomes, "7.5" if "7.5" in text else "3.0")
    page.goto(f"http://127.0.0.1:{port}/?law=completed-backstepping")
    page.locator("#gains", has_text="Gains of the controller “completed-backstepping”").wait_for()
    page.locator(".gains button").first.click()
    gain = page.locator(".gains td code").first.inner_text()
    assert page.input_value("textarea").startswith(
        '[controller]\ntype = "completed-backstepping"'
    ) and f"\n{gain} = " in page.input_value("textarea")
    page.fill("textarea", "[controller]\nK_r1 = 3.0\n")
    page.locator("#gains", has_text="Gains of the controller “backstepping”").wait_for()
    page.context.clear_cookies()
    page.goto(f"http://127.0.0.1:{port}/?token={room.teacher}")
    page.click("summary")
    room.members[ada].counts("", SubmissionResult("Refused just now."))
    page.locator("#attempts-1", has_text="Refused just now.").wait_for()
    page.click("text=Copy the link of Group 2")
    page.locator("button", has_text="Copied").wait_for()
    assert axe(page) == []
    page.set_viewport_size({"width": 1280, "height": 800})
    board, students = (page.locator(f"#{one}").bounding_box() for one in ("ranking", "students"))
    assert board["y"] == students["y"] and students["x"] > 600, "beside one another"


def test_the_task_says_what_is_flown(room):
    assert setting(room) == "the paper’s vehicle, a minimum-jerk path; flown for 1.00 s; wind: none."


def test_the_task_s_wind_is_none_only_where_the_air_rests():
    """Each part of a wind, off and on, alone and together with the others."""
    parts = {
        "mean": (0.0, 4.0), "swing": (0.0, 2.0), "gust": (0.0, 3.0), "wind_20": (0.0, 5.0), "intensity": ("", "light"),
    }  # fmt: skip
    for mean, swing, gust, wind_20, intensity in product(*parts.values()):
        turbulence = {"intensity": intensity} if intensity else {"wind_20": wind_20}
        wind = {"mean": [mean, 0.0, 0.0], "swing": [0.0, swing, 0.0], "swing_frequency": 1.0, "turbulence": turbulence,
                "gust": {"velocity": [gust, 0.0, 0.0], "start": 1.0, "length": 1.0}}  # fmt: skip
        built, said = WindSection(**wind).build(), in_words(wind)
        rests = not (any(built.mean) or any(built.swing) or any(built.gust) or built.turbulence.wind_20)
        assert (said == "none") == rests
        assert said.startswith("4\xa0m/s" if mean else "none" if rests else "no mean wind; ")
        assert ("a swing of 2\xa0m/s" in said, "a gust of 3\xa0m/s" in said) == (swing > 0.0, gust > 0.0)
        assert f"turbulence as for {built.turbulence.wind_20:.3g}\xa0m/s at 20\xa0ft" in said or not built.turbulence.wind_20
    assert in_words({"type": "wind.py:Own"}) == "“wind.py:Own”"
