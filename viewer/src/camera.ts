/** Where the camera stands to see a box, and how the work turns under an upright tool. */

import * as THREE from "three";

const ROOM = 1.06;
/** share of the box that a cutter is off its middle to be beside it, and the turn from there [deg] */
const BESIDE = 0.2, OBLIQUE = 35;
/** how many times as steep a view from higher up is */
const HIGHER = 2.5;

/** Middle of a turned box, and half the height of a picture from a direction that shows it whole. */
export function frame(box: THREE.Box3, turned: THREE.Matrix4, away: THREE.Vector3, aspect: number): { middle: THREE.Vector3; half: number } {
  const { min, max } = box, middle = box.getCenter(new THREE.Vector3()).applyMatrix4(turned);
  const up = Math.abs(away.z) > 0.999 ? new THREE.Vector3(0, Math.sign(away.z), 0) : new THREE.Vector3(0, 0, 1);
  const right = new THREE.Vector3().crossVectors(up, away).normalize(), top = new THREE.Vector3().crossVectors(away, right);
  let half = 1e-3;
  for (let n = 0; n < 8; n++) {
    const p = new THREE.Vector3(n & 1 ? max.x : min.x, n & 2 ? max.y : min.y, n & 4 ? max.z : min.z).applyMatrix4(turned).sub(middle);
    half = Math.max(half, Math.abs(p.dot(top)), Math.abs(p.dot(right)) / aspect);
  }
  return { middle, half: ROOM * half };
}

/** Direction from which a cutter at a place beside a box is seen, and what it cuts: three quarters from its side. */
export function cutterSide(box: THREE.Box3, tip: THREE.Vector3, axis: THREE.Vector3, usual: THREE.Vector3): THREE.Vector3 {
  const middle = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3());
  const aside = new THREE.Vector3((tip.x - middle.x) / Math.max(size.x, 1e-6), (tip.y - middle.y) / Math.max(size.y, 1e-6), 0);
  const out = usual.clone();
  if (aside.length() > BESIDE) {
    aside.normalize();
    const turned = [THREE.MathUtils.degToRad(OBLIQUE), -THREE.MathUtils.degToRad(OBLIQUE)].map((a) => aside.clone().applyAxisAngle(new THREE.Vector3(0, 0, 1), a));
    const best = turned[0].dot(usual) > turned[1].dot(usual) ? turned[0] : turned[1];
    out.set(best.x, best.y, 0).multiplyScalar(Math.hypot(usual.x, usual.y)).setZ(usual.z);
  }
  if (axis.z < -0.2) out.z *= -1;
  return out.normalize();
}

/** A direction, the same from the other three quarters, and these from higher up: to be tried in this order. */
export function sidesOf(first: THREE.Vector3): THREE.Vector3[] {
  const round = [0, 1, -1, 2].map((n) => first.clone().applyAxisAngle(new THREE.Vector3(0, 0, 1), n * Math.PI / 2));
  return [...round, ...round.map((side) => side.clone().setZ(side.z * HIGHER).normalize())];
}

/** The turn that brings a tool's axis upright: about Z until it leans along X, then about Y, as C and B of a table do. */
export function uprighting(axis: THREE.Vector3): THREE.Quaternion {
  const lean = Math.acos(THREE.MathUtils.clamp(axis.z, -1, 1)), to = Math.atan2(axis.y, axis.x);
  const back = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), -lean);
  return lean < 1e-6 ? back.identity() : back.multiply(new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 0, 1), -to));
}
