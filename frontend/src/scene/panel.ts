// The scene on the page: canvas, camera switch, legend, and a sentence where there is no WebGL.

import type { Inputs } from "../data/engine";
import type { Flight } from "../data/flight";
import { pathOfLog } from "../logs/log";
import type { Session, Shown } from "../session";
import type { Clock } from "../view/clock";
import { byId, fill, h, renew, run, swatch } from "../view/dom";
import { join, number, plain } from "../view/format";
import { type Palette, palette } from "../view/theme";
import type * as view from "./view";

type SceneView = view.SceneView;

declare global {
  /** A script of its own, which stands in the page as text until it is needed. */
  var quadstepScene: typeof view;
}

/** The scene, set up: its code is read only here, where there is WebGL, so that plots and text need not wait for it. */
export function openScene(session: Session, clock: Clock): ScenePanel | undefined {
  const canvas = byId("scene") as HTMLCanvasElement;
  const view = viewOf(canvas);
  if (view) return new ScenePanel(view, canvas, session, clock);
  byId("stage").classList.add("flat");
  canvas.hidden = true;
  byId("camera").hidden = true;
  fill(byId("no-webgl"), "This browser has no WebGL, so there is no 3-D scene. Plots, controls and flights still work.");
  byId("no-webgl").hidden = false;
  document.documentElement.dataset["scene"] = "no";
  return undefined;
}

/** Runs the scene's own script, once. */
export function readScene(): void {
  const kept = document.getElementById("quadstep-scene");
  kept?.remove();
  if (kept) run(kept.textContent);
}

function viewOf(canvas: HTMLCanvasElement): SceneView | undefined {
  const context = canvas.getContext("webgl2", { alpha: true, antialias: true, depth: true, premultipliedAlpha: true });
  if (!context) return undefined;
  readScene();
  try {
    return new quadstepScene.SceneView(canvas, context, palette);
  } catch {
    return undefined;
  }
}

export class ScenePanel {
  private flight = "";
  private logged = false; // whether a log has a path
  private behind: Flight | undefined; // that is kept, where there is no ghost

  constructor(
    readonly view: SceneView,
    canvas: HTMLCanvasElement,
    private readonly session: Session,
    clock: Clock,
  ) {
    window.addEventListener("beforeprint", () => view.onPaper(byId("scene-paper") as HTMLCanvasElement));
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    for (const button of byId("camera").querySelectorAll("button")) {
      button.addEventListener("click", () => view.look(button.value === "follow" ? "follow" : "orbit"));
    }
    view.view.watch((now) => {
      for (const button of byId("camera").querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.value === now));
    });
    view.caption.watch((caption) => captionOf(caption));
    session.kept.watch(() => this.show());
    session.log.watch((log) => {
      const path = log && pathOfLog(log);
      this.logged = path !== undefined;
      view.showLog(path);
      if (session.shown.value) this.legend(session.shown.value);
    });
    palette.follow(() => session.shown.value && this.legend(session.shown.value));
    clock.time.watch((t) => view.setTime(t));
    document.documentElement.dataset["scene"] = "yes";
  }

  toggleCamera(): void {
    this.view.look(this.view.view.value === "orbit" ? "follow" : "orbit");
  }

  show(): void {
    const { shown: { value: shown }, kept: { value: kept } } = this.session;
    if (!shown) return;
    const { data, flight, ghost, given, dragged, whole } = shown;
    this.behind = !ghost && kept !== flight && kept?.has(...data.scene.position, ...data.scene.attitude.columns) ? kept : undefined;
    this.view.show(data.scene, flight, ghost ?? this.behind, (name) => parameter(given, name), this.flight === data.id, dragged, whole !== undefined);
    this.flight = data.id;
    this.legend(shown);
  }

  private legend(shown: Shown): void {
    legend(shown, this.behind ? "kept" : shown.ghost && "ghost", palette.value, this.logged);
  }
}

function parameter(given: Inputs | undefined, name: string): number {
  return given?.parameters[given.names.get(name) ?? -1] ?? Number.NaN;
}

/** What the colours mean. behind: what is drawn as a ghost. logged: whether the path of a log is drawn. */
function legend({ data, flight, given }: Shown, behind: string | undefined, colours: Palette, logged: boolean): void {
  const entry = (colour: string, width: number, dash: number[], text: string, opacity = 1): HTMLElement => {
    const mark = swatch(colour, dash, width);
    mark.style.opacity = String(opacity);
    return h("li", {}, mark, text);
  };
  const entries = [
    entry(colours.blue, 5, [], "desired", 0.32),
    entry(colours.blue, 2.4, [], "flown"),
    behind ? entry(colours.vermillion, 2.2, [4, 3], behind) : null,
    logged ? entry(colours.pink, 2, [2, 2.5], "file") : null,
    data.scene.thrust && flight.has(data.scene.thrust) ? entry(colours.orange, 3, [], "thrust") : null,
    ...data.scene.arrows.map((arrow) => {
      if (arrow.columns?.every((name) => !flight.column(name)?.some((value) => value !== 0))) return null;
      const constant = arrow.parameters?.map((name) => parameter(given, name));
      const size = constant ? Math.hypot(...constant) : Number.NaN;
      if (constant && !(size > 0)) return null;
      const text = constant ? `${arrow.label} ${join(number(size, 3), arrow.unit)}` : arrow.label;
      return entry(arrow.kind === "wind" ? colours.sky : colours.pink, 3, arrow.kind === "wind" ? [4, 2.5] : [], text);
    }),
  ];
  renew(byId("legend"), ...entries);
}

function captionOf({ grid, magnified }: view.Caption): void {
  const scale = magnified > 1.05 ? `vehicle drawn ${magnified < 10 ? magnified.toFixed(1) : Math.round(magnified)}× its size` : "vehicle to scale";
  const text = `grid ${plain(Number(grid.toPrecision(2)))} m · ${scale}`;
  const host = byId("caption");
  if (host.textContent !== text) host.textContent = text;
}
