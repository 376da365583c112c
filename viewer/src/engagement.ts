/** What the teeth cut at a step: ranges of immersion, chip thickness, the chip as a body, the engaged sector.
 *
 * As in chipload/simulation/engagement_samples.py: frame T, n, A; u = cos(phi) n + sin(phi) T; the outward normal of the
 * cutter is nu = sin(kappa) u - cos(kappa) A; h = along sin(phi) + across cos(phi) + offset.
 */

import * as THREE from "three";
import { Document, Engagement } from "./document";

const WIDE = 12, FINE = Math.PI / 45, TURN = 2 * Math.PI;

/** A range of immersion of one piece of the edge. */
interface Range {
  from: number; to: number; along: number; offset: number; across: number;
  rho: [number, number]; z: [number, number]; sine: number; cosine: number; tooth: number;
}

/** One step. */
export interface Sample {
  row: number; tool: number; flutes: number; ranges: Range[];
  T: THREE.Vector3; n: THREE.Vector3; A: THREE.Vector3;
  /** x, y, z [N] and torque [N m] at even rotations */
  turn: Float32Array;
}

export function thickness(r: Range, phi: number): number {
  return Math.max(r.along * Math.sin(phi) + r.across * Math.cos(phi) + r.offset, 0);
}

/** Angles from one end of a range to the other. */
export function angles(r: Range): number[] {
  const n = Math.max(1, Math.ceil((r.to - r.from) / FINE));
  return Array.from({ length: n + 1 }, (_, k) => r.from + (r.to - r.from) * k / n);
}

export class Teeth {
  readonly rows: Uint32Array;
  readonly stride: number;
  readonly bounds: Record<string, number>;
  private readonly tool: Uint32Array;
  private readonly flutes: Uint32Array;
  private readonly periods: Uint32Array;
  private readonly start: Uint32Array;
  private readonly frame: Float32Array;
  private readonly ranges: Float32Array;
  private readonly turn: Float32Array;

  constructor(doc: Document, private readonly e: Engagement) {
    this.stride = e.stride;
    this.bounds = e.bounds;
    [this.rows, this.tool, this.flutes, this.periods, this.start] = [e.row, e.tool, e.flutes, e.periods, e.start].map((b) => doc.u4(b));
    [this.frame, this.ranges, this.turn] = [e.frame, e.ranges, e.turn].map((b) => doc.f4(b));
  }

  /** Number of the sample that stands for a row, -1: the teeth do not cut there. */
  at(row: number): number {
    let a = 0, b = this.rows.length - 1;
    while (a < b) { const m = (a + b) >> 1; if (this.rows[m] < row) a = m + 1; else b = m; }
    const far = (k: number) => Math.abs(this.rows[k] - row);
    const k = a > 0 && far(a - 1) <= far(a) ? a - 1 : a;
    return far(k) <= this.stride / 2 ? k : -1;
  }

  sample(k: number): Sample {
    const f = this.frame, g = 9 * k, m = this.e.rotations * 4, ranges: Range[] = [];
    for (let b = this.start[k]; b < this.start[k + 1]; b++) {
      const v = this.ranges.subarray(WIDE * b, WIDE * b + WIDE);
      ranges.push({
        from: v[0], to: v[1], along: v[2], offset: v[3], across: v[4], rho: [v[5], v[7]], z: [v[6], v[8]],
        sine: v[9], cosine: v[10], tooth: v[11],
      });
    }
    const period = this.turn.subarray(m * k, m * (k + 1)), turn = new Float32Array(m * this.periods[k]);
    for (let p = 0; p < this.periods[k]; p++) turn.set(period, m * p);
    return {
      row: this.rows[k], tool: this.tool[k], flutes: this.flutes[k], ranges,
      T: new THREE.Vector3(f[g], f[g + 1], f[g + 2]), n: new THREE.Vector3(f[g + 3], f[g + 4], f[g + 5]),
      A: new THREE.Vector3(f[g + 6], f[g + 7], f[g + 8]), turn,
    };
  }
}

/** Teeth that cut differently, in their order; [-1]: all alike. */
export function teethOf(s: Sample): number[] {
  return [...new Set(s.ranges.map((r) => r.tooth))].sort((a, b) => a - b);
}

/** Ranges of immersion of all pieces of the edge together, rising, each [from, to]. */
export function sectors(s: Sample): [number, number][] {
  const own = s.ranges.map((r) => [r.from, r.to] as [number, number]).sort((a, b) => a[0] - b[0]), out: [number, number][] = [];
  for (const [a, b] of own) {
    const last = out[out.length - 1];
    if (last && a <= last[1] + 1e-4) last[1] = Math.max(last[1], b); else out.push([a, b]);
  }
  // one that goes on over a full turn
  const last = out[out.length - 1];
  if (out.length > 1 && last[1] - TURN >= out[0][0] - 1e-4) { out[0][0] = last[0] - TURN; out.pop(); }
  return out;
}

