"""The page that ships is the page that its sources give, byte for byte."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.frontend import FRONTEND, build_tools
from tests.needs import BUILD_TOOLS, NPM, needs, without

ROOT = Path(__file__).parent.parent
FONTS = Path("src/quadstep/report/fonts")
COLOURS = Path("src/quadstep/report/colours.css")
ASSETS = ROOT / "src" / "quadstep" / "page" / "assets"


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """A copy of the sources with their build tools: those installed beside them where they are the pinned ones."""
    folder = tmp_path_factory.mktemp("build") / "frontend"
    shutil.copytree(FRONTEND, folder, ignore=shutil.ignore_patterns("node_modules"))
    shutil.copytree(ROOT / FONTS, folder.parent / FONTS)
    shutil.copy(ROOT / COLOURS, folder.parent / COLOURS)
    if build_tools():
        (folder / "node_modules").symlink_to(FRONTEND / "node_modules")
        return folder
    done = subprocess.run(["npm", "ci"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode and any(
        word in done.stderr for word in ("ENOTFOUND", "ECONNREFUSED", "EAI_AGAIN", "ETIMEDOUT", "network")
    ):
        without(BUILD_TOOLS, "no registry can be reached")
    assert done.returncode == 0, done.stderr
    return folder


@needs(NPM)
def test_types_are_strict(sources):
    done = subprocess.run(["npm", "run", "--silent", "check"], cwd=sources, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@needs(NPM)
def test_page_is_what_its_sources_give(sources, tmp_path):
    done = subprocess.run(["node", "build.mjs", str(tmp_path)], cwd=sources, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name in ("page.html", "article.html", "LICENSES.txt"):
        assert (tmp_path / name).read_bytes() == (ASSETS / name).read_bytes(), f"{name}: run `make frontend` and commit it"
    script = ROOT / FONTS.parent / "report.js"
    assert (tmp_path / "report.js").read_bytes() == script.read_bytes(), "report.js: run `make frontend` and commit it"


def test_lock_pins_every_package_and_names_no_host():
    text = (FRONTEND / "package-lock.json").read_text()
    packages = json.loads(text)["packages"]
    assert '"resolved"' not in text
    assert all(package.get("integrity") for name, package in packages.items() if name)


def test_template_has_each_place_once():
    page = (ASSETS / "page.html").read_text()
    for place in (
        "<title>quadstep</title>",
        '<script id="quadstep-data" type="application/json">{}</script>',
        '<script id="quadstep-laws">0</script>',
    ):
        assert page.count(place) == 1
    assert len(page) < 1.5e6
