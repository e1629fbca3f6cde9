"""What a browser shows of a class: to a student the board, the field and the own attempts; to the teacher everybody's."""

import json
import re
import time
from collections.abc import Collection
from html import escape
from operator import itemgetter
from typing import NamedTuple

from quadstep.interfaces.gain import BELIEF, Gain
from quadstep.io.files import is_file
from quadstep.linear.grade import UNSTABLE
from quadstep.metrics.registry import SOUND
from quadstep.metrics.verdict import FlightGrade
from quadstep.mission.air import in_words
from quadstep.mission.fields import dotted
from quadstep.mission.listings import commented, learning_numbers, number_lines, rounded, written
from quadstep.mission.schema import Mission
from quadstep.page.cards import grade_mark, part
from quadstep.page.folder import section
from quadstep.report import units
from quadstep.report.markup import Cell, disclosure, heading, page_text, paragraph, table
from quadstep.studies.class_flight import (
    LOG_NAME,
    MISSION_NAME,
    PAGE_NAME,
    RANKED,
    Ground,
    SubmissionResult,
    is_free,
    may_rank,
)
from quadstep.studies.classroom import Attempt, Member, Refusal, Room
from quadstep.studies.tuning.gains import filled_in

FIELD = "mission"


STYLE, SCRIPT = (part(name, "quadstep.studies") for name in ("class.css", "class.js"))


class Asked(NamedTuple):
    """With what a student's field is filled. refusal, text: of a submission that is not taken. again: number of an attempt.
    law: name of a controller.
    """

    refusal: Refusal | None = None
    text: str = ""
    again: str = ""
    law: str = ""


def student_page(room: Room, member: Member, asked: Asked = Asked()) -> str:  # noqa: B008 (frozen)
    """The page of a student as HTML, every text escaped."""
    words, gains = units.metric(room.ground.metric)[0], gains_table(room.mission, room.ground.free)
    why = f"<b>{escape(str(asked.refusal))}</b>{' Your text is below.' if asked.text else ''}"
    more = f', or <a href="/laws">choose another of the {len(room.laws)} controllers</a>' if len(room.laws) > 1 else ""
    body = [
        f'<p id="refused" role="alert">{why} <a href="/">Back to the board</a></p>' if asked.refusal else "",
        '<p id="offline" role="alert" hidden>The class does not answer. The board may be old; what you wrote stays here.</p>',
        student_news(room, member),
        '<div class="class"><section>', heading("Submit", "submit"),
        f'<form method="post" action="/submit" data-law="{room.mission.controller.type}">'
        f'<label for="text">To change a number, remove the # before it{more}. '
        f'What you leave out is as in <a href="/mission.toml">the class\'s mission</a>. You may change only '
        f'{only(room.ground)}.</label><textarea id="text" name="{FIELD}" rows="16" spellcheck="false">\n'
        f"{escape(field_text(room, member, asked))}</textarea>"
        '<button>Submit</button> <a href="/try">Try gains on the live page first</a> '
        '<span id="answer" role="status"></span></form>',
        "</section><section>", heading("Board", "ranking"),
        f"<p>The smallest {escape(words)} of a flight as commanded{RANKED[room.section.loop]} wins. Other flights are not "
        "ranked. A fragile loop may fail on a vehicle that differs a little from the model.</p>",
        board(room, member), "</section></div>",
        heading(f"Gains of the controller “{room.mission.controller.type}”", "gains", escape) if gains else "", gains,
        heading("Your attempts", "history"), attempts(member, "/mine"),
    ]  # fmt: skip
    return page_text(room.mission.name, [*body, SCRIPT], "Class", STYLE)


def only(ground: Ground) -> str:
    """What may be changed, as markup: "the [controller] table" for a key that has others below it."""
    tables = {one for one in ground.free if isinstance(ground.usual.get(one), dict)}
    return units.listed([f"the <code>[{escape(one)}]</code> table" if one in tables else f"<code>{escape(one)}</code>"
                         for one in ground.free])  # fmt: skip


def field_text(room: Room, member: Member, asked: Asked) -> str:
    """What a student's field holds."""
    chosen = next((one.text for one in member.attempts if f"{one.number}" == asked.again), "")
    if asked.law in room.laws and not asked.text:
        return first_text(room.laws[asked.law], room.ground)
    return asked.text or chosen or member.text or first_text(room.mission, room.ground)


