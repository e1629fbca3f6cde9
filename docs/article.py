"""Takes docs/article.png, and the still figures of the article, from its live ones. Run: python docs/article.py [FOLDER]."""

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from quadstep.proofs.article import article

HERE = Path(__file__).parent
STILLS = HERE.parent / "src" / "quadstep" / "proofs" / "article" / "stills"
FIGURES = ("nested", "sliding", "inversion", "net", "lyapunov")
WIDTH = 760
"""Of the window [px]."""


def stills(window: Page) -> dict[str, str]:
    """Each figure as it is drawn before anybody touches it, as SVG text."""
    return {name: window.locator(f"#{name} .drawing > svg").evaluate("one => one.outerHTML") for name in FIGURES}


def main(folder: Path = HERE) -> None:
    """Open the article, keep its figures if this is the checkout, and take the picture of one."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        print("docs/article.png is taken with Chromium, which is not here: the picture stays")
        return
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as browsers:
        page = Path(temporary) / "article.html"
        page.write_text(article(), encoding="utf-8")
        browser = browsers.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-background-networking"])
        window = browser.new_page(viewport={"width": WIDTH, "height": 900}, reduced_motion="reduce")
        window.goto(page.as_uri())
        window.wait_for_selector("#lyapunov .drawing > svg .curve")
        window.wait_for_timeout(500)
        if folder == HERE:
            for name, drawing in stills(window).items():
                (STILLS / f"{name}.svg").write_text(drawing + "\n", encoding="utf-8")
        window.locator("#inversion").screenshot(path=folder / "article.png")
        browser.close()


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
