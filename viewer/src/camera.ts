/** Where the camera stands to see a box, and how the work turns under an upright tool. */

import * as THREE from "three";

const ROOM = 1.06;

/** Place a camera in a direction so far from a turned box that it is seen whole; the middle of the box. */
export function frame(camera: THREE.PerspectiveCamera, box: THREE.Box3, turned: THREE.Matrix4, away: THREE.Vector3, aspect: number): THREE.Vector3 {
  const { min, max } = box, middle = box.getCenter(new THREE.Vector3()).applyMatrix4(turned);
  const up = Math.abs(away.z) > 0.999 ? new THREE.Vector3(0, Math.sign(away.z), 0) : new THREE.Vector3(0, 0, 1);
  const right = new THREE.Vector3().crossVectors(up, away).normalize(), top = new THREE.Vector3().crossVectors(away, right);
  const half = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
  let far = 0;
  for (let n = 0; n < 8; n++) {
    const p = new THREE.Vector3(n & 1 ? max.x : min.x, n & 2 ? max.y : min.y, n & 4 ? max.z : min.z).applyMatrix4(turned).sub(middle);
    far = Math.max(far, p.dot(away) + Math.max(Math.abs(p.dot(top)) / half, Math.abs(p.dot(right)) / (half * aspect)));
  }
  camera.position.copy(middle).addScaledVector(away, ROOM * far);
  if (Math.abs(away.z) > 0.999) camera.position.y -= 1e-3 * far;
  return middle;
}

/** The turn that brings a tool's axis upright: about Z until it leans along X, then about Y, as C and B of a table do. */
export function uprighting(axis: THREE.Vector3): THREE.Quaternion {
  const lean = Math.acos(THREE.MathUtils.clamp(axis.z, -1, 1)), to = Math.atan2(axis.y, axis.x);
  const back = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), -lean);
  return lean < 1e-6 ? back.identity() : back.multiply(new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 0, 1), -to));
}
