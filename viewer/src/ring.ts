/** A ring around a place that is marked, of the same size on the screen from near and far. */

import * as THREE from "three";
import { Mark } from "./document";

/** width of a ring [pixels] */
export const RING = 40;
const COLOURS: Record<Mark["kind"], string> = { limit: "#d01414", collision: "#d01414", critical: "#1b4fd0" };
const textures = new Map<string, THREE.Texture>();

function texture(colour: string): THREE.Texture {
  const known = textures.get(colour);
  if (known) return known;
  const canvas = document.createElement("canvas"), g = canvas.getContext("2d")!;
  canvas.width = canvas.height = 128;
  for (const [width, style] of [[22, "#ffffff"], [13, colour]] as [number, string][]) {
    g.beginPath();
    g.arc(64, 64, 50, 0, 2 * Math.PI);
    g.lineWidth = width;
    g.strokeStyle = style;
    g.stroke();
  }
  const made = new THREE.CanvasTexture(canvas);
  made.colorSpace = THREE.SRGBColorSpace;
  textures.set(colour, made);
  return made;
}

export class Ring extends THREE.Sprite {
  constructor(mark: Mark) {
    super(new THREE.SpriteMaterial({ map: texture(COLOURS[mark.kind]), depthTest: false, depthWrite: false, toneMapped: false }));
    this.position.set(...mark.at);
    this.renderOrder = 8;
  }
}
