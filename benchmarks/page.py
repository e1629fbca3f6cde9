"""The live page in Chromium: the time to its first picture, from setting a control to the new flight on screen, and while a
slider is dragged.

`python -m benchmarks.page [FILE.html...]` prints the rows alone, or measures pages that are there already.
"""

import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
from playwright.sync_api import Browser, CDPSession, sync_playwright

from benchmarks.flights import seconds
from quadstep.engines.fly import fly
from quadstep.mission.read import read_mission
from quadstep.page.build import fly_missions
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.page import campaign_page
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.paper.page import fly_paper

EXAMPLES = Path(__file__).parents[1] / "examples"
CASE_1 = EXAMPLES / "case1.toml"
OPENED, FLOWN = 3, 5
"""Times that a page is opened, and that each time it flies again; the least counts."""

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NO_SCENE = ("--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis")
"""The scene is left out: a graphics processor draws it, and where there is none little else than its drawing is measured."""

WATCH = """
const ready = new MutationObserver(() => {
  if (!document.documentElement?.dataset.ready) return;
  ready.disconnect();
  requestAnimationFrame(() => setTimeout(() => (window.drawnAt = performance.now())));
});
ready.observe(document, { attributes: true, subtree: true });
const over = new MutationObserver(() => {
  if (!document.documentElement?.dataset.scene) return;
  over.disconnect();
  console.debug("opened");
});
over.observe(document, { attributes: true, subtree: true });
"""
"""When the frame is done in which plots, controls and numbers of the first flight stand [ms after the navigation began].

It tells by a message, since asking the page again and again would be work of its thread.
"""

AGAIN = """
async () => {
  const { id, values } = quadstep.controls().find((one) => one.values.every((value) => value > 0));
  const begun = performance.now();
  quadstep.setControl(id, values);
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  return [performance.now() - begun, quadstep.outcome().took];
}
"""
"""From a control that is set to the frame in which its flight stands, and what of it flying took [ms]."""


SCENE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-rasterization",
    "--disable-gpu-compositing")  # fmt: skip
"""As a machine without a graphics card draws the page: the scene by WebGL in software, all else without."""

DRAGS = 20
"""Moves of a slider in a drag; their median counts."""

DRAG = """
async (count) => {
  const slider = document.querySelector("#controls input[type=range]");
  const gl = document.querySelector("#scene").getContext("webgl2");
  const took = [], parts = [];
  for (let i = 0; i < count; i++) {
    await new Promise((done) => setTimeout(done, 30));
    const begun = performance.now();
    slider.value = slider.max * (0.4 + (0.2 * i) / count);
    slider.dispatchEvent(new Event("input"));
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    took.push(performance.now() - begun);
    const { ended, whole } = quadstep.outcome();
    parts.push(ended / (whole ?? ended));
  }
  slider.dispatchEvent(new Event("change"));
  const middle = (values) => values.sort((a, b) => a - b)[count >> 1];
  return [middle(took), middle(parts)];
}
"""
"""From a moved slider to the picture of its flight, with the scene drawn [ms], and the part of the flight that was flown."""


class Times(NamedTuple):
    """[ms]: to the first picture; from a moved control to the picture of its flight; flying alone. busy: what the page's own
    thread worked for the first two, which counts where other programs keep the machine busy.
    """

    first: float
    again: float
    flying: float
    first_busy: float
    again_busy: float


@contextmanager
def chromium(drawing: Sequence[str] = NO_SCENE) -> Iterator[Browser]:
    """A browser, without a scene unless told how to draw it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=PROGRAM, args=["--no-sandbox", *drawing])
        yield browser
        browser.close()


def worked(session: CDPSession) -> float:
    """What the page's thread has worked so far, but for answers to the one who measures [ms]."""
    metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    return 1e3 * float(metrics["TaskDuration"] - metrics["DevToolsCommandDuration"])


def measured(browser: Browser, page_file: Path) -> Times:
    """Open a page several times, and fly it again."""
    found = []
    for _ in range(OPENED):
        context = browser.new_context(viewport={"width": 1440, "height": 900}, reduced_motion="reduce")
        context.set_default_timeout(180_000)
        page = context.new_page()
        session = context.new_cdp_session(page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})
        page.add_init_script(WATCH)
        before = worked(session)
        with page.expect_console_message(lambda message: message.text == "opened"):  # which comes after plots and text
            page.goto(page_file.as_uri())
        first_busy, first = worked(session) - before, page.evaluate("window.drawnAt")
        for _ in range(FLOWN):
            before = worked(session)
            again, flying = page.evaluate(AGAIN)
            found.append(Times(first, again, flying, first_busy, worked(session) - before))
        context.close()
    return Times(*(min(part) for part in zip(*found, strict=True)))


