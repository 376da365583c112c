/** A surface map: values as colours, the limit as red lines, bent by a factor. */

import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { Document, Header, MapLegend, SurfaceMap } from "./document";
import { number } from "./overlay";
import { shade } from "./path";

/** the greatest displacement is drawn as at most this share of the size of the surface */
const BENT = 0.12;
const STOPS = 5;
/** below, within and above the tolerance, as in CAD and CAM; the three differ in brightness too */
const BANDS: [number, number, number][] = [[179, 32, 28], [104, 190, 120], [52, 98, 216]];
/** width of the lines of the limit [pixels] */
const WIDTH = 2.2;

export class MapBody {
  readonly group = new THREE.Group();
  readonly mesh: THREE.Mesh;
  readonly lines: LineSegments2;
  private readonly places: [(to: Float32Array) => void, Float32Array, Float32Array | null][];
  factor = 0;

  constructor(doc: Document, readonly map: SurfaceMap, private readonly header: Header, readonly banded = false) {
    const values = doc.f4(map.values), colours = new Float32Array(3 * values.length), c = new THREE.Color();
    values.forEach((v, k) => {
      const [r, g, b] = Number.isFinite(v) ? this.colour(v) : [150, 156, 165];
      c.setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace).toArray(colours, 3 * k);
    });
    const geometry = new THREE.BufferGeometry(), line = new LineSegmentsGeometry();
    const flat = doc.f4(map.positions), ends = doc.f4(map.lines);
    geometry.setAttribute("position", new THREE.BufferAttribute(flat.slice(), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    geometry.setIndex(new THREE.BufferAttribute(doc.u4(map.index), 1));
    line.setPositions(ends.length ? ends.slice() : new Float32Array(6));
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({
      vertexColors: true, roughness: 0.85, flatShading: true, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 8,
    }));
    this.lines = new LineSegments2(line, new LineMaterial({ color: 0xd01414, linewidth: WIDTH, toneMapped: false }));
    this.lines.visible = ends.length > 0;
    this.mesh.frustumCulled = this.lines.frustumCulled = false;
    this.lines.renderOrder = 3;
    this.group.add(this.mesh, this.lines);
    this.places = [
      [(to) => { geometry.setAttribute("position", new THREE.BufferAttribute(to, 3)); }, flat, map.moved ? doc.f4(map.moved) : null],
      [(to) => { line.setPositions(to); }, ends, map.lines_moved ? doc.f4(map.lines_moved) : null],
    ];
  }

  /** Greatest factor of the displacement; 0: nothing bends. */
  get most(): number {
    const moved = this.places[0][2];
    if (!moved) return 0;
    let far = 0;
    for (let k = 0; k < moved.length; k += 3) far = Math.max(far, Math.hypot(moved[k], moved[k + 1], moved[k + 2]));
    const box = new THREE.Box3().setFromArray(this.places[0][1] as unknown as number[]);
    return far > 0 ? BENT * box.getSize(new THREE.Vector3()).length() / far : 0;
  }

  /** Draw the displacement `factor` times as large. */
  bend(factor: number): void {
    this.factor = factor;
    for (const [put, flat, moved] of this.places) if (moved?.length) put(flat.map((x, k) => x + factor * moved[k]));
  }

  /** Place on the surface that does not bend, where the surface as it is drawn was hit; in coordinates of the world. */
  unbent(hit: THREE.Intersection): THREE.Vector3 {
    const flat = this.places[0][1], share = hit.barycoord!.toArray(), out = new THREE.Vector3();
    [hit.face!.a, hit.face!.b, hit.face!.c].forEach((k, n) => out.addScaledVector(new THREE.Vector3().fromArray(flat, 3 * k), share[n]));
    return this.mesh.localToWorld(out);
  }

  legend(): MapLegend {
    const { label, unit, high, limit } = this.map, hex = (v: number) => "#" + this.colour(v).map((x) => x.toString(16).padStart(2, "0")).join("");
    // next to the greatest value it is nothing
    const low = Math.abs(this.map.low) < 1e-4 * Math.abs(high) ? 0 : this.map.low;
    const stops = Array.from({ length: STOPS }, (_, k) => low + (high - low) * k / (STOPS - 1)).map((v) => [v, hex(v)] as [number, string]);
    const [least, most] = this.map.tolerance ?? [null, null], text = (v: number) => number(v, 6);
    if (this.banded) {
      const names = [least === null ? "" : `below ${text(least)}`, "within the tolerance", most === null ? "" : `above ${text(most)}`];
      const colours = BANDS.map((c) => "#" + c.map((x) => x.toString(16).padStart(2, "0")).join(""));
      const bands = names.map((name, k) => [name, colours[k]] as [string, string]).filter(([name]) => name);
      return { title: unit ? `${label} [${unit}]` : label, stops: [], words: bands };
    }
    const words: [string, string][] = limit !== null && this.map.lines.n ? [[`limit ${number(limit, 6)}`, "#d01414"]] : [];
    return { title: unit ? `${label} [${unit}]` : label, stops, words };
  }

  clip(planes: THREE.Plane[]): void {
    for (const o of [this.mesh, this.lines]) (o.material as THREE.Material).clippingPlanes = planes;
  }

  dispose(): void {
    for (const o of [this.mesh, this.lines]) { o.geometry.dispose(); (o.material as THREE.Material).dispose(); }
  }

  private colour(v: number): [number, number, number] {
    const { low, high, tolerance } = this.map;
    if (this.banded && tolerance) return BANDS[v < (tolerance[0] ?? -Infinity) ? 0 : v > (tolerance[1] ?? Infinity) ? 2 : 1];
    return shade(this.header.scale, high > low ? (v - low) / (high - low) : 0);
  }
}
