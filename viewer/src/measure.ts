/** A length between two places that are clicked, drawn over everything. */

import * as THREE from "three";
import { number } from "./overlay";

const BLUE = 0x1b4fd0;

export class Measure {
  readonly group = new THREE.Group();
  private picks: THREE.Vector3[] | null = null;

  get on(): boolean { return this.picks !== null; }

  /** What is asked for; "": nothing. */
  get wanted(): string { return this.on ? "click two places" : ""; }

  /** Wait for two places, or stop. */
  begin(on: boolean): void {
    this.picks = on ? [] : null;
    this.group.clear();
  }

  /** A place as a ball of a radius; the length once there are two, else "". A third begins anew. */
  add(place: THREE.Vector3, radius: number): string {
    if (!this.picks) return "";
    if (this.picks.length === 2) this.begin(true);
    this.picks.push(place);
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 12, 8), new THREE.MeshBasicMaterial({ color: BLUE, depthTest: false }));
    ball.position.copy(place);
    ball.renderOrder = 9;
    this.group.add(ball);
    if (this.picks.length < 2) return "";
    const [a, b] = this.picks, d = b.clone().sub(a);
    const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints([a, b]), new THREE.LineBasicMaterial({ color: BLUE, depthTest: false }));
    line.renderOrder = 9;
    this.group.add(line);
    return `${number(d.length())} mm   dX ${number(d.x)}  dY ${number(d.y)}  dZ ${number(d.z)}`;
  }
}
