"""The documentation: every listing is valid, some run, and the reference has everything. `make docs` runs all of them."""

import itertools
import os
import re
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from docs.site import running
from docs.site.checking import check_toml
from docs.site.listings import Kind, listings
from docs.site.pages import DOCS, ROOT, name_of, pages, run_pages
from docs.site.reference import equations, keys
from docs.site.reference.commands import commands
from docs.site.reference.commands import page as commands_page
from docs.site.reference.files import page as files_page
from docs.site.reference.python import page as python_page
from docs.site.running import Ran, prepare
from docs.site.runs import run_one
from docs.site.writing import (
    MISSING,
    accessible,
    places,
    with_flights,
    with_links,
    with_listings,
    with_sections,
)
from tests.commands import write
from tests.needs import CHROMIUM, SITE, needs

PAGES = run_pages()
COMMANDS = dict(commands())


PAGE = """# Page

<!-- file: a.toml -->

```toml
[path]
type = "step"
end = [0.0, 0.0, 1.0]
```

    cat a.toml

```python
import matplotlib

x = 2 * matplotlib.rcParams["text.parse_math"]  # as a reader's own figure has it
```

```python
print(x + 1)
```

<!-- exit: 3 -->

    eval 'exit 3'

This fails:

    cat nothing

and this is a formula:

    a = b + c
"""


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    """A folder as listings have it, for what they name."""
    folder = tmp_path_factory.mktemp("reader")
    prepare(folder, ROOT / "README.md", [])
    return folder


def quadstep_lines(text):
    """The commands of quadstep in a shell listing, as words."""
    whole = text.replace(".venv/bin/quadstep", "quadstep").replace("\\\n", " ")
    for line in whole.splitlines():
        for part in re.split(r"&&|\||;", re.sub(r"\s#.*", "", line)):
            words = part.split(">")[0].strip()
            if words.startswith("quadstep ") and "..." not in words and "[" not in words:
                yield shlex.split(words)


def parsed(words):
    """Whether the command line takes these words; nothing is run."""
    words = [word for word in words if word not in ("--no-user-code", "--traceback")]
    count = 3 if " ".join(words[:3]) in COMMANDS else 2
    name = " ".join(words[:count])
    if name.startswith("quadstep --"):
        return True
    COMMANDS[name].make_context(name, list(words[count:]))
    return True


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_command_of_a_page_is_one_that_the_command_line_takes(page):
    for listing in listings(page.read_text(encoding="utf-8")):
        if listing.kind is Kind.SHELL:
            said = [listing.text, listing.marks.get("instead", "")]
            assert all(parsed(words) for text in said for words in quadstep_lines(text)), f"{page}:{listing.first + 1}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_file_that_a_command_takes_is_there_or_was_made_before(page, tmp_path):
    found = listings(page.read_text(encoding="utf-8"))
    prepare(tmp_path, page, found)
    made = set()
    for listing in found:
        if listing.kind is not Kind.SHELL or "not run" in listing.marks:
            continue
        text = listing.marks.get("instead", listing.text)
        made |= set(re.findall(r"> *(\S+)", text))
        for words in quadstep_lines(text):
            if words[1] == "new":
                made |= set(words)
            for before, word in itertools.pairwise(words):
                if before == "--out":  # `vehicle fit` writes a campaign, too
                    made |= {word, word.replace(".toml", "_campaign.toml")}
                elif word.endswith((".toml", ".csv")) and not word.startswith("out/"):
                    assert word in made or (tmp_path / word).is_file(), f"{name_of(page)}:{listing.first + 1}: {word}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_part_of_a_file_is_one_that_quadstep_reads(page, reader, monkeypatch):
    monkeypatch.chdir(reader)
    for listing in listings(page.read_text(encoding="utf-8")):
        if listing.kind is Kind.TOML and "not run" not in listing.marks:
            (reader / listing.marks.get("file", "listing.toml")).write_text(listing.text, encoding="utf-8")
            if 'file = "mine.toml"' not in listing.text:  # which a command of the page makes
                check_toml(listing.text, f"{name_of(page)}:{listing.first + 1}", reader)


def test_what_is_not_run_says_why_and_names_tests_that_are_there():
    for page in PAGES:
        for listing in listings(page.read_text(encoding="utf-8")):
            reason = listing.marks.get("not run", "because")
            assert reason.strip()
            assert all((ROOT / name).is_file() for name in re.findall(r"tests/\w+\.py", reason)), reason


