// The page starts here: data in, parts put together.

import { api } from "./api";
import { badge } from "./controls/badge";
import { Changes } from "./controls/changes";
import { ControlPane } from "./controls/pane";
import { csv } from "./data/csv";
import * as fragment from "./data/fragment";
import { readPage } from "./data/page";
import { fresh } from "./data/settings";
import { listenToFiles } from "./logs/drop";
import { Board } from "./plots/board";
import { RatePanel } from "./rate/panel";
import { type ScenePanel, openScene } from "./scene/panel";
import { Session, type Shown } from "./session";
import { Clock } from "./view/clock";
import { byId, fill, h } from "./view/dom";
import { downloadText, fileName } from "./view/download";
import { embed } from "./view/embedded";
import { help } from "./view/help";
import { links } from "./view/links";
import { closed } from "./view/notation";
import { listenToKeys } from "./view/keyboard";
import { tabs } from "./view/tabs";
import { startTheme, toggleTheme } from "./view/theme";
import { greatest, lengths } from "./summary/measure";
import { SummaryStrip } from "./summary/strip";
import { transport } from "./view/transport";
import { typical } from "./walk/field";
import { Guide } from "./walk/guide";
import { story } from "./walk/story";
import { Strip } from "./walk/strip";

function notice(...sentences: readonly string[]): void {
  const host = byId("notice");
  const close = h("button", { type: "button", class: "plain", "aria-label": "Dismiss" }, "✕");
  close.addEventListener("click", () => (host.hidden = true));
  fill(host, h("span", {}, sentences.join(" ")), close);
  host.hidden = !sentences.length;
}

function start(): void {
  startTheme();
  embed(document.body);
  const page = readPage();
  const clock = new Clock((passed) => scene?.view.spin(passed / clock.speed.value));
  const session = new Session(page, () => clock.time.value);
  byId("title").textContent = page.title;
  fill(byId("intro"), ...page.intro.map((part, i) => (i % 2 ? h("strong", {}, part) : part)));
  byId("intro").hidden = !page.intro.length;
  fill(byId("colophon"), page.version ? `Made with quadstep ${page.version}.` : null);
  links(byId("links"), page.links);

  let scene: ScenePanel | undefined;
  let rates: RatePanel | undefined;
  const board = new Board(byId("plots-list"), clock, session);
  const changes = new Changes(session);
  const pane = tabs(page.story !== null);
  transport(byId("transport"), clock);
  const openHelp = help();

  byId("skip").addEventListener("click", () => byId("main-content").focus());
  byId("skip-controls").addEventListener("click", () => {
    pane("controls");
    byId("controls").querySelector<HTMLElement>("select, input")?.focus();
  });
  byId("theme").addEventListener("click", toggleTheme);
  byId("keys").addEventListener("click", openHelp);
  byId("share").addEventListener("click", () => void share(session, clock));
  byId("csv").addEventListener("click", () => {
    const shown = session.shown.value;
    if (shown) downloadText(fileName(shown.data.name, "csv"), csv(shown.flight), "text/csv");
  });
  byId("keep").addEventListener("click", () => session.kept.set(session.kept.value ? undefined : session.shown.value?.flight));
  session.kept.watch((kept) => {
    byId("keep").setAttribute("aria-pressed", String(kept !== undefined));
    byId("keep").textContent = kept ? "Kept (release)" : "Keep";
  });
  listenToFiles(session.log, notice);
  board.window.zoomed.watch((zoomed) => {
    byId("whole").hidden = !zoomed;
    clock.pause = zoomed?.most ?? Infinity;
  });
  byId("whole").addEventListener("click", () => board.window.reset());

  let opening = false; // what the address bar says is being shown
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let opened = false;
  let before = "";
  session.shown.follow((shown) => {
    if (!shown) return;
    const { data, end, settings, flight, ghost } = shown;
    const another = before !== data.id;
    clock.setEnd(flight.held ? end : Math.max(flight.ended, ghost?.last ?? 0)); // plots go on a little after a loss
    clock.slow = flight.held ? undefined : { from: flight.ended - 1, to: flight.ended };
    if (another) {
      if (opened && !opening) notice();
      board.window.reset();
      if (opened) {
        clock.seek(0);
        clock.playing.set(!calm);
      }
    }
    scene?.show(); // it is drawn, and flights are counted, while plots are
    rates?.show();
    board.show(shown);
    badge(byId("badge"), shown);
    if (another) {
      story(byId("story"), byId("claims"), page, shown, (panels) => {
        pane("plots");
        board.point(panels);
      });
    }
    for (const id of ["story", "claims"]) byId(id).classList.toggle("stale", !shown.asFiled);
    before = data.id;
    if (!shown.dragged) address(fragment.write(settings, data, undefined, guide?.at.value), opened && !opening && another);
  });

  const guide = page.story
    ? new Guide(byId("guide"), page.story, session, changes, board, ({ time, window, camera }) => {
        clock.seek(time ?? window?.[0] ?? 0);
        board.window.reset();
        if (window) board.window.zoom(...window);
        scene?.view.look(camera);
        if (!calm) clock.playing.set(true);
      })
    : undefined;
  byId("guide").hidden = !guide;
  guide?.at.follow(() => {
    const shown = session.shown.value;
    // A step that is about to choose another flight must not rename the entry that Back returns to.
    if (shown && (guide.step?.flight ?? shown.data.id) === shown.data.id) address(fragment.write(shown.settings, shown.data, undefined, guide.at.value));
  });
  pane(guide ? "guide" : "plots");

  const walk = (step: 1 | -1): void => {
    const at = page.flights.findIndex((flight) => flight.id === before);
    const next = page.flights[at + step];
    if (next && !guide?.step) session.select(next.id); // a step chooses its own
  };
  const open = (): void => {
    const link = fragment.read(location.hash, page);
    const first = typical(page.flights);
    if (!first) return notice("This page contains no flight.");
    notice(...(link?.complaints ?? []));
    clock.playing.set(false);
    opening = true;
    if (link?.step === undefined) guide?.close();
    if (link?.keep) session.keep(link.keep);
    if (link?.plot) board.arrangement.first(link.plot);
    session.apply(link?.settings ?? fresh(first));
    const plays = !calm && link?.time === undefined;
    const shown = session.shown.value;
    clock.seek(link?.time ?? (plays && shown ? setsOut(shown) : 0));
    if (plays && clock.end.value > LONG) clock.speed.set(4);
    clock.playing.set(plays);
    opened = true;
    if (link?.step !== undefined) guide?.open(link.step, link.bare);
    opening = false;
  };
  Object.assign(globalThis, { quadstep: api(session, clock, () => scene?.view, () => rates?.tally) });
  open();
  new SummaryStrip(byId("summary"), session);
  new ControlPane(byId("controls"), session, changes);
  new Strip(byId("walk"), session);
  rates = new RatePanel(page, session);
  afterPaint(() => {
    scene = openScene(session, clock);
    scene?.view.look(guide?.step?.camera ?? "orbit");
  });
  window.addEventListener("hashchange", open);
  listenToKeys(clock, {
    camera: () => scene?.toggleCamera(),
    theme: toggleTheme,
    help: openHelp,
    walk,
    scene: (key) => scene?.view.key(key) ?? false,
  });
  document.documentElement.dataset["ready"] = "yes";
}

