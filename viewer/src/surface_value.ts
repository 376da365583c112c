/** The value of a surface map at a place on or near its surface. */

import * as THREE from "three";
import { Document, SurfaceMap } from "./document";

/** Value of a map on its triangle that is nearest to a place; null: none within a distance, or none is known there. */
export function valueAt(doc: Document, map: SurfaceMap, place: THREE.Vector3, reach: number): number | null {
  const p = doc.f4(map.positions), index = doc.u4(map.index), values = doc.f4(map.values), at = place.toArray();
  const [a, b, c] = [0, 1, 2].map(() => new THREE.Vector3()), face = new THREE.Triangle(a, b, c);
  const foot = new THREE.Vector3(), share = new THREE.Vector3();
  let found: number | null = null, closest = reach;
  for (let f = 0; f < index.length; f += 3) {
    const ends = [index[f], index[f + 1], index[f + 2]];
    if (at.some((x, i) => Math.min(...ends.map((k) => p[3 * k + i])) > x + closest || Math.max(...ends.map((k) => p[3 * k + i])) < x - closest)) continue;
    [a, b, c].forEach((v, n) => v.fromArray(p, 3 * ends[n]));
    const far = face.closestPointToPoint(place, foot).distanceTo(place);
    if (far > closest || (found !== null && far === closest) || !face.getBarycoord(foot, share)) continue;
    closest = far;
    found = share.x * values[ends[0]] + share.y * values[ends[1]] + share.z * values[ends[2]];
  }
  return found !== null && Number.isFinite(found) ? found : null;
}
