// A figure: what stands in the text as a still becomes live, as wide as it is shown, drawn at most once a picture.

export interface Stage {
  /** The element that holds the drawing. */
  readonly drawing: HTMLElement;
  readonly controls: HTMLElement;
  /** Its width now [px]. */
  readonly width: number;
  /** Asks for a drawing at the next picture. */
  redraw(): void;
}

export type Draw = () => string;

/** Makes a figure live. make: adds its controls and says how it is drawn. */
export function live(id: string, make: (stage: Stage) => Draw): void {
  const figure = document.getElementById(id);
  const drawing = figure?.querySelector<HTMLElement>(".drawing");
  const controls = figure?.querySelector<HTMLElement>(".controls");
  if (!drawing || !controls) return;
  let [asked, width] = [false, 0];
  const stage: Stage = {
    drawing,
    controls,
    get width() {
      return width;
    },
    redraw() {
      if (asked) return;
      asked = true;
      requestAnimationFrame(() => {
        asked = false;
        drawing.innerHTML = draw();
        drawing.dataset["live"] = "";
      });
    },
  };
  const draw = make(stage);
  new ResizeObserver(() => {
    const now = Math.max(280, Math.floor(drawing.clientWidth));
    if (now !== width) [width] = [now], stage.redraw();
  }).observe(drawing);
}

/** Calls back with places of the drawing [px] while a finger or mouse drags over it. */
export function dragged(stage: Stage, moved: (left: number, top: number, first: boolean) => boolean): void {
  const place = (event: PointerEvent): readonly [number, number] => {
    const box = stage.drawing.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  let held = false;
  stage.drawing.addEventListener("pointerdown", (event) => {
    held = moved(...place(event), true);
    if (held) stage.drawing.setPointerCapture(event.pointerId), event.preventDefault();
  });
  stage.drawing.addEventListener("pointermove", (event) => void (held && moved(...place(event), false)));
  stage.drawing.addEventListener("touchstart", (event) => void (held && event.preventDefault()), { passive: false }); // or it scrolls
  for (const over of ["pointerup", "pointercancel"] as const) stage.drawing.addEventListener(over, () => (held = false));
}
