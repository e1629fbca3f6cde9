"""Takes docs/page.png, the picture of the README: a flight in the page. Run: python docs/page.py [FOLDER]; needs Chromium."""

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from quadstep.mission.template import template
from quadstep.page.build import fly_missions

HERE = Path(__file__).parent
NAME = '# name = "My first flight"', 'name = "An X500 in a wind of 6 m/s"'
WIND = "mean = [6.0, 0.0, 0.0]"
OPTIONS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
)


def main(folder: Path = HERE) -> None:
    """Fly a mission in the page, let it run for some seconds, take its picture."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        print("docs/page.png is taken with Chromium, which is not here: the picture stays")
        return
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as browsers:
        page, mission = Path(temporary) / "page.html", Path(temporary) / "mission.toml"
        mission.write_text(template("x500").replace("# mean = [0.0, 0.0, 0.0]", WIND).replace(*NAME), encoding="utf-8")
        page.write_text(fly_missions([mission]), encoding="utf-8")
        browser = browsers.chromium.launch(executable_path=chromium, args=list(OPTIONS))
        window = browser.new_page(viewport={"width": 1280, "height": 800})
        window.goto(page.as_uri())
        window.wait_for_timeout(6000)
        window.screenshot(path=folder / "page.png")
        browser.close()


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