const LONG = 20; // s of flight that nobody waits for

/** When the vehicle has gone a fiftieth of its way [s]: a page that opens should move, and a path that begins at rest hardly does. */
function setsOut({ flight, data }: Shown): number {
  const away = data.scene.position.flatMap((name) => {
    const column = flight.column(name);
    return column ? [column.map((value) => value - column[0]!)] : [];
  });
  const far = lengths(away);
  const most = greatest(far);
  return flight.times[far.findIndex((way) => way >= most / 50)] ?? 0;
}

/** Once the page is on the screen: setting up a 3-D scene may take a while, plots and text need not wait for it. */
function afterPaint(then: () => void): void {
  requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(then, 50)));
}

/** The fragment of the address bar, or, if `another`, of a new entry of its history; a browser that refuses keeps the old one. */
function address(text: string, another = false): void {
  if (text === location.hash) return;
  try {
    if (another) history.pushState(null, "", text);
    else history.replaceState(null, "", text);
  } catch {
    // some browsers refuse this for files; the share button still works
  }
}

async function share(session: Session, clock: Clock): Promise<void> {
  const shown = session.shown.value;
  if (!shown) return;
  const link = location.href.split("#")[0] + fragment.write(shown.settings, shown.data, clock.time.value);
  try {
    await navigator.clipboard.writeText(link);
    notice("The link to this flight, with its settings and time, is on the clipboard.");
  } catch {
    address(fragment.write(shown.settings, shown.data, clock.time.value));
    notice("The address bar now holds the link to this flight, with its settings and time.");
  }
}

try {
  start();
} catch (error) {
  notice(closed(`This page could not be shown: ${error instanceof Error ? error.message : String(error)}`));
  throw error;
}
