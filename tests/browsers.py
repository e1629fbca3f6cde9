"""Chromium for tests: fixtures that open a page from disk, on a machine whose network is closed."""

import pytest

from tests.needs import CHROMIUM_PROGRAM

PATIENCE = 180_000
"""Milliseconds; on a busy machine drawing in software takes its time."""


def start_browser(playwright, *, webgl=True):
    """Chromium on a machine whose network is closed, drawing in software."""
    drawing = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
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


@pytest.fixture(scope="module")
def playwright():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="module")
def browsers(playwright):
    """With WebGL, and without, where everything but the scene is quicker."""
    running = {webgl: start_browser(playwright, webgl=webgl) for webgl in (True, False)}
    yield running
    for browser in running.values():
        browser.close()


@pytest.fixture
def open_page(browsers, page_file):
    """Opens the page; every request beyond the file itself, and every error, fails the test."""
    contexts, requests, errors = [], [], []

    def opened(fragment="", *, width=1440, height=900, scheme="light", webgl=False):
        context = browsers[webgl].new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion="reduce"
        )
        context.set_default_timeout(PATIENCE)
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("dialog", lambda dialog: (errors.append(f"dialog {dialog.message}"), dialog.dismiss()))
        page.goto(page_file.as_uri() + fragment)
        page.wait_for_selector(f"html[data-ready][data-scene={'yes' if webgl else 'no'}]", state="attached")
        return page

    yield opened
    for context in contexts:
        context.close()
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert errors == []
