/** The document that Python writes (chipload/report/view.py): a JSON header, and arrays that it names by their place. */

export interface Buffer { at: number; n: number; t: "f4" | "u4" | "u2" | "u1" }
export type Rgb = [number, number, number];
export type Triple = [number, number, number];

/** What the colours of a painted body mean: values with their colours, rising, and colours of what is no value. */
export interface MapLegend { title: string; stops: [number, string][]; words: [string, string][] }
export interface Body {
  name: string;
  kind: string;
  positions: Buffer;
  index: Buffer;
  colour?: Rgb;
  colours?: Buffer;
  legend?: MapLegend;
}
export interface Removal { low: Triple; high: Triple; step: Triple; vertices: Buffer; quads: Buffer; seen: Buffer; rows: Buffer }
export interface Path {
  count: number;
  rows: Buffer;
  points: Buffer;
  axes: Buffer | null;
  t: Buffer;
  s: Buffer;
  tool: Buffer;
  apart: Buffer;
  line: Buffer | null;
}
export interface CutterPart { kind: "flutes" | "shank" | "holder" | "pointer"; profile: [number, number][] }
export interface Mark { row: number; at: Triple; text: string; kind: "limit" | "collision" | "critical"; bodies: string[]; depth: number }
export interface Colouring {
  label: string;
  unit: string;
  low: number;
  high: number;
  limit: number | null;
  least: boolean;
  words: [string, string][];
  rows: Buffer;
  points: Buffer;
  breaks: Buffer;
  /** segments that do not cut; null: not known */
  air: Buffer | null;
  values: Buffer;
  above: Buffer;
  frames: Buffer | null;
  frames_above: Buffer | null;
}
/** Steps in cut: ranges of immersion with their chip thickness, force and torque over a revolution. */
export interface Engagement {
  stride: number;
  bounds: Record<string, number>;
  rotations: number;
  row: Buffer;
  tool: Buffer;
  flutes: Buffer;
  periods: Buffer;
  start: Buffer;
  frame: Buffer;
  ranges: Buffer;
  turn: Buffer;
}
/** Values on a surface, the limit as isolines, how the surface bends. */
export interface SurfaceMap {
  name: string;
  label: string;
  unit: string;
  low: number;
  high: number;
  limit: number | null;
  /** least and greatest allowed value of a deviation; null: that side, or both, are not limited */
  tolerance: [number | null, number | null] | null;
  positions: Buffer;
  index: Buffer;
  values: Buffer;
  lines: Buffer;
  moved: Buffer | null;
  lines_moved: Buffer | null;
}
/** Least stability margin of a tool over spindle speed, by tool number; speed and margin of each kept row, 0: none. */
export interface Stability {
  wanted: number;
  charts: Record<string, { rpm: number[]; margin: number[] }>;
  rpm: Buffer;
  margin: Buffer;
}
export interface Header {
  title: string;
  low: Triple;
  high: Triple;
  scale: [number, string][];
  bodies: Body[];
  removal: Removal | null;
  path: Path;
  cutters: Record<string, CutterPart[]>;
  marks: Mark[];
  colouring: Colouring | null;
  columns?: Colouring[];
  engagement?: Engagement | null;
  stability?: Stability | null;
  maps?: SurfaceMap[];
}

const MAGIC = 0x31564c43; // "CLV1"

/** A document in memory: its header, and its arrays on demand. */
export class Document {
  readonly header: Header;
  private readonly start: number;

  constructor(private readonly data: ArrayBuffer) {
    const view = new DataView(data);
    if (view.getUint32(0, true) !== MAGIC) throw new Error("no document of chipload");
    const length = view.getUint32(4, true);
    this.header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 8, length))) as Header;
    this.start = 8 + length;
  }

  f4(b: Buffer): Float32Array { return new Float32Array(this.data, this.start + b.at, b.n); }
  u4(b: Buffer): Uint32Array { return new Uint32Array(this.data, this.start + b.at, b.n); }
  u2(b: Buffer): Uint16Array { return new Uint16Array(this.data, this.start + b.at, b.n); }
  u1(b: Buffer): Uint8Array { return new Uint8Array(this.data, this.start + b.at, b.n); }
}

/** Of an address of this page. */
export async function fetched(url: string): Promise<Document> {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url}: ${answer.status}`);
  return new Document(await answer.arrayBuffer());
}

/** Of base64 text of its compressed bytes (zlib), as a report holds it. */
export async function unpacked(text: string): Promise<Document> {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Document(await new Response(stream).arrayBuffer());
}
