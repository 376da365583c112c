/** A length between two places that are clicked, drawn over everything. */

import * as THREE from "three";
import { number } from "./overlay";
import { Snap } from "./snap";

const BLUE = 0x1b4fd0;

export class Measure {
  readonly group = new THREE.Group();
  private picks: Snap[] | null = null;

  get on(): boolean { return this.picks !== null; }

  /** What is asked for; "": nothing. */
  get wanted(): string { return this.on ? "click two places" : ""; }

  /** Wait for two places, or stop. */
  begin(on: boolean): void {
    this.picks = on ? [] : null;
    this.group.clear();
  }

  /** A place as a ball of a radius; what is said: its own place, or the length once there are two. A third begins anew. */
  add(picked: Snap, radius: number): string {
    if (!this.picks) return "";
    if (this.picks.length === 2) this.begin(true);
    this.picks.push(picked);
    const { place, on } = picked;
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 12, 8), new THREE.MeshBasicMaterial({ color: BLUE, depthTest: false }));
    ball.position.copy(place);
    ball.renderOrder = 9;
    this.group.add(ball);
    if (this.picks.length < 2) {
      return `${on}: X ${number(place.x, 5)}  Y ${number(place.y, 5)}  Z ${number(place.z, 5)}   click the second place`;
    }
    const [a, b] = this.picks.map((pick) => pick.place), d = b.clone().sub(a);
    const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints([a, b]), new THREE.LineBasicMaterial({ color: BLUE, depthTest: false }));
    line.renderOrder = 9;
    this.group.add(line);
    return `${number(d.length(), 5)} mm   dX ${number(d.x, 5)}  dY ${number(d.y, 5)}  dZ ${number(d.z, 5)}   ${this.picks[0].on} to ${on}`;
  }
}