def student_news(room: Room, member: Member) -> str:
    """What a student is told: the task, the result of the last submission, and the rank."""
    words = escape(units.metric(room.ground.metric)[0])
    own, ranked = own_number(room), room.board()
    goal = "" if own == "–" else f" The class's own gains reach {own}."
    task = f'<p class="answer">{escape(member.name)}: fly “{escape(room.mission.name)}” with the smallest '
    task += f"{words}{RANKED[room.section.loop].replace(' with', ' and')}.{goal}</p>"
    task += paragraph(setting(room), escape)
    path = flown_path(room, member.latest.number if member.latest else 0)
    waiting = f' data-waits="yes">{escape(member.message)}' if member.waits else f">{escape(member.message)}"
    first = "" if not ranked or ranked[0] is member else f" The best of the class: {shown(room, ranked[0])}."
    behind = own != "–" and (member.value or 0.0) > room.own.numbers[room.ground.metric]
    where = "behind the class's own gains" if behind else f"rank {place(ranked, member)} of {len(ranked)}"
    rank = f"Your best: {shown(room, member)}, {where}." if member in ranked else ""
    if member.best and not member.ranked:
        rank = f"Your smallest: {shown(room, member)}, not ranked: none of yours was as commanded{RANKED[room.section.loop]}."
    late, loop = member.latest, room.section.loop
    if late and late.grade == FlightGrade.AS_COMMANDED and not may_rank(late.grade, late.rest, loop):
        value = units.quantity(member.value_of(late) or 0.0, units.metric(room.ground.metric)[1])
        late_said = f"Attempt {late.number}: {value}, not ranked: the loop is {late.rest.get('grade', 'not known')}."
        rank = f"{late_said} {rank}" if member.ranked else late_said
    best = paragraph(f"{rank}{first}", str) if rank or first else ""
    return f'<div id="said">{path}<div>{task}<p role="status"{waiting}</p>{best}</div></div>'


def flown_path(room: Room, number: int = 0) -> str:
    """The picture of a student's attempt with this number, over the class's own flight; without one, of that alone."""
    mine = f"<b>Solid: your attempt {number}.</b> Dashed: the class's own gains." if number else "Line: the class's own gains."
    said = f"<figcaption>{mine} Pale band: the path asked for.</figcaption>"
    return f'<figure><img src="/path.svg?{number}" alt="">{said}</figure>' if room.own.grade else ""


def setting(room: Room) -> str:
    """What is flown, where, for how long and in which wind."""
    usual, ticks = room.ground.usual, room.mission.plan().ticks
    vehicle, path = (section(usual, key) for key in ("vehicle", "path"))
    size = (f"{key} {units.quantity(one, unit)}" for key, unit in SIZES.items() if isinstance(one := path.get(key), float))
    flown = [f"{vehicle.get('preset') or vehicle.get('file') or 'the paper’s vehicle'}", f"a {path.get('type')} path", *size]
    span, wind = units.number(ticks.last * ticks.step, 3), in_words(section(usual, "wind"))
    return f"{', '.join(flown)}; flown for {span} s; wind: {wind}."


SIZES = {"radius": "m", "length": "m", "width": "m", "period": "s"}
"""Of a path, which are said."""


def shown(room: Room, member: Member) -> str:
    return "" if member.value is None else units.quantity(member.value, units.metric(room.ground.metric)[1])


def place(ranked: list[Member], member: Member) -> int:
    """The same for equal values."""
    return 1 + sum((one.value or 0.0) < (member.value or 0.0) for one in ranked)


def board(room: Room, me: Member | None = None) -> str:
    """Who is best; to the teacher, for whom `me` is None, also who has sent nothing."""
    ranked, rows = room.board(), list[tuple[tuple[int, float], list[Cell]]]()
    for one in sorted(room.members.values(), key=lambda one: one.name):
        if me and not one.latest:
            continue
        chosen = one.best or one.latest or (one.attempts[-1] if one.attempts else None)
        name = escape(one.name) if me else f'<a href="#{anchor(room, one)}">{escape(one.name)}</a>'
        cells = (
            [grade(chosen), loop(chosen), when(chosen.at)] if chosen else ["waiting" if one.waits else "nothing sent", "", ""]
        )
        count = f"{one.attempts[-1].number if one.attempts else 0}"
        rank = f"{place(ranked, one)}" if one in ranked else "–", ""  # stays where nobody is ranked
        mine = (lambda text: f"<b>{text}</b>") if one is me else str
        value: Cell = (mine(shown(room, one) or "–"), "number")
        row: list[Cell] = [rank, mine(f"{name} (you)" if one is me else name), value, *cells, (count, "number")]
        rows.append((order(chosen, room.section.loop, one.value), row))
    words = escape(units.metric(room.ground.metric)[0])
    header = ("rank", "student", words, "grade", "loop at rest", "flown", "attempts")
    if room.own.grade:
        graded = grade_mark(room.own.grade), loop(room.own)
        own: list[Cell] = ["–", "<i>the class's own gains</i>", (own_number(room), "number"), *graded, "", ""]
        rows.append((order(room.own, room.section.loop, room.own.numbers.get(room.ground.metric)), own))
    none = "" if any(one.best for one in room.members.values()) else "<p>Nobody has flown it yet.</p>"
    told = table(header, [row for _, row in sorted(rows, key=itemgetter(0))], str) if rows else ""
    return f'<div id="board">{none}{told}</div>'