/** Greatest thickness of a tooth, or of all, at even angles of immersion [mm]. */
export function profile(s: Sample, tooth: number, count: number): Float64Array {
  const out = new Float64Array(count);
  for (const r of s.ranges) {
    if (r.tooth !== tooth && r.tooth >= 0 && tooth >= 0) continue;
    const first = Math.ceil(r.from / TURN * count - 1e-6), last = Math.floor(r.to / TURN * count + 1e-6);
    for (let k = first; k <= last; k++) {
      const at = ((k % count) + count) % count;
      out[at] = Math.max(out[at], thickness(r, TURN * k / count));
    }
  }
  return out;
}

export function thickest(s: Sample, tooth: number): number {
  let most = 0;
  for (const r of s.ranges) if (r.tooth === tooth) for (const phi of angles(r)) most = Math.max(most, thickness(r, phi));
  return most;
}

/** Volume of the chip of a tooth [mm^3]: h rho over immersion and edge. */
export function volume(s: Sample, tooth: number): number {
  let sum = 0;
  for (const r of s.ranges) {
    if (r.tooth !== tooth) continue;
    const edge = Math.hypot(r.rho[1] - r.rho[0], r.z[1] - r.z[0]) * 0.5 * (r.rho[0] + r.rho[1]);
    sum += edge * (r.along * (Math.cos(r.from) - Math.cos(r.to)) + r.across * (Math.sin(r.to) - Math.sin(r.from)) +
      r.offset * (r.to - r.from));
  }
  return sum;
}

export type Shade = (h: number) => THREE.Color;

class Faces {
  readonly place: number[] = [];
  readonly colour: number[] = [];

  quad(p: THREE.Vector3[], c: THREE.Color[]): void {
    for (const k of [0, 1, 2, 0, 2, 3]) { this.place.push(p[k].x, p[k].y, p[k].z); this.colour.push(c[k].r, c[k].g, c[k].b); }
  }

  geometry(): THREE.BufferGeometry {
    const g = new THREE.BufferGeometry();
    g.setAttribute("position", new THREE.Float32BufferAttribute(this.place, 3));
    g.setAttribute("color", new THREE.Float32BufferAttribute(this.colour, 3));
    g.computeVertexNormals();
    return g;
  }
}

function radial(s: Sample, phi: number): THREE.Vector3 {
  return s.n.clone().multiplyScalar(Math.cos(phi)).addScaledVector(s.T, Math.sin(phi));
}

/** Surface of the cutter that is in material, coloured by thickness; the tip is the origin. */
export function patch(s: Sample, shade: Shade, grow = 1.01): THREE.BufferGeometry {
  const out = new Faces();
  for (const r of s.ranges) {
    let before: [THREE.Vector3, THREE.Vector3, THREE.Color] | null = null;
    for (const phi of angles(r)) {
      const u = radial(s, phi), c = shade(thickness(r, phi));
      const [low, high] = [0, 1].map((e) => u.clone().multiplyScalar(grow * r.rho[e]).addScaledVector(s.A, r.z[e]));
      if (before) out.quad([before[0], low, high, before[1]], [before[2], c, c, before[2]]);
      before = [low, high, c];
    }
  }
  return out.geometry();
}

/** The engaged sector across the axis, at the upper end of the engaged edge; the tip is the origin. */
export function sector(s: Sample): THREE.BufferGeometry {
  const rho = Math.max(...s.ranges.map((r) => Math.max(...r.rho))), z = Math.max(...s.ranges.map((r) => Math.max(...r.z)));
  const middle = s.A.clone().multiplyScalar(z), out = new Faces(), c = new THREE.Color(0xd97706);
  for (const [from, to] of sectors(s)) {
    const n = Math.max(1, Math.ceil((to - from) / FINE));
    for (let k = 0; k < n; k++) {
      const [a, b] = [k, k + 1].map((m) => radial(s, from + (to - from) * m / n).multiplyScalar(rho).add(middle));
      out.quad([middle, a, b, b], [c, c, c, c]);
    }
  }
  return out.geometry();
}

/** The undeformed chip of a tooth, its thickness drawn `times` as large; the tip is the origin. */
export function chip(s: Sample, tooth: number, times: number, shade: Shade): THREE.BufferGeometry {
  const out = new Faces();
  for (const r of s.ranges) {
    if (r.tooth !== tooth) continue;
    // of each angle the corners: outside low and high, inside low and high
    const rows = angles(r).map((phi) => {
      const u = radial(s, phi), h = thickness(r, phi), c = shade(h);
      const nu = u.clone().multiplyScalar(r.sine).addScaledVector(s.A, -r.cosine);
      const outer = [0, 1].map((e) => u.clone().multiplyScalar(r.rho[e]).addScaledVector(s.A, r.z[e]));
      return { p: [...outer, ...outer.map((p) => p.clone().addScaledVector(nu, -times * h))], c };
    });
    const cap = (k: number) => { const { p, c } = rows[k]; out.quad([p[0], p[1], p[3], p[2]], [c, c, c, c]); };
    cap(0);
    cap(rows.length - 1);
    for (let k = 1; k < rows.length; k++) {
      const [a, b] = [rows[k - 1], rows[k]], c = [a.c, b.c, b.c, a.c];
      for (const [m, n] of [[0, 1], [2, 3], [0, 2], [1, 3]]) out.quad([a.p[m], b.p[m], b.p[n], a.p[n]], c);
    }
  }
  return out.geometry();
}
