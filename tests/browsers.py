"""Chromium for tests: fixtures that open a page from disk, on a machine whose network is closed."""

import io

import pytest

from tests.frontend import FRONTEND, build_tools
from tests.needs import BUILD_TOOLS, CHROMIUM_PROGRAM, without
from tests.patience import PATIENCE


def start_browser(playwright, *, webgl=True):
    """Chromium on a machine whose network is closed, drawing in software."""
    drawing = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    drawing += ["--disable-gpu-rasterization", "--disable-gpu-compositing"]  # all but the scene is drawn sooner without
    flags = [
        "--no-sandbox",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--no-first-run",
        "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost",
        *(drawing if webgl else ["--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis"]),
    ]
    return playwright.chromium.launch(executable_path=CHROMIUM_PROGRAM, args=flags)


class Started(dict[bool, object]):
    """Chromium with WebGL, and without, where all but the scene is quicker; each is started where it is first asked for."""

    def __init__(self, playwright):
        self.playwright = playwright

    def __missing__(self, webgl):
        self[webgl] = start_browser(self.playwright, webgl=webgl)
        return self[webgl]


@pytest.fixture(scope="session")
def chromium():
    """One for all files: to start it takes a second of a processor."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = Started(playwright)
        yield running
        for browser in running.values():
            browser.close()


class Opened:
    """Pages of one browser, the first of which is used again: a new one costs as much as flying what it shows."""

    def __init__(self, browser):
        self.context = browser.new_context(reduced_motion="reduce")
        self.context.set_default_timeout(1000 * PATIENCE)
        self.first, self.others, self.free = self.context.new_page(), [], True

    def page(self):
        """A blank page that the test has not had yet."""
        if self.free:
            self.free = False
            return self.first
        self.others.append(self.context.new_page())
        return self.others[-1]

    def blank(self):
        """Leave nothing on the first page, and no other: what is behind another page is drawn once a second."""
        while self.others:
            self.others.pop().close()
        if not self.free:
            self.first.goto("about:blank")
        self.free = True


class Browsers(dict[bool, Opened]):
    """Pages of a file's own, by whether they can draw with WebGL."""

    def __init__(self, chromium):
        self.chromium = chromium

    def __missing__(self, webgl):
        self[webgl] = Opened(self.chromium[webgl])
        return self[webgl]


@pytest.fixture(scope="module")
def browsers(chromium):
    running = Browsers(chromium)
    yield running
    for one in running.values():
        one.context.close()


@pytest.fixture
def open_page(browsers, page_file):
    """Opens a page, `page_file` unless told; every request beyond the file itself, and every error, fails the test."""
    requests, errors, heard = [], [], []

    def opened(fragment="", *, file=page_file, width=1440, height=900, scheme="light", webgl=False):
        page = browsers[webgl].page()
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        hears = {
            "request": lambda request: requests.append(request.url),
            "pageerror": lambda error: errors.append(str(error)),
            "console": lambda message: errors.append(message.text) if message.type == "error" else None,
            "dialog": lambda dialog: (errors.append(f"dialog {dialog.message}"), dialog.dismiss()),
        }
        for event, hear in hears.items():
            page.on(event, hear)
            heard.append((page, event, hear))
        page.goto(file.as_uri() + fragment)
        page.wait_for_selector(f"html[data-ready][data-scene={'yes' if webgl else 'no'}]", state="attached")
        return page

    yield opened
    for one in browsers.values():
        one.blank()
    for page, event, hear in heard:
        page.remove_listener(event, hear)
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert errors == []


def until(page, condition):
    """Whether it comes true while a test is patient; the page's own policy forbids to ask it for a condition as text."""
    for _ in range(round(20 * PATIENCE)):
        if condition():
            return True
        page.wait_for_timeout(50)
    return False


def picture(page, selector):
    """What is drawn there, as an array of colours."""
    from matplotlib.image import imread

    return imread(io.BytesIO(page.locator(selector).screenshot()))[..., :3]


AXE = """async () => {
  const done = await axe.run({ rules: { "target-size": { enabled: true } } });
  return done.violations.map((one) => [one.id, one.nodes.map((node) => node.html)]);
}"""


def axe(page):
    """What axe-core finds on a page as it is shown."""
    if not build_tools():
        without(BUILD_TOOLS)
    page.evaluate((FRONTEND / "node_modules" / "axe-core" / "axe.min.js").read_text(encoding="utf-8") + ";0")
    return page.evaluate(AXE)