def order(flown: Attempt | SubmissionResult | None, loop: str, value: float | None) -> tuple[int, float]:
    """By what rows of the board are sorted: ranked flights, other completed ones, the rest; each by their value."""
    if flown is None or flown.grade not in (FlightGrade.AS_COMMANDED, FlightGrade.FLEW_BUT):
        return 2, 0.0
    return int(not may_rank(flown.grade, flown.rest, loop)), value or 0.0


def own_number(room: Room) -> str:
    """What the class's own gains reach; a dash where that is not known, or they lose the vehicle."""
    value = room.own.numbers.get(room.ground.metric) if room.own.grade not in ("", FlightGrade.LOST) else None
    return "–" if value is None else units.quantity(value, units.metric(room.ground.metric)[1])


def grade(attempt: Attempt) -> str:
    return grade_mark(attempt.grade) or "not flown"


def loop(flown: Attempt | SubmissionResult) -> str:
    """The grade of its loop at rest and, where it is fragile, why, as markup; empty where it is not known."""
    word, why = flown.rest.get("grade", ""), re.sub(r" in [^()]*\([^)]*\)", "", flown.rest.get("why", "").partition(";")[0])
    return ": ".join(filter(None, (grade_mark(word), "" if word in (SOUND, UNSTABLE) else escape(why))))


def when(at: float) -> str:
    """The time, and the day unless it is today."""
    then = time.localtime(at)
    return time.strftime("%H:%M" if then[:3] == time.localtime()[:3] else "%Y-%m-%d %H:%M", then)


def attempts(member: Member, base: str) -> str:
    """A student's attempts, the newest first. base: of their addresses."""
    symbol = units.metric(member.metric)[1]
    rows: list[list[Cell]] = []
    for one in reversed(member.attempts):
        value, links = member.value_of(one), [(f"{base}/{one.number}/{MISSION_NAME}", "text")]
        if base == "/mine":
            links = [(f"/?again={one.number}#submit", "into the field")]
        for name, words in ((PAGE_NAME, "live page"), (LOG_NAME, "log (CSV)")):
            links += [(f"{base}/{one.number}/{name}", words)] if is_file(member.folder / f"{one.number}" / name) else []
        rows.append([
            f"{one.number}{' (best)' * (one is member.best)}", when(one.at),
            ("–" if value is None else units.quantity(value, symbol), "number"),
            grade(one), escape(one.said), " ".join(f'<a href="{address}">{words}</a>' for address, words in links),
        ])  # fmt: skip
    header = ("attempt", "flown", escape(units.metric(member.metric)[0]), "grade", "result", "open")
    return f'<div id="attempts{base.replace("/", "-")}">{table(header, rows, str) if rows else "<p>None yet.</p>"}</div>'


def anchor(room: Room, member: Member) -> str:
    return f"student-{list(room.members.values()).index(member) + 1}"


def teacher_page(room: Room) -> str:
    """What the teacher sees: who has sent what."""
    tables = {"board": "Board (CSV)", "attempts": "All attempts (CSV)", "links": "The students' links (CSV)"}
    links = "".join(f'<li><a href="/{name}.csv" download>{words}</a></li>' for name, words in tables.items())
    students = [
        f'<div id="{anchor(room, one)}"><button type="button" hidden data-link="{number}">Copy the link of {escape(one.name)}'
        f"</button>{disclosure(f'{one.name}: attempts', attempts(one, f'/{number}'))}</div>"
        for number, one in enumerate(room.members.values(), 1)
    ]
    body = [
        '<p id="offline" role="alert" hidden>The class does not answer. The board may be old.</p>',
        teacher_news(room), '<div class="class"><section>', heading("Board", "ranking"), board(room),
        f'<ul class="screen">{links}</ul></section><section>', heading("Students", "students"), *students, "</section></div>",
    ]  # fmt: skip
    return page_text(f"Teacher’s page: {room.mission.name}", [*body, SCRIPT], "Class", STYLE)


