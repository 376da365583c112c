/** The path as lines of constant width on the screen, coloured by the values of a column. */

import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { Colouring, Document, Header, Path as PathRecord, Rgb } from "./document";

export const ABOVE: Rgb = [200, 30, 30];
/** of what does not cut, whatever the column */
export const AIR: Rgb = [128, 138, 150];
const NONE: Rgb = [150, 156, 165];
const WIDTH = 2.2, THICK = 5;
/** of more segments the lines are one pixel wide: they lie next to one another, and cost a twentieth without a GPU */
const MANY = 8000;

export function rgb(hex: string): Rgb {
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)) as Rgb;
}

export function hex(colour: Rgb): string {
  return `#${colour.map((v) => v.toString(16).padStart(2, "0")).join("")}`;
}

/** Colour of a share 0 .. 1 of the scale. */
export function shade(scale: [number, string][], share: number): Rgb {
  const x = Math.min(Math.max(share, 0), 1);
  let k = 1;
  while (k < scale.length - 1 && scale[k][0] < x) k++;
  const [a, b] = [scale[k - 1], scale[k]], f = (x - a[0]) / (b[0] - a[0]);
  const [c, d] = [rgb(a[1]), rgb(b[1])];
  return c.map((v, i) => Math.round(v + f * (d[i] - v))) as Rgb;
}

/** Colours of the values of a column. */
export function coloured(values: Float32Array, above: Uint8Array | null, c: Colouring, header: Header): Rgb[] {
  const words = c.words.map((w) => rgb(w[1])), span = c.high - c.low;
  return Array.from(values, (v, k) => {
    if (above && above[k]) return ABOVE;
    if (!Number.isFinite(v)) return NONE;
    if (words.length) return v >= 0 ? words[v % words.length] : NONE;
    return shade(header.scale, span > 0 ? (v - c.low) / span : 0);
  });
}

/** How a segment is drawn: one that does not cut hides nothing, one beyond its limit is seen first. */
type Kind = "air" | "cut" | "beyond";

/** Lines one pixel wide between pairs of places, in the colours of their ends. */
function thin(place: number[], colour: number[]): { lines: THREE.LineSegments; material: THREE.Material } {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(place, 3));
  geometry.setAttribute("color", new THREE.Float32BufferAttribute(colour, 3));
  const material = new THREE.LineBasicMaterial({ vertexColors: true, toneMapped: false });
  return { lines: new THREE.LineSegments(geometry, material), material };
}

export class ToolPath {
  readonly group = new THREE.Group();
  readonly rows: Uint32Array;
  readonly points: Float32Array;
  readonly t: Float32Array;
  readonly s: Float32Array;
  readonly tool: Uint32Array;
  readonly line: Uint32Array | null;
  drawn: Float32Array = new Float32Array(0);
  drawnRows: Uint32Array = new Uint32Array(0);
  values: Float32Array | null = null;
  private readonly axes: Float32Array | null;
  private readonly apart: Uint8Array;
  private readonly sets: { lines: LineSegments2 | THREE.LineSegments; material: THREE.Material }[] = [];

  constructor(doc: Document, private readonly path: PathRecord) {
    this.rows = doc.u4(path.rows);
    this.points = doc.f4(path.points);
    this.axes = path.axes ? doc.f4(path.axes) : null;
    this.t = doc.f4(path.t);
    this.s = doc.f4(path.s);
    this.tool = doc.u4(path.tool);
    this.apart = doc.u1(path.apart);
    this.line = path.line ? doc.u4(path.line) : null;
  }

  get count(): number { return this.path.count; }

  /** Place of a row among those that are kept: a whole number and a share of the way to the next. */
  place(row: number): number {
    let a = 0, b = this.rows.length - 1;
    while (a < b) { const m = (a + b + 1) >> 1; if (this.rows[m] <= row) a = m; else b = m - 1; }
    return a;
  }

