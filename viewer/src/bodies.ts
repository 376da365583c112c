/** Bodies that do not change, and the cutter. */

import * as THREE from "three";
import { Body, CutterPart, Document } from "./document";

const PARTS: Record<CutterPart["kind"], number> = { flutes: 0x5f7186, shank: 0x9aa5b1, holder: 0x6d5f86, pointer: 0x3c4654 };
const EDGE = 20;
/** opacity of a cutter: what it cuts is seen through it */
const CLEAR = 0.42;
export const HIT = new THREE.Color(0xd01414);

export class Solid {
  readonly mesh: THREE.Mesh;
  readonly group = new THREE.Group();
  private edges: THREE.LineSegments | null = null;
  private readonly colour: THREE.Color;
  private readonly painted: boolean;
  private readonly uniforms = { cap: { value: new THREE.Color() }, cut: { value: 0 } };

  constructor(doc: Document, readonly body: Body) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(doc.f4(body.positions), 3));
    geometry.setIndex(new THREE.BufferAttribute(doc.u4(body.index), 1));
    this.painted = Boolean(body.colours);
    if (body.colours) {
      const raw = doc.u1(body.colours), linear = new Float32Array(raw.length), c = new THREE.Color();
      for (let k = 0; k < raw.length; k += 3) {
        c.setRGB(raw[k] / 255, raw[k + 1] / 255, raw[k + 2] / 255, THREE.SRGBColorSpace);
        linear.set([c.r, c.g, c.b], k);
      }
      geometry.setAttribute("color", new THREE.BufferAttribute(linear, 3));
    }
    geometry.computeBoundingSphere();
    const [r, g, b] = body.colour ?? [255, 255, 255];
    this.colour = new THREE.Color().setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace);
    const material = new THREE.MeshStandardMaterial({
      color: this.colour, vertexColors: this.painted, roughness: 0.8, flatShading: true, side: THREE.DoubleSide,
      // where a part ends in the same plane as the stock the stock is seen: a gouge lays the part bare
      polygonOffset: true, polygonOffsetFactor: body.kind === "stock" ? 0 : 1.5, polygonOffsetUnits: body.kind === "stock" ? 0 : 8,
    });
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", "#include <common>\nuniform vec3 cap; uniform float cut;")
        .replace("#include <opaque_fragment>", "if (cut > 0.5 && !gl_FrontFacing) outgoingLight = cap;\n#include <opaque_fragment>");
    };
    this.mesh = new THREE.Mesh(geometry, material);
    this.mesh.name = body.name;
    this.mesh.renderOrder = 2;
    this.group.add(this.mesh);
  }

  glass(on: boolean): void {
    const m = this.mesh.material as THREE.MeshStandardMaterial;
    // a map stays to be read; a plain body becomes thin
    m.transparent = on;
    m.opacity = on ? (this.painted ? 0.75 : 0.16) : 1;
    m.depthWrite = !on || this.painted;
    m.needsUpdate = true;
    if (on && !this.edges) {
      const lines = new THREE.EdgesGeometry(this.mesh.geometry, EDGE);
      this.edges = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ color: this.colour.clone().multiplyScalar(0.6) }));
      this.group.add(this.edges);
    }
    if (this.edges) this.edges.visible = on;
  }

  hit(on: boolean): void {
    const m = this.mesh.material as THREE.MeshStandardMaterial;
    m.color.copy(on ? HIT : this.colour);
    m.vertexColors = this.painted && !on;
    m.needsUpdate = true;
  }

  clip(planes: THREE.Plane[]): void {
    // what is seen of the inside of a body that is cut is its section
    this.uniforms.cap.value.copy(this.painted ? new THREE.Color(0x8f99a5) : this.colour).multiplyScalar(0.75);
    this.uniforms.cut.value = planes.length;
    for (const o of [this.mesh, this.edges]) if (o) { (o.material as THREE.Material).clippingPlanes = planes; }
  }
}

/** A cutter of parts turned about its axis, its tip in the origin and its axis +z. */
export class Tool {
  readonly group = new THREE.Group();
  /** greatest radius of what cuts [mm] */
  readonly radius: number;
  private readonly parts = new Map<string, THREE.MeshStandardMaterial[]>();

  constructor(parts: CutterPart[]) {
    this.radius = Math.max(0, ...parts.filter((part) => part.kind === "flutes").flatMap((part) => part.profile.map(([r]) => r)));
    for (const part of parts) {
      const geometry = new THREE.LatheGeometry(part.profile.map(([r, z]) => new THREE.Vector2(r, z)), 48);
      geometry.rotateX(Math.PI / 2);
      const material = new THREE.MeshStandardMaterial({
        color: PARTS[part.kind], roughness: 0.45, metalness: 0.1, side: THREE.DoubleSide,
        transparent: part.kind !== "pointer", opacity: part.kind === "pointer" ? 1 : CLEAR, depthWrite: part.kind === "pointer",
      });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = 4;
      this.parts.set(part.kind, [...(this.parts.get(part.kind) ?? []), material]);
      this.group.add(mesh);
    }
  }

  /** Show parts in red: `shank or holder`, `cutting part`; "": none. */
  hit(what: string): void {
    for (const [kind, materials] of this.parts) {
      const own = what !== "" && (what.includes("cutting") ? kind === "flutes" : kind !== "flutes");
      for (const m of materials) { m.color.set(own ? HIT : PARTS[kind as CutterPart["kind"]]); m.opacity = own ? 1 : CLEAR; }
    }
  }
}