def teacher_news(room: Room) -> str:
    members = room.members.values()
    flown, waiting = sum(bool(one.latest) for one in members), sum(one.waits for one in members)
    text = f"{flown} of {units.counted(len(members), 'student')} {'has' if flown == 1 else 'have'} flown; "
    text += f"{units.counted(waiting, 'submission')} waiting."
    said = f'<p class="answer" role="status" data-waits="yes">{text}</p>{paragraph(setting(room), escape)}'
    return f'<div id="said">{flown_path(room)}<div>{said}</div></div>'


def live(room: Room, member: Member | None, unfolded: Collection[str] = ()) -> str:
    """What of a page changes while it is open. unfolded: the numbers of students whose attempts the teacher looks at."""
    if member is None:
        looked_at = [(number, one) for number, one in enumerate(room.members.values(), 1) if f"{number}" in unfolded]
        return teacher_news(room) + board(room) + "".join(attempts(one, f"/{number}") for number, one in looked_at)
    return student_news(room, member) + board(room, member) + attempts(member, "/mine")


def laws_page(room: Room) -> str:
    """Every controller that may be submitted, and its gains."""
    body = ['<p><a href="/">Back to the board</a></p>']
    for name, mission in room.laws.items():
        law = mission.controller.controller
        own = " (the class's)" if mission is room.mission else ""
        shown = gains_table(mission, room.ground.free) or paragraph("No gains that may be changed.")
        begin = f'<p><a href="/?law={escape(name)}#submit">Begin with {escape(name)}</a></p>'
        body.append(f'<div id="{escape(name)}">{disclosure(f"{name}: {law.label or name}{own}", begin + shown)}</div>')
    return page_text("Controllers and gains", body, "Class", STYLE)


def free_gains(mission: Mission, free: tuple[str, ...]) -> list[tuple[str, Gain]]:
    """By key, those that may be changed, what the controller believes of the vehicle last."""
    found = [(key, gain) for key, (_, gain) in mission.controller.controller.by_key().items()]
    return sorted((one for one in found if is_free(f"controller.{one[0]}", free)), key=lambda one: one[1].group == BELIEF)


def gains_table(mission: Mission, free: tuple[str, ...]) -> str:
    """The free gains of a mission's controller, with what may be written; "" without any."""
    values, rows = filled_in(mission), []
    for key, gain in free_gains(mission, free):
        given = values[key]
        parts = given if isinstance(given, tuple) else (given,)
        low, high, _ = gain.span(min(parts), max(parts))
        rows.append([f"<code>{escape(key)}</code>", written(rounded(given), gain.stands_for_three), units.rich(gain.unit),
                     f"{float(f'{low:.3g}'):g} to {float(f'{high:.3g}'):g}", allowed(gain),
                     units.rich(gain.meaning)])  # fmt: skip
    header = ("gain", "default", "unit", "range of its slider", "allowed", "meaning")
    return f'<div class="gains">{table(header, rows, str)}</div>' if rows else ""


def allowed(gain: Gain) -> str:
    """Which values a mission may give."""
    if gain.only:
        return f"{'whole numbers, ' if gain.only == 'whole' else ''}{gain.low:g} to {gain.high:g}"
    return "any" if gain.signed else "0 or more" if gain.zero else "more than 0"


def first_text(mission: Mission, ground: Ground) -> str:
    """What a student begins with: what is free, commented out, with values, units and meanings; "" without any."""
    values, law, free = filled_in(mission), mission.controller.controller, ground.free
    keys = {key: one for key, one in dotted(ground.usual).items() if not key.startswith("controller.")}
    others = [f"# {key} = {json.dumps(value)}" for key, value in keys.items() if value is not None and is_free(key, free)]
    gains = (
        (f"# {key} = {written(rounded(values[key]), one.stands_for_three)}", one) for key, one in free_gains(mission, free)
    )
    lines = [commented(text, one.unit, one.meaning) for text, one in gains]
    nets = mission.controller.table
    if nets and is_free("controller.nets", free):
        derived = learning_numbers(law, mission.controller.gains(mission.modelled.model()))
        shown = derived | {key: value for key, value in nets if value is not None}
        lines += ["", "[controller.nets]", *number_lines(type(nets), shown)]
    return "\n".join((*others, *(("[controller]", f'type = "{mission.controller.type}"', *lines) if lines else ()), ""))