def dragged(page_file: Path) -> str:
    """Drag a slider once to warm up, and once to measure."""
    with chromium(SCENE) as browser:
        page = browser.new_context(viewport={"width": 1440, "height": 900}, reduced_motion="reduce").new_page()
        page.set_default_timeout(180_000)
        page.goto(page_file.as_uri())
        page.wait_for_selector("html[data-scene=yes]", state="attached")
        page.evaluate(DRAG, DRAGS)
        took, part = page.evaluate(DRAG, DRAGS)
    return f"dragged, scene and all drawn without a graphics card: median of {DRAGS} {took:.0f} ms ({part:.0%} of the flight)"


def text_of(times: Times) -> str:
    """All five in words."""
    return (
        f"first picture {times.first:.0f} ms (its own work {times.first_busy:.0f} ms), flown again and drawn "
        f"{times.again:.0f} ms (own work {times.again_busy:.0f} ms, flying {times.flying:.0f} ms)"
    )


def case_1_page(folder: Path) -> tuple[str, str, str, str, str]:
    """The page that `quadstep fly` writes of Case 1."""
    return row("page of Case 1, in Chromium", folder / "case1.html", fly_missions([CASE_1]))


def paper_page(folder: Path) -> tuple[str, str, str, str, str]:
    """The page of the paper's study: all cases and 36 stress flights."""
    return row("page of the paper, in Chromium", folder / "paper.html", fly_paper())


COUNTED = """
async () => {
  const { id, values } = quadstep.controls().find((one) => one.controller && one.values.every((value) => value > 0));
  const words = document.getElementById("rate-words"), took = [];
  for (let i = 0; i < 5; i++) {
    const begun = performance.now();
    const all = new Promise((done) => {
      const watch = new MutationObserver(() => quadstep.rate().done && done(watch.disconnect()));
      watch.observe(words, { childList: true });
    });
    quadstep.setControl(id, values.map((value) => value * (1.01 + 0.01 * i)));
    await all;
    took.push(performance.now() - begun);
  }
  return took;
}
"""
"""From a gain that is set to the failure rate of all flights on the screen [ms]."""


def gusts_page(folder: Path) -> tuple[str, str, str, str, str]:
    """1,000 flights of 10 s in gusts, counted again for a gain that moved."""
    what, target = "failure rate of 1,000 gusty flights of 10 s, in Chromium", "< 1 s on two cores"
    if PROGRAM is None:
        return what, "no Chromium here", target, "-", "-"
    file, given = folder / "gusts.html", EXAMPLES / "gusts.toml"
    file.write_text(campaign_page(given), encoding="utf-8")
    with chromium() as browser:
        page = browser.new_page(reduced_motion="reduce")
        page.set_default_timeout(180_000)
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready]", state="attached")
        page.wait_for_function("() => quadstep.rate().done")
        took = page.evaluate(COUNTED)
        page.evaluate("document.getElementById('reset').click()")
        page.wait_for_function("() => quadstep.rate().done")
        ours = page.evaluate("quadstep.rate().largest_error")
    flyer = Flyer(read_campaign(given))
    theirs = flyer.fly(0, 1000)["largest_error[m]"].to_numpy()
    lanes = 1e3 * seconds(lambda: flyer.fly(0, 1000))
    yardstick = f"the same flights on lanes {lanes:.0f} ms"
    return (
        what,
        f"{min(took):.0f} ms",
        target,
        yardstick,
        "identical to the bit" if np.array_equal(ours, theirs) else "NOT identical",
    )


def row(what: str, file: Path, text: str) -> tuple[str, str, str, str, str]:
    """A page, measured; both begin with Case 1."""
    target = "first < 1 s, again < 100 ms, dragged < 50 ms"
    if PROGRAM is None:
        return what, "no Chromium here", target, "-", "-"
    file.write_text(text, encoding="utf-8")
    plan = read_mission(CASE_1).plan(EXAMPLES)
    log = fly(plan)
    with chromium() as browser:
        times = measured(browser, file)
        page = browser.new_page()
        page.goto(file.as_uri())
        same = np.array_equal(np.array(page.evaluate("quadstep.rows()")), log.rows)
    took = 1e3 * seconds(lambda: fly(plan))
    yardstick = f"the same flight on lanes {took:.0f} ms ({times.flying / took:.1f} times less)"
    return what, f"{text_of(times)}; {dragged(file)}", target, yardstick, "identical to the bit" if same else "NOT identical"


def main() -> None:
    """Measure the pages named, or those of the rows."""
    if files := sys.argv[1:]:
        with chromium() as browser:
            for name in files:
                print(f"{name}: {text_of(measured(browser, Path(name).resolve()))}")
        for name in files:
            print(f"{name}: {dragged(Path(name).resolve())}")
        return
    with tempfile.TemporaryDirectory() as folder:
        for measure in (case_1_page, paper_page, gusts_page):
            print(*measure(Path(folder)), sep="; ")


if __name__ == "__main__":
    main()
