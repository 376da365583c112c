/** The corner or the edge of a body next to a place on it, as a measure catches it. */

import * as THREE from "three";

/** pixels within which a corner and an edge are caught */
const CORNER = 12, EDGE = 8;
/** cosine of the angle by which two faces must turn to meet in an edge, or two edges in a corner */
const SMOOTH = Math.cos(20 * Math.PI / 180);
/** faces that are compared at most: where there are more the catch is nearer */
const MOST = 800;

export interface Snap { place: THREE.Vector3; on: "corner" | "edge" | "face" }

/** Triangles of a mesh that are drawn, and whose box comes within a distance of a place. */
function around(mesh: THREE.Mesh, place: THREE.Vector3, reach: number): THREE.Triangle[] {
  const p = mesh.geometry.getAttribute("position"), index = mesh.geometry.getIndex()!, at = place.toArray(), out: THREE.Triangle[] = [];
  const values = p.array as Float32Array;
  for (let f = 0; f < Math.min(index.count, mesh.geometry.drawRange.count); f += 3) {
    const a = 3 * index.getX(f), b = 3 * index.getX(f + 1), c = 3 * index.getX(f + 2);
    let near = true;
    for (let i = 0; i < 3 && near; i++) {
      const u = values[a + i], v = values[b + i], w = values[c + i];
      near = Math.min(u, v, w) <= at[i] + reach && Math.max(u, v, w) >= at[i] - reach;
    }
    if (!near) continue;
    const one = new THREE.Triangle(...[a, b, c].map((k) => new THREE.Vector3().fromArray(values, k)) as [THREE.Vector3, THREE.Vector3, THREE.Vector3]);
    if (one.getArea() > 0) out.push(one);
  }
  return out;
}

interface Crease { line: THREE.Line3; along: THREE.Vector3; near: THREE.Vector3; far: number }

/** Edges at which faces turn, or at which a surface ends, within a distance of a place. */
function creases(faces: THREE.Triangle[], place: THREE.Vector3, reach: number, pixel: number): Crease[] {
  const normals = faces.map((f) => f.getNormal(new THREE.Vector3())), out: Crease[] = [], touch = new THREE.Vector3();
  faces.forEach((face, k) => {
    for (const [a, b] of [[face.a, face.b], [face.b, face.c], [face.c, face.a]]) {
      const line = new THREE.Line3(a, b), near = line.closestPointToPoint(place, true, new THREE.Vector3()), far = near.distanceTo(place);
      const length = line.distance();
      if (far > reach || length === 0) continue;
      // not at its end, where other faces touch it too
      const middle = line.getCenter(new THREE.Vector3()), inward = middle.clone().sub(near);
      const inside = near.clone().add(inward.clampLength(0, Math.min(pixel, 0.25 * length)));
      const beside = faces.flatMap((other, n) => n !== k && other.closestPointToPoint(inside, touch).distanceTo(inside) < 1e-3 * pixel ? [n] : []);
      if (beside.length && beside.every((n) => normals[n].dot(normals[k]) > SMOOTH)) continue;
      out.push({ line, along: b.clone().sub(a).normalize(), near, far });
    }
  });
  return out;
}

/** What is caught at a place on a mesh: a corner before an edge, an edge before the face; `pixel` is its size [mm]. */
export function snapped(mesh: THREE.Mesh, place: THREE.Vector3, pixel: number): Snap {
  let reach = CORNER * pixel, faces = around(mesh, place, reach);
  for (; faces.length > MOST && reach > pixel; reach /= 2) faces = around(mesh, place, reach / 2);
  if (faces.length > MOST) return { place, on: "face" };
  const found = creases(faces, place, reach, pixel), same = 1e-2 * pixel;
  let corner: THREE.Vector3 | null = null, closest = reach;
  for (const one of found) for (const end of [one.line.start, one.line.end]) {
    const far = end.distanceTo(place);
    if (far > closest || (corner && far === closest)) continue;
    const turns = found.some((other) => Math.abs(other.along.dot(one.along)) < SMOOTH
      && other.line.closestPointToPoint(end, true, new THREE.Vector3()).distanceTo(end) < same);
    if (turns) { corner = end; closest = far; }
  }
  if (corner) return { place: corner.clone(), on: "corner" };
  const edge = found.filter((one) => one.far <= Math.min(EDGE * pixel, reach)).sort((a, b) => a.far - b.far)[0];
  return edge ? { place: edge.near, on: "edge" } : { place, on: "face" };
}