def test_a_wrong_listing_is_found(reader):
    with pytest.raises(Exception, match=r"radius"):
        check_toml('[path]\ntype = "circle"\nradius = -1.0\nperiod = 3.0\n', "page", reader)
    with pytest.raises(Exception, match=r"unknown"):
        check_toml("[wind]\nspeed = 3.0\n", "page", reader)
    with pytest.raises(Exception, match=r"No such option"):
        parsed(["quadstep", "fly", "mission.toml", "--fast"])


def test_a_page_runs_from_the_top_down_and_says_what_failed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    before = Path.cwd()
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(running, "name_of", lambda _: "page.md")
            ran = running.run_page(page, tmp_path / "folder")
    finally:
        os.chdir(before)
    assert [one.status for one in ran] == ["checked", "ran", "ran", "ran", "ran", "failed", "not run"]
    assert ran[3].output == "3\n"
    assert "[path]" in ran[1].output
    assert "nothing: No such file" in ran[5].output


def test_rows_of_tables_have_the_cells_of_their_header():
    for path in (*pages(), ROOT / "README.md"):
        cells = None
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            found = len(re.findall(r"(?<!\\)\|", line)) if line.startswith("| ") or line.startswith("|--") else None
            assert found is None or cells in (None, found), f"{name_of(path)}:{number}: | of a text begins a cell"
            cells = found


def test_every_mention_of_a_page_is_of_one_that_is_there():
    mention = re.compile(r"\b(docs/(?:[\w-]+/)*[\w-]+\.(?:md|png|py))\b")
    made = {f"docs/reference/{name}.md" for name in ("commands", "python", "equations", "files", *keys.FILES)}
    texts = [
        *pages(),
        ROOT / "README.md",
        *(ROOT / "src").rglob("*.py"),
        *(ROOT / "examples").rglob("*.*"),
        *DOCS.glob("*.py"),
    ]
    for path in texts:
        if path.suffix in (".md", ".py", ".toml"):
            for name in {*mention.findall(path.read_text(encoding="utf-8"))} - made - {"docs/NAME.py", "docs/NAME.png"}:
                assert (ROOT / name).is_file(), f"{path} names {name}"


def test_every_file_of_python_that_a_page_names_with_its_folder_is_there():
    for path in (*pages(), ROOT / "README.md"):
        for name in re.findall(r"`(?!docs/)((?:[\w-]+/)+\w+\.py)`", path.read_text(encoding="utf-8")):
            assert (ROOT / name).is_file() or (ROOT / "src" / "quadstep" / name).is_file(), f"{path} names {name}"


def test_the_first_page_lists_every_page():
    lists = "".join((DOCS / name / "index.md").read_text(encoding="utf-8") for name in ("", "lessons", "decisions"))
    for place in {*places().values()} - {"index.md"}:
        assert re.search(rf"(^|[<(/]){place.removeprefix('lessons/').removeprefix('decisions/')[:-3]}\b", lists, re.M), place


