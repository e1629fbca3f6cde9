// Sky and ground to the horizon, around the camera: on a box, as only the way to each of its points counts.

import { BackSide, BoxGeometry, Color, Mesh, ShaderMaterial, type Vector3 } from "three";

import type { Palette } from "../view/theme";

const VERTEX = `
varying vec3 way;
void main() {
  way = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const FRAGMENT = `
uniform vec3 above;
uniform vec3 below;
uniform vec3 haze;
varying vec3 way;
void main() {
  float height = normalize(way).z;
  vec3 sky = mix(haze, above, smoothstep(0.0, 0.5, height));
  vec3 land = mix(haze, below, smoothstep(0.0, 0.12, -height));
  float edge = fwidth(height);
  gl_FragColor = vec4(mix(land, sky, smoothstep(-edge, edge, height)) - 0.035 * (1.0 - smoothstep(0.0, 2.5 * edge, abs(height))), 1.0);
}`;

export class Sky {
  readonly object: Mesh<BoxGeometry, ShaderMaterial>;

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: BackSide,
      depthWrite: false,
      depthTest: false,
      uniforms: { above: { value: new Color() }, below: { value: new Color() }, haze: { value: new Color() } },
    });
    this.object = new Mesh(new BoxGeometry(2, 2, 2), material);
    this.object.renderOrder = -20;
    this.object.frustumCulled = false;
  }

  colour(palette: Palette): void {
    const set = (name: string, value: string): unknown => (this.object.material.uniforms[name]!.value = new Color(value).convertLinearToSRGB());
    set("above", palette.dark ? "#131a22" : "#e7eef4");
    set("haze", palette.dark ? "#1b232b" : "#f8f9f8");
    set("below", palette.dark ? "#101417" : "#f1efe9");
  }

  /** Around the camera. */
  place(eye: Vector3, far: number): void {
    this.object.position.copy(eye);
    this.object.scale.setScalar(far * 0.5);
  }
}