  /** Place at which a rising column (t or s) has a value, with its share. */
  at(column: Float32Array, value: number): number {
    let a = 0, b = column.length - 1;
    while (a < b) { const m = (a + b) >> 1; if (column[m] < value) a = m + 1; else b = m; }
    if (a === 0 || column[a] <= column[a - 1] || this.apart[a]) return a;
    return Math.min(a, a - 1 + Math.max(0, (value - column[a - 1]) / (column[a] - column[a - 1])));
  }

  /** Place, among the kept rows from one row to another, at which the tool's axis is nearest to a point, and how near. */
  nearest(point: THREE.Vector3, first: number, last: number): [number, number] {
    const tip = new THREE.Vector3(), axis = new THREE.Vector3();
    let best = this.place(first), closest = Infinity;
    for (let k = best; k <= this.place(last); k++) {
      const from = point.clone().sub(this.tip(k, tip)), along = Math.max(0, from.dot(this.axis(k, axis)));
      const far = from.addScaledVector(axis, -along).length();
      if (far < closest) { closest = far; best = k; }
    }
    return [best, closest];
  }

  tip(place: number, out: THREE.Vector3): THREE.Vector3 {
    const k = Math.floor(place), f = place - k, n = Math.min(k + 1, this.rows.length - 1);
    const p = this.points;
    return out.set(
      p[3 * k] + f * (p[3 * n] - p[3 * k]), p[3 * k + 1] + f * (p[3 * n + 1] - p[3 * k + 1]),
      p[3 * k + 2] + f * (p[3 * n + 2] - p[3 * k + 2]));
  }

  axis(place: number, out: THREE.Vector3): THREE.Vector3 {
    const a = this.axes, k = 3 * Math.round(place);
    return a ? out.set(a[k], a[k + 1], a[k + 2]).normalize() : out.set(0, 0, 1);
  }

  /** Draw the path in the colours of a column; null: nothing. */
  colour(doc: Document | null, c: Colouring | null, header: Header): void {
    for (const s of this.sets) { this.group.remove(s.lines); s.lines.geometry.dispose(); s.material.dispose(); }
    this.sets.length = 0;
    if (!doc || !c) return;
    const values = doc.f4(c.values), above = doc.u1(c.above), breaks = doc.u1(c.breaks), p = doc.f4(c.points);
    const air = c.air ? doc.u1(c.air) : null;
    const kind = (k: number): Kind => above[k] ? "beyond" : air && air[k] ? "air" : "cut";
    this.values = values;
    this.drawn = p;
    this.drawnRows = doc.u4(c.rows);
    const colours = coloured(values, above, c, header), linear = new THREE.Color();
    for (const drawn of ["air", "cut", "beyond"] as Kind[]) {
      const place: number[] = [], colour: number[] = [];
      for (let k = 1; k < values.length; k++) {
        if (breaks[k] || kind(k) !== drawn) continue;
        const [r, g, b] = drawn === "air" ? AIR : colours[k];
        linear.setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace);
        for (let n = 3 * k - 3; n < 3 * k + 3; n++) place.push(p[n]);
        colour.push(linear.r, linear.g, linear.b, linear.r, linear.g, linear.b);
      }
      if (!place.length) continue;
      if (drawn === "air" || (drawn === "cut" && place.length > 6 * MANY)) { this.sets.push(thin(place, colour)); continue; }
      const geometry = new LineSegmentsGeometry();
      geometry.setPositions(place);
      geometry.setColors(colour);
      const material = new LineMaterial({ linewidth: drawn === "beyond" ? THICK : WIDTH, vertexColors: true, toneMapped: false });
      const lines = new LineSegments2(geometry, material);
      this.sets.push({ lines, material });
    }
    for (const { lines } of this.sets) { lines.renderOrder = 3; this.group.add(lines); }
  }

  clip(planes: THREE.Plane[]): void {
    for (const s of this.sets) { s.material.clippingPlanes = planes; s.material.needsUpdate = true; }
  }
}