def test_decisions_are_numbered_without_holes_and_every_one_that_is_named_is_there():
    numbers = sorted(path.name[:4] for path in (DOCS / "decisions").glob("0*.md"))
    assert numbers == [f"{one:04}" for one in range(1, len(numbers) + 1)]
    index = (DOCS / "decisions" / "index.md").read_text(encoding="utf-8")
    for path in (DOCS / "decisions").glob("0*.md"):
        title = path.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")
        assert f"- [{path.name[:4]}]({path.name}) {title}\n" in index
    for path in (*pages(), *(ROOT / "src").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert {*re.findall(r"\bdecisions/(0\d{3})", text)} <= {*numbers}, path


def test_contributing_fits_a_screen():
    lines = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 60
    assert max(map(len, lines)) <= 110


def test_every_file_of_the_package_says_what_it_is():
    rows = re.findall(r"^\| `(\w+\.py)` \| (.*) \|$", files_page(), re.MULTILINE)
    assert len(rows) == sum(1 for _ in (ROOT / "src").rglob("*.py"))
    assert not [name for name, text in rows if not text]


def test_every_picture_has_the_module_that_draws_it():
    for path in DOCS.glob("*.png"):
        assert path.with_suffix(".py").is_file(), path


def test_a_page_gets_output_links_and_what_flew(tmp_path):
    shown = with_listings("# T\n\n    quadstep vehicles\n", [Ran(3, "ran", "x500\n", 0.1)], showing=True)
    assert "```bash\nquadstep vehicles\n```" in shown
    assert ":class: printed\nx500\n```" in shown
    there = {"docs/ci.md": "ci.md"}
    assert with_links("See `docs/ci.md`.\n\n```text\n`docs/ci.md`\n```", "lessons/a.md", there).startswith(
        "See *[](../ci.md)*.\n\n```text\n`docs/ci.md`"
    ), "by its title"
    decisions = {"docs/decisions/0002": "decisions/0002-b.md"}
    assert with_links("(docs/decisions/0002)", "a.md", decisions) == "(*[](decisions/0002-b.md)*)"
    passed = "[docs/ci.md](ci.md), `make docs/ci.md`, src/docs/ci.md, docs/no.md"
    assert with_links(f"| a | docs/ci.md; b | {passed}", "lessons/a.md", there) == f"| a | *[](../ci.md)*; b | {passed}"
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "page.html").write_text("page")
    flown = with_flights("<!-- page: out/page.html | Live -->", tmp_path, tmp_path / "static", "lessons/a.md")
    assert 'src="../flown/' in flown
    flown = with_flights("<!-- page: out/page.html#nested | Live -->", tmp_path, tmp_path / "static", "lessons/a.md")
    assert (
        'page.html?figure=nested" title="Live"' in flown
    )  # a fragment would scroll the page around it and 'page.html">Live' in flown
    flown = with_flights("<!-- page: out/page.html#plot=attitude | Live -->", tmp_path, tmp_path / "static", "lessons/a.md")
    assert 'page.html#plot=attitude" title="Live"' in flown
    (tmp_path / "out" / "article.html").write_text("article")
    shown = with_flights("<!-- page: out/article.html#net | Net -->", tmp_path, tmp_path / "static", "lessons/a.md")
    assert 'src="../flown/article.html?figure=net"' in shown, "one copy for all that show it"
    (tmp_path / "out" / "x.svg").write_text('<?xml?><svg><g id="a"><text>t</text></g></svg>')
    drawn = with_flights("<!-- figure: out/x.svg | What to see -->", tmp_path, tmp_path / "static", "lessons/a.md")
    assert (
        "<text>t</text>" in drawn and "<figcaption>What to see</figcaption>" in drawn
    )  # with the site's type, not an image's
    formula = with_flights("<!-- figure: out/x.svg | Where $r_1$ is 0 -->", tmp_path, tmp_path / "static", "lessons/a.md")
    assert "<figcaption>Where <math>" in formula
    long = with_listings("# T\n\n    quadstep vehicles\n", [Ran(3, "ran", "a\n" * 99 + "Verdict\n", 0.1)], showing=True)
    assert "more lines" in long and long.rstrip().endswith("Verdict\n```")
    missing = with_flights("<!-- figure: out/x.svg | What to see -->", None, tmp_path / "static", "lessons/a.md")
    assert missing.startswith(MISSING) and "this figure" in missing, "nothing is shown where its listings have not run"


def test_a_page_of_many_sections_lists_them_after_its_introduction():
    text = "# T\n\nAnswer.\n\n## `quadstep fly`, at 1 s\n\n```\n## no section\n```\n\n## B\n\n## C\n\n## D\n"
    before, listed, after = re.split("^(?:::: ?.*)\n", with_sections(text), flags=re.MULTILINE)
    assert before == "# T\n\nAnswer.\n\n"
    assert listed.splitlines() == [
        "- [`quadstep fly`, at 1 s](#quadstep-fly-at-1-s)", "- [B](#b)", "- [C](#c)", "- [D](#d)",
    ]  # fmt: skip
    assert after.strip() == text.removeprefix(before).strip()
    assert with_sections(few := text.partition("## D")[0]) == few
    laws = "".join(f"### {number}\n\n" for number in range(12))
    listed = with_sections(f"# T\n\n## A\n\n{laws}## B\n\n## C\n\n## D\n")
    assert ":::{container} sections whole\n- [A](#a)\n  - [0](#0)\n" in listed


def test_the_site_has_the_colours_that_its_figures_name():
    settings = (DOCS / "site" / "conf.py").read_text(encoding="utf-8")
    assert re.search('^html_css_files = .*"colours.css"', settings, re.MULTILINE)


def test_the_site_is_made_for_readers_by_ear_and_keyboard():
    assert accessible('<p class="caption" role="heading">') == '<p class="caption" role="heading" aria-level="2">'
    assert accessible('<aside class="toc-drawer no-toc">') == '<aside aria-label="On this page" class="toc-drawer no-toc">'
    assert accessible('<link rel="shortcut icon" href="a.svg">') == '<link rel="icon" type="image/svg+xml" href="a.svg">'
    assert accessible('<div class="table-wrapper x">') == '<div tabindex="0" class="table-wrapper x">'
    assert accessible('<div class="highlight"><pre>x') == '<div class="highlight"><pre tabindex="0">x'


