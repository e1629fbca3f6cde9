// A soft dark spot on the ground.

import { CanvasTexture, Mesh, MeshBasicMaterial, PlaneGeometry } from "three";

export function shadow(): Mesh<PlaneGeometry, MeshBasicMaterial> {
  const size = 128;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const pen = canvas.getContext("2d");
  if (pen) {
    const soft = pen.createRadialGradient(size / 2, size / 2, 0, size / 2, size / 2, size / 2);
    soft.addColorStop(0, "rgba(0,0,0,1)");
    soft.addColorStop(0.45, "rgba(0,0,0,0.55)");
    soft.addColorStop(1, "rgba(0,0,0,0)");
    pen.fillStyle = soft;
    pen.fillRect(0, 0, size, size);
  }
  const material = new MeshBasicMaterial({ map: new CanvasTexture(canvas), transparent: true, depthWrite: false });
  return new Mesh(new PlaneGeometry(2, 2), material);
}
