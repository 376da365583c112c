/** The engaged sector and the engaged surface of the cutter in the scene, coloured by chip thickness. */

import * as THREE from "three";
import { Document, Header } from "./document";
import { Teeth, patch, sector, teethOf, thickest } from "./engagement";
import { shade } from "./path";

export class EngagedCutter {
  readonly group = new THREE.Group();
  teeth: Teeth | null = null;
  private scale: [number, string][] = [];
  private sample = -1;

  load(doc: Document, header: Header): void {
    this.teeth = header.engagement ? new Teeth(doc, header.engagement) : null;
    this.scale = header.scale;
    this.sample = -1;
    this.clear();
  }

  /** Stand at a row, the tip at a place. */
  stand(row: number, tip: THREE.Vector3, seen: boolean): void {
    this.group.visible = seen;
    this.group.position.copy(tip);
    if (!this.teeth || !seen) return;
    const k = this.teeth.at(row);
    if (k === this.sample) return;
    this.sample = k;
    this.clear();
    if (k < 0) return;
    const s = this.teeth.sample(k), most = Math.max(...teethOf(s).map((t) => thickest(s, t)), 1e-12);
    const colour = (h: number) => {
      const [r, g, b] = shade(this.scale, h / most);
      return new THREE.Color().setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace);
    };
    // seen through the cutter and the stock, which it always lies in
    for (const [geometry, opacity] of [[sector(s), 0.55], [patch(s, colour), 0.9]] as [THREE.BufferGeometry, number][]) {
      const material = new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide, transparent: true, opacity, depthTest: false });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = 6;
      this.group.add(mesh);
    }
  }

  /** Triangles that are shown, for tests. */
  get triangles(): number {
    return (this.group.children as THREE.Mesh[]).reduce((n, m) => n + m.geometry.getAttribute("position").count / 3, 0);
  }

  private clear(): void {
    for (const m of this.group.children as THREE.Mesh[]) { m.geometry.dispose(); (m.material as THREE.Material).dispose(); }
    this.group.clear();
  }
}
