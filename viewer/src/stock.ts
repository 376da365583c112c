/** The stock at any frame: all quads are there at once, those that are seen in the frame are drawn. */

import * as THREE from "three";
import { Document, Removal, Rgb } from "./document";

const RAW = new THREE.Color(0xb98a4e), CUT = new THREE.Color(0x9fadbd), CAP = new THREE.Color(0x8d6a3b);
/** the last frame of a quad that stays, and the corners of the two triangles of a quad */
const NEVER = 65535, CORNERS = [0, 1, 2, 0, 2, 3];

/** Corners (q, 4, 3) from vertices and quads, which are held column by column as differences from the row before. */
function unrolled(doc: Document, removal: Removal): Uint16Array {
  const vertices = doc.u2(removal.vertices), quads = doc.u4(removal.quads), n = vertices.length / 3, m = quads.length / 4;
  const place = new Uint16Array(vertices.length), out = new Uint16Array(12 * m);
  for (let c = 0; c < 3; c++) for (let k = 0, sum = 0; k < n; k++) {
    sum = (sum + vertices[c * n + k]) & 0xffff;
    place[3 * k + c] = Math.min(sum * removal.step[c], 65535);
  }
  for (let c = 0; c < 4; c++) for (let k = 0, at = 0; k < m; k++) {
    at = (at + quads[c * m + k]) >>> 0;
    for (let i = 0; i < 3; i++) out[12 * k + 3 * c + i] = place[3 * at + i];
  }
  return out;
}

/** (4q, 4) on which side of its quad each corner lies, along X, Y and Z. Where a level or upright quad ends within the side of another,
    specks of what is behind show between the two, unless each is drawn half a pixel larger; the quads of other faces meet at corners. */
function outward(corners: Uint16Array): Int8Array {
  const out = new Int8Array(corners.length / 3 * 4);
  for (let q = 0, to = 0; q < corners.length; q += 12, to += 16) {
    let flat = false;
    for (let i = 0; i < 3; i++) {
      const a = corners[q + i], b = corners[q + 3 + i], c = corners[q + 6 + i], d = corners[q + 9 + i], sum = a + b + c + d;
      if (a === b && a === c && a === d) { flat = true; continue; }
      out[to + i] = 4 * a > sum ? 127 : 4 * a < sum ? -127 : 0;
      out[to + 4 + i] = 4 * b > sum ? 127 : 4 * b < sum ? -127 : 0;
      out[to + 8 + i] = 4 * c > sum ? 127 : 4 * c < sum ? -127 : 0;
      out[to + 12 + i] = 4 * d > sum ? 127 : 4 * d < sum ? -127 : 0;
    }
    if (!flat) out.fill(0, to, to + 16);
  }
  return out;
}

export class Stock {
  readonly mesh: THREE.Mesh;
  readonly group = new THREE.Group();
  readonly rows: Uint32Array;
  frame = -1;
  private readonly seen: Uint16Array;
  /** quads that are drawn, in the order of the index */
  private readonly drawn: Uint32Array;
  private readonly low: THREE.Vector3;
  private readonly uniforms = {
    raw: { value: RAW }, cap: { value: CAP }, shades: { value: null as THREE.Texture | null },
    size: { value: 1 }, glass: { value: 0 }, cut: { value: 0 }, grown: { value: 0 },
  };