def test_the_reference_has_every_command_and_option():
    text = commands_page()
    for name, command in COMMANDS.items():
        assert f"## {name}\n" in text
        for option in command.params:
            assert option.name == "help" or option.help or option.name == "shown", f"{name} {option.name} has no help"
    assert not re.search("--[a-z]", re.sub("`[^`\n]*`", "", text)), "an option that breaks at its hyphens"


@pytest.mark.parametrize("name", keys.FILES)
def test_every_key_of_every_file_says_what_it_means(name):
    for found in keys.tables(name).values():
        for model in found:
            for one in keys.keys(model):
                table = "(#" in one.takes
                assert one.meaning or table or one.name == "type", f"{model.__name__}.{one.name}"
    assert len(keys.page(name)) > 500


def test_keys_say_unit_range_and_default():
    text = "".join(map(keys.page, keys.FILES))
    assert "| `radius` | radius of the circle | a positive number | m | needed |" in text
    assert " | a number from 3 to 305 | m | `6.096` |" in text
    assert "| `wheelbase` | distance between diagonally opposite motors | a number from 0.001 to 1000 | m | needed |" in text
    assert ' | `"standard"`, `"printed"`, `"rigid"` |  | `"standard"` |' in text
    assert re.search(
        r"^\| `k_x` \| stiffness of .* \| one or three positive numbers \| 1/s\^2 \| `14.61` \(x500\) \|$",
        text,
        re.M,
    )
    assert re.search(r"^\| `mass` \| value assumed .* \| the vehicle's \|$", text, re.M)
    assert "### rotation-backstepping: nets" in text
    assert "| `controller` | the control law | one of the tables " in text
    assert "the paper's disturbance (Eq. 67), plus" in text
    assert re.search(r"^\| `p_roll` .* \| a number from 0 to 250 \|", text, re.M)
    assert re.search(r"^\| `pitch` \|.* \| a number above 0 and below 1.5708 \|", text, re.M)
    assert "| six positive numbers |" in text
    assert "| a list of the tables [payload]" in text and "| a table, for each key one of [uniform]" in text
    assert "| name of the flight, shown in its results | text |  | the file's name |" in text
    assert '| `"cross-entropy"`, `"subset"` |' in text
    assert "default: " not in text and "| anything |" not in text
    assert "**Geometric tracking on SE(3).** Position and attitude loop in one" in text
    assert re.search(r"^\| `inputs` .* \| a list of lists of numbers \|", text, re.M)
    assert not re.search(r"from 0 from|list of an? |table of an? |table of values", text)


def test_the_index_of_equations_has_each_with_file_and_test():
    text = equations.page()
    for number in range(1, 76):
        (line,) = re.findall(rf"^\| {number} \|.*$", text, flags=re.MULTILINE)
        cells = line.split(" | ")
        assert (ROOT / cells[4].split("`")[3]).is_file()
        assert all((ROOT / "tests" / one).is_file() for one in re.findall(r"`(test_\w+\.py)`", cells[5]))
        assert "$" in cells[2] and "<details>" in cells[5] and "test_" in cells[5]
    assert equations.numbers("Eq. 5, Eqs 9 and 10, Eqs 68-70") == {5, 9, 10, 68, 69, 70}


def test_a_search_for_any_equation_finds_it():
    text = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    assert set(range(1, 76)) <= set(map(int, re.findall(r"\bEq\. (\d+)\b", text)))


def test_the_page_of_the_interface_has_its_names():
    text = python_page()
    for name in ("fly", "fly_all", "Mission", "Flight", "read_mission", "invert_force", "sqrt"):
        assert f"### {name}\n" in text


def test_a_tutorial_runs(tmp_path):
    ran = run_one(DOCS / "tutorials" / "first-flight.md", tmp_path, "")
    assert {one.status for one in ran} <= {"ran", "checked"}
    assert (tmp_path / "docs-tutorials-first-flight" / "out" / "windy" / "page.html").is_file()


