// Two ways to look: orbit holds the whole path in the picture, follow stays beside the vehicle at its true size.

import { type PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

export type View = "orbit" | "follow";

const FROM = new Vector3(-0.62, -1, 0.32).normalize();
const TURN = 0.12; // rad a key press

export class Cameras {
  readonly controls: OrbitControls;
  view: View = "orbit";
  private readonly last = new Vector3();

  constructor(
    readonly camera: PerspectiveCamera,
    canvas: HTMLElement,
  ) {
    this.controls = new OrbitControls(camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.maxPolarAngle = Math.PI * 0.58;
    canvas.style.touchAction = "pan-y"; // a thumb can scroll the page past the scene
  }

  /** The whole path in the picture. */
  orbit(centre: Vector3, radius: number): void {
    this.view = "orbit";
    const angle = (this.camera.fov * Math.PI) / 360;
    const narrow = Math.min(1, this.camera.aspect);
    const distance = radius / Math.sin(Math.atan(Math.tan(angle) * narrow));
    this.look(centre, distance);
  }

  /** Beside the vehicle. */
  follow(vehicle: Vector3, size: number): void {
    this.view = "follow";
    this.last.copy(vehicle);
    this.look(vehicle.clone().setZ(vehicle.z + size), size * 10); // below the middle: its thrust points up
  }

  /** The vehicle moved: a camera that follows moves with it. */
  track(vehicle: Vector3): void {
    if (this.view === "follow") {
      const step = vehicle.clone().sub(this.last);
      this.camera.position.add(step);
      this.controls.target.add(step);
    }
    this.last.copy(vehicle);
  }

  /** Never below the ground, nor looking up from under it. */
  keepAbove(level: number): void {
    const { camera, controls } = this;
    const least = level + 0.02 * camera.position.distanceTo(controls.target);
    controls.target.z = Math.max(controls.target.z, level);
    if (camera.position.z >= least) return;
    camera.position.z = least;
    camera.lookAt(controls.target);
  }

  /** Keys of the scene; whether this was one. */
  key(key: string): boolean {
    const offset = this.camera.position.clone().sub(this.controls.target);
    if (key === "+" || key === "=") offset.multiplyScalar(0.85);
    else if (key === "-") offset.multiplyScalar(1 / 0.85);
    else if (key === "[") offset.applyAxisAngle(new Vector3(0, 0, 1), -TURN);
    else if (key === "]") offset.applyAxisAngle(new Vector3(0, 0, 1), TURN);
    else return false;
    this.camera.position.copy(this.controls.target).add(offset);
    return true;
  }

  private look(target: Vector3, distance: number): void {
    this.controls.target.copy(target);
    this.controls.minDistance = distance / 40;
    this.controls.maxDistance = distance * 6;
    this.camera.near = distance / 400;
    this.camera.far = distance * 40;
    this.camera.updateProjectionMatrix();
    this.camera.position.copy(target).addScaledVector(FROM, distance);
    this.controls.update();
  }
}