  constructor(doc: Document, removal: Removal) {
    const corners = unrolled(doc, removal);
    this.seen = doc.u2(removal.seen);
    this.rows = doc.u4(removal.rows);
    this.low = new THREE.Vector3(...removal.low);
    const count = this.seen.length / 2;
    const scale = removal.low.map((a, i) => (removal.high[i] - a) / 65535);
    const position = new Float32Array(count * 12), birth = new Float32Array(count * 4);
    this.drawn = new Uint32Array(count);
    for (let k = 0; k < corners.length; k++) position[k] = removal.low[k % 3] + corners[k] * scale[k % 3];
    for (let q = 0; q < count; q++) birth.fill(this.seen[2 * q], 4 * q, 4 * q + 4);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setAttribute("birth", new THREE.BufferAttribute(birth, 1));
    geometry.setAttribute("outward", new THREE.BufferAttribute(outward(corners), 4, true));
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(count * 6), 1).setUsage(THREE.DynamicDrawUsage));
    geometry.computeBoundingSphere();
    const material = new THREE.MeshStandardMaterial({
      roughness: 0.75, metalness: 0.0, flatShading: true, side: THREE.DoubleSide,
    });
    material.onBeforeCompile = (shader) => this.dress(shader);
    this.mesh = new THREE.Mesh(geometry, material);
    this.mesh.renderOrder = 2;
    this.mesh.onBeforeRender = (renderer, _, camera) => this.grow(renderer, camera as THREE.OrthographicCamera);
    this.group.add(this.mesh);
    this.shade(null);
    this.at(0);
  }

  /** Stand at a row; true where that changes the picture. Row -1: before the first. */
  at(row: number): boolean {
    let a = 0, b = this.rows.length;
    while (a < b) { const m = (a + b) >> 1; if (this.rows[m] <= row) a = m + 1; else b = m; }
    const changed = a !== this.frame;
    this.frame = a;
    if (changed) this.choose();
    return changed;
  }

  /** Put the quads of the frame into the index: a twentieth of all, as a rule. */
  private choose(): void {
    const { geometry } = this.mesh, index = geometry.getIndex()!, to = index.array as Uint32Array, count = this.seen.length / 2;
    let n = 0;
    for (let q = 0; q < count; q++) {
      const last = this.seen[2 * q + 1];
      if (this.seen[2 * q] > this.frame || (this.frame >= last && last !== NEVER)) continue;
      for (let k = 0; k < 6; k++) to[6 * n + k] = 4 * q + CORNERS[k];
      this.drawn[n++] = q;
    }
    geometry.setDrawRange(0, 6 * n);
    index.clearUpdateRanges();
    index.addUpdateRange(0, 6 * n);
    index.needsUpdate = true;
  }

  /** Colours of what was cut in each frame; null: one colour for all that was cut. */
  shade(colours: Rgb[] | null): void {
    const all = colours ?? [[CUT.r, CUT.g, CUT.b].map((x) => 255 * x ** (1 / 2.2)) as Rgb];
    const data = new Uint8Array(all.length * 4);
    all.forEach((c, k) => data.set([c[0], c[1], c[2], 255], 4 * k));
    const texture = new THREE.DataTexture(data, all.length, 1);
    texture.colorSpace = THREE.SRGBColorSpace;
    texture.needsUpdate = true;
    this.uniforms.shades.value?.dispose();
    this.uniforms.shades.value = texture;
    this.uniforms.size.value = all.length;
  }

  /** Draw it as glass: its outline shows, and what is behind it too. */
  glass(on: boolean): void {
    const material = this.mesh.material as THREE.MeshStandardMaterial;
    material.transparent = on;
    material.depthWrite = !on;
    this.uniforms.glass.value = on ? 1 : 0;
    material.needsUpdate = true;
  }

  /** First and last row in which the face of a triangle was made; null: it is a face of the raw stock. */
  cutBy(face: number): [number, number] | null {
    const frame = this.seen[2 * this.drawn[face >> 1]];
    return frame === 0 ? null : [frame > 1 ? this.rows[frame - 2] + 1 : 0, this.rows[frame - 1]];
  }

  /** Cut away what lies beyond planes; what is then seen of the inside is its section. */
  clip(planes: THREE.Plane[]): void {
    (this.mesh.material as THREE.Material).clippingPlanes = planes;
    this.uniforms.cut.value = planes.length;
  }

  /** Volume within what is drawn, and number of its triangles. */
  measured(): { volume: number; triangles: number } {
    const p = this.mesh.geometry.getAttribute("position"), i = this.mesh.geometry.getIndex()!;
    const a = new THREE.Vector3(), b = new THREE.Vector3(), c = new THREE.Vector3();
    let six = 0, triangles = 0;
    for (let f = 0; f < this.mesh.geometry.drawRange.count / 3; f++) {
      [a, b, c].forEach((v, n) => v.fromBufferAttribute(p, i.getX(3 * f + n)).sub(this.low));
      six += a.dot(b.cross(c));
      triangles++;
    }
    return { volume: six / 6, triangles };
  }

  /** Draw each quad half a pixel larger to each side; as glass not, where it would show twice. */
  private grow(renderer: THREE.WebGLRenderer, camera: THREE.OrthographicCamera): void {
    const high = renderer.getDrawingBufferSize(new THREE.Vector2()).y;
    this.uniforms.grown.value = this.uniforms.glass.value ? 0 : 0.5 * (camera.top - camera.bottom) / camera.zoom / high;
  }

  private dress(shader: THREE.WebGLProgramParametersWithUniforms): void {
    Object.assign(shader.uniforms, this.uniforms);
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nattribute float birth; attribute vec4 outward; uniform float grown; varying float born;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\ntransformed += outward.xyz * grown;")
      .replace("#include <project_vertex>", "#include <project_vertex>\nborn = birth;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>
        uniform vec3 raw; uniform vec3 cap; uniform sampler2D shades; uniform float size; uniform float glass; uniform float cut;
        varying float born;`)
      .replace("#include <color_fragment>", `#include <color_fragment>
        diffuseColor.rgb = born < 0.5 ? raw : texture2D(shades, vec2((born - 0.5) / size, 0.5)).rgb;`)
      .replace("#include <opaque_fragment>", `
        if (glass > 0.5) {
          float edge = 1.0 - abs(dot(normalize(normal), normalize(vViewPosition)));
          diffuseColor.a = gl_FrontFacing ? 0.10 + 0.45 * edge * edge : 0.05;
        } else if (cut > 0.5 && !gl_FrontFacing) outgoingLight = cap;
        #include <opaque_fragment>`);
  }
}
