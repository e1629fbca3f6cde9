// The scene: ground, wanted path, the vehicle and its ghost, seen through one of two cameras. Drawn only when something changed.

import {
  BufferGeometry,
  Color,
  DirectionalLight,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  PerspectiveCamera,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";

import type { SceneData } from "../data/contract";
import type { Flight } from "../data/flight";
import { roundStep } from "../plots/ticks";
import { Watched } from "../view/events";
import { quantity } from "../view/format";
import type { Palette } from "../view/theme";
import { Axes } from "./axes";
export { attitudeAt } from "./pose";
import { Cameras, type View } from "./cameras";
import { FINE, Flyer } from "./flyer";
import { Ground } from "./ground";
import { Labels, type Spot } from "./labels";
import { pathOf } from "./pose";
import { shadow } from "./shadow";
import { Sky } from "./sky";
import { Streaks } from "./streaks";
import { Trail } from "./trail";
import { Wanted } from "./wanted";

const APPARENT = 0.048; // of the picture's height: the least radius the vehicle is drawn with
const FEWEST = 26; // pixels
const THICKEST = 1.8; // pixels: radius of an arrow
const FOV = 32;
const PAPER = { width: 910, height: 400 }; // as print.css has it
const END = 5; // pixels: radius of the dot where the path ends
const LOST = 1e-6; // s: round-off in the time of the end
const PATIENCE = 10; // ms that a picture may take while a control is dragged
const COARSE = 0.5; // pixels a CSS pixel, if it takes longer
const CORNER: Spot = { x: 0, y: 0, radius: 0 }; // where words are about what is outside the picture

export interface Caption {
  readonly grid: number;
  readonly magnified: number;
}

export class SceneView {
  readonly caption = new Watched<Caption>({ grid: 1, magnified: 1 });
  readonly view = new Watched<View>("orbit");
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FOV, 1, 0.1, 1000);
  private readonly cameras: Cameras;
  private readonly ground = new Ground();
  private readonly wanted = new Wanted();
  private readonly logged = new Trail(2, -1, true);
  private readonly sky = new Sky();
  private readonly axes = new Axes();
  private readonly streaks = new Streaks();
  private readonly labels = new Labels();
  private readonly plumb = new Line(new BufferGeometry(), new LineBasicMaterial({ transparent: true, opacity: 0.5 }));
  private readonly shade = shadow();
  private flyer: Flyer | undefined;
  private ghost: Flyer | undefined;
  private data: SceneData | undefined;
  private loss: { text: string; time: number } | undefined;
  private spot: Spot | undefined;
  private time = 0;
  private pending = 0;
  private slow: boolean | undefined; // whether drawing is, once it matters

  constructor(
    private readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
    private readonly palette: Watched<Palette>,
  ) {
    this.renderer = new WebGLRenderer({ canvas, context, alpha: true });
    this.camera.up.set(0, 0, 1);
    this.cameras = new Cameras(this.camera, canvas);
    this.cameras.controls.addEventListener("change", () => this.request());
    const sun = new DirectionalLight("#ffffff", 2.2);
    sun.position.set(-3, -5, 9);
    this.scene.add(new HemisphereLight("#ffffff", "#8a8f94", 1.7), sun, this.ground.object, this.wanted.trail.object);
    this.scene.add(this.sky.object, this.logged.object, this.axes.object, this.streaks.object, this.wanted.target, this.plumb, this.shade);
    this.palette.watch((colours) => this.colour(colours));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement ?? canvas);
  }

  private readonly renderer: WebGLRenderer;

  /** A flight, and another as its ghost. constant: a parameter in use, by name. keep: leave the camera where it is. dragged: in time, if need be coarsely. beginning: whether it is no more than that. */
  show(data: SceneData, flight: Flight, ghost: Flight | undefined, constant: (name: string) => number, keep: boolean, dragged: boolean, beginning: boolean): void {
    if (data !== this.data) this.rebuild(data);
    const size = this.flyer?.vehicle.size ?? 0;
    if (this.wanted.show(flight, data, size, beginning)) this.streaks.fill(this.wanted.centre, this.wanted.radius * 1.5, this.wanted.level);
    this.flyer?.show(flight, this.wanted.radius * 2, constant);
    if (ghost && !this.ghost) {
      this.ghost = new Flyer(data, true);
      this.ghost.colour(this.palette.value);
      this.scene.add(this.ghost.object);
    }
    if (this.ghost) this.ghost.object.visible = ghost !== undefined;
    if (ghost) this.ghost?.show(ghost, this.wanted.radius * 2, constant);
    this.loss = flight.held ? undefined : { text: `✕ Lost: ${flight.why}`, time: flight.last - LOST };
    this.setTime(this.time);
    if (!keep) this.look(this.view.value);
    this.sharpen(!dragged || !(this.slow ??= this.took() > PATIENCE));
    if (!dragged) return;
    cancelAnimationFrame(this.pending); // else it would be a frame late
    this.pending = 0;
    this.draw();
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    gl.deleteSync(gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0));
    gl.flush(); // begun at once, as plots are drawn meanwhile
  }

  private sharpen(sharp: boolean): void {
    const ratio = sharp ? Math.min(devicePixelRatio, 2) : COARSE;
    if (ratio !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(ratio);
  }

  /** What a picture takes until it is there [ms]. */
  private took(): number {
    const begun = performance.now();
    this.draw();
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now() - begun;
  }

  /** Where the camera is, the height of the ground, and where the vehicle is in the picture [px]. */
  get eye(): { position: number[]; ground: number; vehicle: Spot | undefined } {
    return { position: this.camera.position.toArray(), ground: this.wanted.level, vehicle: this.spot };
  }

  /** The path of a log that was opened; undefined: none. */
  showLog(flight: Flight | undefined): void {
    this.logged.set(flight ? pathOf(flight, ["x", "y", "z"], FINE * 2 * this.wanted.radius).points : new Float32Array(), this.wanted.radius * 2);
    this.request();
  }

  /** The picture as it is now, in the proportions of paper, where it stays: WebGL's own is gone once it was shown. */
  onPaper(canvas: HTMLCanvasElement): void {
    const { width, height } = this.renderer.getSize(new Vector2());
    this.size(PAPER.width, PAPER.height);
    this.draw(PAPER);
    [canvas.width, canvas.height] = [this.canvas.width, this.canvas.height];
    const pen = canvas.getContext("2d");
    pen?.drawImage(this.canvas, 0, 0);
    pen?.scale(canvas.width / PAPER.width, canvas.height / PAPER.height);
    if (pen) this.labels.print(pen, this.palette.value.ink);
    this.size(width, height);
    this.draw();
  }

  setTime(t: number): void {
    this.time = t;
    for (const flyer of [this.flyer, this.ghost]) flyer?.place(t);
    if (this.flyer) this.cameras.track(this.flyer.position);
    this.streaks.move(this.flyer?.wind(t), 0);
    this.request();
  }

  /** The blades turn while the flight plays. */
  spin(seconds: number): void {
    for (const flyer of [this.flyer, this.ghost]) flyer?.spin(seconds, this.time);
    this.streaks.move(this.flyer?.wind(this.time), seconds);
  }

  /** Look through this camera, from where it starts. */
  look(view: View): void {
    this.view.set(view);
    if (view === "follow" && this.flyer) this.cameras.follow(this.flyer.position, this.flyer.vehicle.size);
    else this.cameras.orbit(this.wanted.centre, this.wanted.radius);
    this.request();
  }

  key(key: string): boolean {
    const used = this.cameras.key(key);
    if (used) this.request();
    return used;
  }

  private rebuild(data: SceneData): void {
    this.data = data;
    for (const flyer of [this.flyer, this.ghost]) {
      if (flyer) this.scene.remove(flyer.object);
      flyer?.dispose();
    }
    this.ghost = undefined;
    this.flyer = new Flyer(data, false);
    this.flyer.colour(this.palette.value);
    this.scene.add(this.flyer.object);
  }

  private colour(colours: Palette): void {
    this.flyer?.colour(colours);
    this.ghost?.colour(colours);
    this.ground.colour(colours.muted, colours.dark);
    this.sky.colour(colours);
    this.axes.colour(colours.muted);
    this.logged.colour(colours.pink);
    this.streaks.colour(colours.sky, colours.dark);
    const mixed = new Color(colours.blue).lerp(new Color(colours.paper), colours.dark ? 0.68 : 0.6);
    this.wanted.trail.colour(`#${mixed.getHexString()}`);
    this.wanted.target.material.color = new Color(colours.blue);
    (this.plumb.material as LineBasicMaterial).color = new Color(colours.muted);
    this.shade.material.opacity = colours.dark ? 0.55 : 0.24;
    this.request();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement ?? this.canvas;
    if (!width || !height) return;
    const aspect = this.camera.aspect;
    this.sharpen(true);
    this.size(width, height);
    if (Math.abs(aspect / this.camera.aspect - 1) > 0.15) this.look(this.view.value);
    this.draw();
  }

  private size(width: number, height: number): void {
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /** Draw once, at the next frame. */
  private request(): void {
    this.pending ||= requestAnimationFrame(() => {
      this.pending = 0;
      if (this.cameras.controls.update()) this.request();
      this.draw();
    });
  }

  private draw(paper?: typeof PAPER): void {
    const { flyer, camera, labels } = this;
    this.cameras.keepAbove(this.wanted.level);
    const seen = this.cameras.controls.target;
    const distance = camera.position.distanceTo(seen);
    const above = Math.abs(camera.position.z - this.wanted.level);
    const cell = roundStep(Math.max(distance, above, 1e-3) / 14);
    this.ground.place(seen, this.wanted.level, cell, Math.max(distance * 1.7, above * 4));
    this.sky.place(camera.position, camera.far);
    this.axes.place(this.wanted.level, roundStep(this.wanted.radius / 4));
    camera.updateMatrixWorld();
    labels.begin(paper);
    if (flyer) {
      const height = this.canvas.clientHeight || this.canvas.height; // none where print styles hide it
      const pixel = (2 * Math.tan((FOV * Math.PI) / 360)) / height;
      const least = Math.max(APPARENT * height, FEWEST);
      const wish = (at: Vector3): number => (least * camera.position.distanceTo(at) * pixel) / flyer.vehicle.size;
      const magnified = Math.max(1, wish(flyer.position));
      const thickest = THICKEST * pixel * camera.position.distanceTo(flyer.position);
      flyer.magnify(magnified, this.time, thickest);
      this.ghost?.magnify(Math.max(1, wish(this.ghost.position)), this.time, thickest);
      this.beneath(flyer, magnified);
      const far = pixel * camera.position.distanceTo(flyer.position);
      const middle = labels.spot(flyer.position, camera);
      this.spot = middle && { ...middle, radius: (flyer.vehicle.size * magnified) / far };
      if (this.loss && this.time >= this.loss.time) labels.callOut(this.loss.text, this.spot ?? CORNER, this.pointsDown(flyer));
      const dot = END * pixel * camera.position.distanceTo(this.wanted.target.position);
      this.wanted.target.scale.setScalar(dot);
      // The dot makes way for the vehicle that arrives.
      const room = this.wanted.target.position.distanceTo(flyer.position) / (flyer.vehicle.size * magnified);
      this.wanted.target.material.opacity = Math.min(Math.max((room - 1) / 2, 0), 1) * 0.85;
      if (this.wanted.target.visible && room > 3) labels.put("end", "end", this.wanted.target.position, camera);
      for (const { kind, label, unit, tip, size, arrow } of flyer.drawn) {
        if (arrow.object.visible) labels.put(kind, `${label.toLowerCase()} ${quantity(size, unit)}`, tip, camera);
      }
      this.caption.set({ grid: cell, magnified });
    }
    this.axes.label(labels, camera);
    labels.end();
    this.wanted.target.quaternion.copy(camera.quaternion);
    this.renderer.render(this.scene, camera);
  }

  /** Whether the thrust's arrow, with its label, leads down in the picture. */
  private pointsDown(flyer: Flyer): boolean {
    const [tip, from] = [flyer.drawn[0]?.tip, flyer.position].map((at) => at && this.labels.spot(at, this.camera)?.y);
    return tip !== undefined && from !== undefined && tip > from;
  }

  /** Shadow and plumb line tell where above the ground the vehicle is. */
  private beneath(flyer: Flyer, magnified: number): void {
    const { x, y, z } = flyer.position;
    this.shade.position.set(x, y, this.wanted.level + 1e-3 * this.wanted.radius);
    this.shade.scale.setScalar(flyer.vehicle.size * magnified * 1.3);
    this.plumb.geometry.setFromPoints([new Vector3(x, y, this.wanted.level), new Vector3(x, y, z)]);
    this.plumb.geometry.computeBoundingSphere();
  }
}

