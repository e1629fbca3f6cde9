"""Takes docs/page.png, the picture of the README: its flight in the page. python docs/page.py [FOLDER]; needs Chromium."""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from quadstep.linear.grade import quick_grade
from quadstep.page.build import fly_missions

HERE = Path(__file__).parent
OPTIONS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
)


def main(folder: Path = HERE) -> None:
    """Fly the README's mission in the page, let it run for some seconds, take its picture."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        print("docs/page.png is taken with Chromium, which is not here: the picture stays")
        return
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as browsers:
        page, mission = Path(temporary) / "page.html", Path(temporary) / "mission.toml"
        (text,) = re.findall("```toml\n(.*?)```", (HERE.parent / "README.md").read_text(encoding="utf-8"), re.DOTALL)
        mission.write_text(text, encoding="utf-8")
        page.write_text(fly_missions([mission], grading=quick_grade), encoding="utf-8")
        browser = browsers.chromium.launch(executable_path=chromium, args=list(OPTIONS))
        window = browser.new_page(viewport={"width": 1280, "height": 800})
        window.goto(page.as_uri())
        window.wait_for_timeout(6000)
        window.screenshot(path=folder / "page.png")
        browser.close()


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
