// The ground: a grid that fades into the page, so that height and speed can be seen.

import { Color, Mesh, PlaneGeometry, ShaderMaterial, type Vector3 } from "three";

const VERTEX = `
varying vec2 place;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  place = world.xy;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

const FRAGMENT = `
uniform float cell;
uniform float reach;
uniform vec2 centre;
uniform vec3 ink;
uniform float strength;
varying vec2 place;
float lines(float size, float width) {
  vec2 at = place / size;
  vec2 soft = fwidth(at);
  vec2 near = abs(fract(at - 0.5) - 0.5) / max(soft, vec2(1e-6));
  float drawn = 1.0 - min(min(near.x, near.y) / width, 1.0);
  return drawn * (1.0 - smoothstep(0.2, 0.7, max(soft.x, soft.y)));
}
void main() {
  float fade = 1.0 - smoothstep(0.15, 1.0, distance(place, centre) / reach);
  float drawn = max(0.45 * lines(cell, 1.0), lines(cell * 5.0, 1.3));
  gl_FragColor = vec4(ink, drawn * fade * strength);
}`;

export class Ground {
  readonly object: Mesh<PlaneGeometry, ShaderMaterial>;

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      uniforms: {
        cell: { value: 1 },
        reach: { value: 50 },
        centre: { value: [0, 0] },
        ink: { value: new Color() },
        strength: { value: 0.5 },
      },
    });
    this.object = new Mesh(new PlaneGeometry(1, 1), material);
    this.object.renderOrder = -5;
  }

  colour(ink: string, dark: boolean): void {
    this.object.material.uniforms["ink"]!.value = new Color(ink).convertLinearToSRGB();
    this.object.material.uniforms["strength"]!.value = dark ? 0.4 : 0.36;
  }

  /** Centred below what is looked at, with cells of this size [m]. */
  place(centre: Vector3, height: number, cell: number, reach: number): void {
    const { uniforms } = this.object.material;
    uniforms["cell"]!.value = cell;
    uniforms["reach"]!.value = reach;
    uniforms["centre"]!.value = [centre.x, centre.y];
    this.object.position.set(centre.x, centre.y, height);
    this.object.scale.setScalar(reach * 2);
  }
}
