/** The view cube: sides with the letters of their axes, drawn in a corner; a click looks from that side. */

import * as THREE from "three";

const SIDES: [string, string, THREE.Vector3][] = [
  ["X+", "#a33", new THREE.Vector3(1, 0, 0)], ["X\u2212", "#a33", new THREE.Vector3(-1, 0, 0)],
  ["Y+", "#276a2f", new THREE.Vector3(0, 1, 0)], ["Y\u2212", "#276a2f", new THREE.Vector3(0, -1, 0)],
  ["Z+", "#2a4fa0", new THREE.Vector3(0, 0, 1)], ["Z\u2212", "#2a4fa0", new THREE.Vector3(0, 0, -1)],
];
export const SIZE = 92;

function face(text: string, colour: string): THREE.Texture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const g = canvas.getContext("2d")!;
  g.fillStyle = "#fdfdfd";
  g.fillRect(0, 0, 128, 128);
  g.strokeStyle = "#9aa5b1";
  g.lineWidth = 6;
  g.strokeRect(3, 3, 122, 122);
  g.fillStyle = colour;
  g.font = "bold 62px system-ui, sans-serif";
  g.textAlign = "center";
  g.textBaseline = "middle";
  g.fillText(text, 64, 68);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}

/** How far a side's letters are turned so that they stand upright where z is up. */
const TURNS = [Math.PI / 2, -Math.PI / 2, Math.PI, 0, 0, 0];

export class ViewCube {
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.OrthographicCamera(-1.05, 1.05, 1.05, -1.05, 0.1, 10);
  private readonly box: THREE.Mesh;

  constructor() {
    const materials = SIDES.map(([text, colour], k) => {
      const map = face(text, colour);
      map.center.set(0.5, 0.5);
      map.rotation = TURNS[k];
      return new THREE.MeshBasicMaterial({ map });
    });
    this.box = new THREE.Mesh(new THREE.BoxGeometry(1.1, 1.1, 1.1), materials);
    this.scene.add(this.box);
  }

  draw(renderer: THREE.WebGLRenderer, away: THREE.Vector3, up: THREE.Vector3, width: number, bottom: number): void {
    this.camera.position.copy(away).normalize().multiplyScalar(4);
    this.camera.up.copy(up);
    this.camera.lookAt(0, 0, 0);
    renderer.autoClear = false;
    renderer.clearDepth();
    renderer.setViewport(width - SIZE - 4, bottom, SIZE, SIZE);
    renderer.render(this.scene, this.camera);
    renderer.autoClear = true;
  }

  /** Side at a place in the cube's square, -1 .. 1 to the right and up. */
  side(x: number, y: number): THREE.Vector3 | null {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
    const hit = ray.intersectObject(this.box)[0];
    return hit?.face ? hit.face.normal.clone() : null;
  }
}