@needs(SITE, CHROMIUM)
def test_long_tables_go_on_over_the_page_on_paper(tmp_path, browsers):
    furo = Path(find_spec("furo").origin).parent / "theme" / "furo" / "static" / "styles" / "furo.css"
    style = "".join(f"<style>{one.read_text(encoding='utf-8')}</style>" for one in (furo, DOCS / "site/static/theme.css"))

    text = "<tr><td><p>Eq. 1</p></td><td><p>counterexample</p></td></tr>" * 30
    table = f'<h2>Rows</h2><div class="table-wrapper container"><table class="docutils"><tbody>{text}</tbody></table></div>'
    page = browsers[False].page()
    page.goto(write(tmp_path, f'<!doctype html>{style}<article role="main">{6 * table}</article>', "a.html").as_uri())
    pages = len(re.findall(rb"/Type /Page\b", page.pdf(prefer_css_page_size=True)))
    assert pages < 6  # each takes over half a page: tables that are kept together would take one each
    browsers[False].blank()


@needs(CHROMIUM)
@pytest.mark.parametrize(("width", "beside"), [(1440, True), (360, False)])
def test_strips_of_a_figure_stand_beside_one_another_where_there_is_room(width, beside, tmp_path, browsers):
    strip = '<svg width="264pt" height="100pt" viewBox="0 0 264 100" style="--wide: 264"></svg>'
    style = (DOCS / "site/static/theme.css").read_text(encoding="utf-8")
    text = f'<style>{style}</style><article><figure><div class="drawn">{2 * strip}</div></figure></article>'
    page = browsers[False].page()
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(write(tmp_path, f"<!doctype html>{text}", "a.html").as_uri())
    first, second = (page.locator("svg").nth(i).bounding_box() for i in (0, 1))
    assert (first["y"] == second["y"]) is beside
    assert first["width"] <= width
    browsers[False].blank()


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A small site."""
    folder = tmp_path_factory.mktemp("site")
    said = "Again with --overwrite: it's \"-6 dB\" and 5e-6 kg m^2, not `'-6 x^2'`.\n\n$$a = b, \\qquad c = d$$"
    (folder / "index.md").write_text(f"# A\n\n{said}\n\n```{{toctree}}\nkeys\ncommands\nlessons/1\n```\n")
    (folder / "lessons").mkdir()
    (folder / "lessons" / "1.md").write_text(
        "# A\n\nFly first. The phase margin $\\dot x_{r1}$, of a mission.\n\nRaise `Lambda2` to 9.\n\n"
        "## Exercises\n\n1. Fly.\n2. Land.\n"
    )
    (folder / "keys.md").write_text(keys.page("campaign-file").replace("(docs/campaigns.md)", ""))
    (folder / "commands.md").write_text(commands_page())
    build = ["-m", "sphinx", "-b", "html", "-W", "-q", "-c", str(DOCS / "site"), str(folder), str(folder / "html")]
    done = subprocess.run([sys.executable, *build], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@needs(SITE, CHROMIUM)
def test_a_result_of_the_search_shows_the_sentence_that_holds_the_words(built, browsers):
    """From a disk too, where a browser reads no other page; its formula as text, its punctuation in place."""
    page = browsers[False].page()
    page.goto(f"{(built / 'search.html').as_uri()}?q=phase+margins")
    page.wait_for_selector("#search-results li p.context")
    assert (
        page.locator("#search-results li:has(a[href^=lessons]) p.context").inner_text()
        == "The phase margin x_r1, of a mission."
    )
    page.goto(f"{(built / 'search.html').as_uri()}?q=%CE%9B2")
    page.wait_for_selector("#search-results li:has(a[href^=lessons]) p.context:has-text('Raise Lambda2 to 9.')")
    page.goto(f"{(built / 'search.html').as_uri()}?q=qwertz")
    page.wait_for_function(
        "document.querySelector('#search-results p.search-summary')?.innerText.startsWith('No page has all')"
    )
    browsers[False].blank()


@needs(SITE)
def test_the_site_builds_without_a_warning(built):
    html = (built / "keys.html").read_text()
    assert 'id="uniform"' in html and re.search(r'<tr[^>]* id="[\w-]+-low"', html), "a key can be linked to"
    first = (built / "index.html").read_text()
    assert "with --overwrite: it’s “−6 dB” and 5\N{NO-BREAK SPACE}×" in first
    lesson = (built / "lessons" / "1.html").read_text()
    assert '<li id="exercise-2">' in lesson
    assert (
        '<a class="term reference internal" href="../glossary.html#crossover-phase-margin-gain-margin">phase margin' in lesson
    )
    assert '<div class="pair"><div class="equation"' in first
    assert "kg m², not" in first and "'-6</span> <span class=\"pre\">x^2'" in first
    fetched = re.findall(r'<(?:link|script|img)[^>]+(?:href|src)="(https?:[^"]+)"', html)
    assert fetched == []
