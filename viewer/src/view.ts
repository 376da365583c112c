/** The 3D view of a result, for the page and the report: bodies, stock at a row, path, cutter, marks, measures. */

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Solid, Tool } from "./bodies";
import { cutterSide, frame, sidesOf, uprighting } from "./camera";
import { SIZE, ViewCube } from "./cube";
import { Colouring, Document, Header, Mark, Rgb } from "./document";
import { EngagedCutter } from "./engaged";
import { Teeth } from "./engagement";
import { Measure } from "./measure";
import { Overlay, number } from "./overlay";
import { Abscissa, Pair, between } from "./pair";
import { ToolPath, coloured } from "./path";
import { RING, Ring } from "./ring";
import { darkNow, onPrint } from "./print";
import { recorded, saved } from "./save";
import { snapped } from "./snap";
import { Stock } from "./stock";
import { MapBody } from "./surface";
import { valueAt } from "./surface_value";

const BACKGROUND = 0xeef1f5, DARK = 0x1b2128;
/** pixels within which the path is shown by the pointer, and within which it is clicked before a face behind it */
const NEAR = 14, GRAB = 5;
/** of the size of what is shown: how far a map may lie from the face that is clicked, and the path from what hides it */
const ALONG = 0.01;
/** the scale on a dark ground: as bright at its end, and seen at its beginning */
const DARK_SCALE: [number, string][] = [[0, "#7d6fd6"], [0.25, "#4f97d8"], [0.5, "#22c29a"], [0.75, "#9bd93c"], [1, "#fbb61a"]];
/** distance of the camera, and half the height of a picture of a mark, in sizes of what is shown */
const AWAY = 6, CLOSE = 0.24;
const VIEWS: Record<string, [number, number, number]> = {
  iso: [0.62, -1, 0.78], top: [0, -0.001, 1], front: [0, -1, 0.02], side: [1, 0, 0.02], below: [0, -0.001, -1],
};
/** end of the name of a map in the colours of its tolerance */
export const BANDED = "|tolerance";
type Layer = "stock" | "path" | "cutter" | "marks" | string;
/** Why a view tells its row: it plays, it was stopped, it came to the end, its path was clicked. */
export type Why = "playing" | "stopped" | "ended" | "clicked";

export class View {
  readonly overlay: Overlay;
  header!: Header;
  stock: Stock | null = null;
  path!: ToolPath;
  solids: Solid[] = [];
  row = -1;
  frames = 0;
  leads = 0;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  /** all that belongs to the work; it turns where the tool stands upright */
  private readonly work = new THREE.Group();
  private readonly camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1000);
  /** half the height of the picture at zoom 1 [mm] */
  private half = 1;
  private readonly controls: OrbitControls;
  private readonly cube = new ViewCube();
  private tools = new Map<number, Tool>();
  private readonly marks = new THREE.Group();
  private readonly measure = new Measure();
  private readonly engaged = new EngagedCutter();
  /** told where the view stands */
  readonly stood = new Set<() => void>();
  private colouring: Colouring | null = null;
  private painted: Document | null = null;
  private lightScale: [number, string][] | null = null;
  private hidden = new Set<Layer>();
  /** the section as it lies in the view, and in the work */
  private plane: THREE.Plane | null = null;
  private uncut: THREE.Plane | null = null;
  private upright = false;
  private dirty = true;
  private paper: HTMLCanvasElement | null = null;
  private draped = false;
  private shades: Rgb[] | null = null;
  private place = 0;
  private rate = 0;
  private wanted = 0;
  private pending: [number, boolean] | null = null;
  private told = 0;
  private before = 0;
  private recorder: MediaRecorder | null = null;
  private pair: Pair<View> | null = null;
  private shownMap: MapBody | null = null;
  private doc!: Document;
  private speeds: { rpm: Float32Array; margin: Float32Array } | null = null;

  constructor(readonly host: HTMLElement) {
    this.overlay = new Overlay(host);
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    const canvas = this.renderer.domElement;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "3D view");
    canvas.tabIndex = -1;
    this.overlay.stage.prepend(canvas);
    this.scene.background = new THREE.Color(BACKGROUND);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d99a8, 1.5), this.camera, this.work);
    this.work.add(this.marks, this.measure.group, this.engaged.group);
    const lamp = new THREE.DirectionalLight(0xffffff, 1.7);
    lamp.position.set(0.4, 0.7, 1);
    this.camera.add(lamp);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => { this.dirty = true; this.follow(); });
    canvas.addEventListener("pointermove", (e) => this.hover(e));
    canvas.addEventListener("pointerleave", () => this.overlay.values(""));
    let down: [number, number] = [0, 0];
    canvas.addEventListener("pointerdown", (e) => { down = [e.clientX, e.clientY]; });
    canvas.addEventListener("click", (e) => {
      if (Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 5) this.click(e);
    });
    new MutationObserver(() => { this.dirty = true; this.relight(); }).observe(document.body, { attributeFilter: ["class"] });
    onPrint((now) => { this.relight(); this.draw(); this.onPaper(now); });
    new ResizeObserver(() => { this.dirty = true; }).observe(this.overlay.stage);
    const loop = (now: number) => {
      if (!host.isConnected) { this.renderer.dispose(); return; }
      this.advance(now);
      if (this.dirty) this.draw();
      requestAnimationFrame(loop);
    };
    requestAnimationFrame(loop);
  }

  /** Show a document; `keep` leaves the camera where it is; bodies and maps may be those of another document. */
  load(doc: Document, keep = false, bodies = doc): void {
    const h = (this.header = doc.header);
    this.doc = bodies;
    this.map("");
    for (const s of this.solids) this.work.remove(s.group);
    if (this.stock) this.work.remove(this.stock.group);
    if (this.path) this.work.remove(this.path.group);
    for (const t of this.tools.values()) this.work.remove(t.group);
    this.solids = bodies.header.bodies.filter((b) => b.kind !== "stock" || !h.removal).map((b) => new Solid(bodies, b));
    this.stock = h.removal ? new Stock(doc, h.removal) : null;
    this.path = new ToolPath(doc, h.path);
    this.engaged.load(doc, h);
    this.speeds = h.stability ? { rpm: doc.f4(h.stability.rpm), margin: doc.f4(h.stability.margin) } : null;
    this.tools = new Map(Object.entries(h.cutters).map(([n, parts]) => [Number(n), new Tool(parts)]));
    this.work.add(...this.solids.map((s) => s.group), this.path.group, ...[...this.tools.values()].map((t) => t.group));
    if (this.stock) this.work.add(this.stock.group);
    this.marks.clear();
    for (const m of h.marks) {
      this.marks.add(new Ring(m));
    }
    this.colouring = h.colouring;
    this.painted = doc;
    this.relight();
    this.row = -1;
    this.go(this.wanted);
    this.layers();
    if (!keep) this.lookFrom(this.firstSide());
    this.overlay.message("");
    if (this.pending) { this.show(...this.pending); this.pending = null; }
  }

  /** Colour the path, and what was cut, by a column. */
  colour(doc: Document | null, c: Colouring | null): void {
    this.colouring = c;
    this.painted = doc;
    this.path.colour(doc, c, this.header);
    this.path.clip(this.plane ? [this.plane] : []);
    this.legend();
    this.shades = doc && c?.frames
      ? coloured(doc.f4(c.frames), c.frames_above ? doc.u1(c.frames_above) : null, c, this.header) : null;
    this.stock?.shade(this.draped ? this.shades : null);
    this.dirty = true;
  }

  /** The ground and the scale are those of a dark page or of a light one. */
  private relight(): void {
    const dark = darkNow();
    (this.scene.background as THREE.Color).set(dark ? DARK : BACKGROUND);
    if (!this.header) return;
    this.lightScale ??= this.header.scale;
    this.header.scale = dark ? DARK_SCALE : this.lightScale;
    this.colour(this.painted, this.colouring);
    const map = this.shownMap;
    if (map) { const share = map.most > 0 ? map.factor / map.most : 0; this.map(""); this.map(map.map.name + (map.banded ? BANDED : ""), share); }
  }

  /** A printer takes the picture of a canvas that is drawn in two dimensions, not the one that is just being drawn. */
  private onPaper(now: boolean): void {
    this.paper?.remove();
    this.paper = null;
    if (!now) return;
    const shown = this.renderer.domElement, paper = document.createElement("canvas");
    Object.assign(paper, { width: shown.width, height: shown.height });
    paper.getContext("2d")!.drawImage(shown, 0, 0);
    shown.after(paper);
    this.paper = paper;
  }

  private legend(): void {
    const maps = this.solids.filter((s) => s.group.visible).map((s) => s.body.legend);
    this.overlay.legend(this.header, this.colouring, [...maps.filter((m) => m !== undefined), ...(this.shownMap ? [this.shownMap.legend()] : [])]);
  }

  /** Show a surface map in the place of part and stock, bent by a share of the greatest factor; "": none. The factor.
   * A name that ends with BANDED is shown in the colours of the tolerance. */
  map(name: string, share = 0): number {
    const banded = name.endsWith(BANDED), own = banded ? name.slice(0, -BANDED.length) : name;
    const found = this.doc?.header.maps?.find((m) => m.name === own);
    if (this.shownMap && (this.shownMap.map !== found || this.shownMap.banded !== banded)) {
      this.work.remove(this.shownMap.group);
      this.shownMap.dispose();
      this.shownMap = null;
    }
    if (found && !this.shownMap) {
      this.shownMap = new MapBody(this.doc, found, this.header, banded);
      this.shownMap.clip(this.plane ? [this.plane] : []);
      this.work.add(this.shownMap.group);
    }
    this.shownMap?.bend(share * this.shownMap.most);
    this.layers();
    return this.shownMap?.factor ?? 0;
  }

  /** Show the values of the column on what was cut there. */
  drape(on: boolean): void {
    this.draped = on;
    this.stock?.shade(on ? this.shades : null);
    this.dirty = true;
  }

  /** Stand at a row of the history. */
  go(row: number): void {
    this.wanted = row;
    if (this.path) this.stand(this.path.place(row), row);
  }

  /** Stand where time (or path) has a value. */
  abscissa(value: number, against: Abscissa = "time"): void {
    if (!this.header) return;
    this.stand(this.path.at(against === "time" ? this.path.t : this.path.s, value));
  }

  /** Play: seconds of the machine in a second; 0 stops, and tells the row at which it stands. */
  play(rate: number): void {
    const stops = this.rate > 0 && rate <= 0;
    this.rate = rate;
    if (stops) this.tellRow(this.row, "stopped");
    this.before = performance.now();
  }

  get teeth(): Teeth | null { return this.engaged.teeth; }

  /** Tool, spindle speed and stability margin where it stands; null: the result knows no stability. */
  operating(): { tool: number; rpm: number; margin: number } | null {
    const k = Math.floor(this.place), s = this.speeds;
    return s ? { tool: this.path.tool[k], rpm: s.rpm[k], margin: s.margin[k] } : null;
  }

  get playing(): boolean { return this.rate > 0; }

  shows(name: Layer): boolean { return !this.hidden.has(name); }

  layer(name: Layer, on: boolean): void {
    if (on) this.hidden.delete(name); else this.hidden.add(name);
    this.layers();
  }

  /** See through bodies: their edges and maps stay. */
  glass(on: boolean): void {
    this.stock?.glass(on);
    for (const s of this.solids) s.glass(on);
    this.section(this.cut.axis, this.cut.share);
    this.dirty = true;
  }

  private cut: { axis: string; share: number } = { axis: "", share: 0.5 };

  /** Cut away what lies beyond a plane across x, y or z at a share of the box; "": nothing. */
  section(axis: string, share: number): void {
    this.cut = { axis, share };
    if (!this.header) return;
    const k = "xyz".indexOf(axis), { low, high } = this.header;
    this.plane = null;
    this.uncut = null;
    if (axis && k >= 0) {
      const normal = new THREE.Vector3().setComponent(k, -1);
      // from the side that the camera looks from in the first view
      if (k === 1) normal.negate();
      const at = low[k] + share * (high[k] - low[k]);
      this.uncut = new THREE.Plane(normal, k === 1 ? -at : at);
      this.plane = this.uncut.clone().applyMatrix4(this.work.matrixWorld);
    }
    const planes = this.plane ? [this.plane] : [];
    for (const s of this.solids) s.clip(planes);
    this.shownMap?.clip(planes);
    this.stock?.clip(planes);
    this.path.clip(planes);
    this.dirty = true;
  }

  look(name: string): void {
    if (!this.header) return;
    const away = new THREE.Vector3(...(VIEWS[name] ?? VIEWS.iso)).normalize();
    this.lookFrom(away);
  }

  /** Look nearer at the tip, by a share of the way there. */
  closer(share: number): void {
    const to = this.work.localToWorld(this.path.tip(this.place, new THREE.Vector3())), shift = to.sub(this.controls.target).multiplyScalar(share);
    this.controls.target.add(shift);
    this.camera.position.add(shift);
    this.camera.zoom /= 1 - share;
    this.controls.update();
    this.dirty = true;
  }

  /** Show a mark: the tool stands there, what touches is red, the camera comes near. */
  show(k: number, near = true): void {
    if (!this.header) { this.pending = [k, near]; return; }
    const mark = this.header.marks[k];
    if (!mark) return;
    this.go(mark.row);
    this.touch(mark);
    if (!near) return;
    const to = this.work.localToWorld(new THREE.Vector3(...mark.at)), away = this.camera.position.clone().sub(this.controls.target).normalize();
    this.controls.target.copy(to);
    this.camera.position.copy(to).addScaledVector(away, AWAY * this.size());
    this.camera.zoom = this.half / (CLOSE * this.size());
    this.controls.update();
    this.dirty = true;
  }

  /** Measure between clicks, or stop. */
  measuring(on: boolean): void {
    this.measure.begin(on);
    this.overlay.message(this.measure.wanted, true);
    this.dirty = true;
  }

  /** The picture as a PNG (a data address). */
  picture(): string {
    this.draw();
    return this.renderer.domElement.toDataURL("image/png");
  }

  save(name: string): void { saved(this.picture(), name); }

  /** Record what is shown as WebM until called again; false where the browser cannot. */
  record(): boolean {
    if (this.recorder) { this.recorder.stop(); this.recorder = null; return false; }
    this.recorder = recorded(this.renderer.domElement, "chipload.webm");
    if (!this.recorder) this.overlay.message("this browser records no video: save pictures");
    return this.recorder !== null;
  }

  /** Lead another view: `here` and `there` are rising lengths of path [mm] that belong together, or times alike. */
  lead(other: View, against: Abscissa, here: number[], there: number[]): void {
    this.alone();
    this.leads++;
    this.pair = { other, against, here, there };
    other.pair = { other: this, against, here: [], there: [] };
    this.follow();
    if (this.path) this.stand(this.place, this.row);
  }

  /** Lead as before: the other view has another path. */
  leadsAgain(): void { const p = this.pair; if (p) this.lead(p.other, p.against, p.here, p.there); }

  get paired(): boolean { return this.pair !== null; }

  /** No longer move with another view. */
  alone(): void {
    if (this.pair) this.pair.other.pair = null;
    this.pair = null;
  }

  /** What is drawn, for tests: triangles of all bodies, volume of the stock, place of the tool. */
  state(): Record<string, unknown> {
    const tip = this.path.tip(this.place, new THREE.Vector3()).toArray();
    return {
      row: this.row, tip, bodies: this.solids.map((s) => [s.body.name, s.body.index.n / 3]), frames: this.frames,
      stock: this.stock ? { frame: this.stock.frame, ...this.stock.measured() } : null, segments: this.path.drawn.length / 3,
      engaged: this.engaged.triangles, map: this.shownMap?.map.name ?? "", factor: this.shownMap?.factor ?? 0,
    };
  }

  // -- parts ---------------------------------------------------------------------------------------------------
  private size(): number {
    const { low, high } = this.header;
    return Math.max(Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]), 1e-3);
  }

  private lookFrom(away: THREE.Vector3): void {
    const box = new THREE.Box3(new THREE.Vector3(...this.header.low), new THREE.Vector3(...this.header.high));
    const found = frame(box, this.work.matrixWorld, away, Math.max(this.aspect(), 0.2)), far = AWAY * this.size();
    this.half = found.half;
    this.camera.zoom = 1;
    this.camera.far = 2 * far;
    this.camera.position.copy(found.middle).addScaledVector(away, far);
    if (Math.abs(away.z) > 0.999) this.camera.position.y -= 1e-3 * far;
    this.controls.target.copy(found.middle);
    this.controls.update();
    this.dirty = true;
  }

  /** Direction of the first picture: from which the place of the first mark is seen, if it can be from the cutter's side. */
  private firstSide(): THREE.Vector3 {
    const usual = new THREE.Vector3(...VIEWS.iso).normalize(), mark = this.header.marks[0];
    if (!mark) return usual;
    const box = new THREE.Box3(new THREE.Vector3(...this.header.low), new THREE.Vector3(...this.header.high));
    const place = this.path.place(mark.row), axis = this.path.axis(place, new THREE.Vector3());
    const sides = sidesOf(cutterSide(box, this.path.tip(place, new THREE.Vector3()), axis, usual));
    this.stock?.at(mark.row);
    const from = new THREE.Vector3(...mark.at).addScaledVector(axis, 0.02 * this.size());
    return sides.find((side) => !this.first(new THREE.Ray(from, side))) ?? sides[0];
  }

  /** Turn the work so that the tool's axis stands upright, as on a machine whose tables carry the work; or leave it. */
  stands(upright: boolean): void {
    this.upright = upright;
    this.stand(this.place, this.row);
    this.section(this.cut.axis, this.cut.share);
  }

  private turn(place: number): void {
    const axis = this.path.axis(place, new THREE.Vector3());
    this.work.quaternion.identity();
    if (this.upright) this.work.quaternion.copy(uprighting(axis));
    this.work.updateMatrixWorld(true);
    if (this.plane && this.uncut) this.plane.copy(this.uncut).applyMatrix4(this.work.matrixWorld);
  }

  private aspect(): number { return this.overlay.stage.clientWidth / Math.max(this.overlay.stage.clientHeight, 1); }

  private layers(): void {
    const seen = (name: Layer) => !this.hidden.has(name);
    if (!this.path) return;
    // a map stands in the place of part and stock
    for (const s of this.solids) s.group.visible = seen(s.body.name) && (!this.shownMap || s.body.kind === "fixture" || (s.body.kind === "body" && !s.body.colours && !s.body.legend));
    if (this.stock) this.stock.group.visible = seen("stock") && !this.shownMap;
    this.path.group.visible = seen("path");
    this.marks.visible = seen("marks");
    this.legend();
    this.stand(this.place, this.row);
    this.dirty = true;
  }

  private stand(place: number, row?: number): void {
    this.place = place;
    const k = Math.floor(place), now = row ?? this.path.rows[k];
    if (now !== this.row) this.touch(null);
    this.row = now;
    const own = this.toolAt(k);
    for (const tool of this.tools.values()) tool.group.visible = tool === own && !this.hidden.has("cutter");
    if (own) {
      this.path.tip(place, own.group.position);
      own.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), this.path.axis(place, new THREE.Vector3()));
    }
    this.turn(place);
    this.stock?.at(now);
    this.engaged.stand(now, this.path.tip(place, new THREE.Vector3()), !this.hidden.has("engagement"));
    this.dirty = true;
    for (const tell of this.stood) tell();
    this.leadOn();
  }

  /** Put the view that this one leads where it belongs. */
  private leadOn(): void {
    const p = this.pair;
    if (!p || !p.here.length || !p.other.path) return;
    const column = p.against === "time" ? this.path.t : this.path.s, k = Math.floor(this.place);
    const next = Math.min(k + 1, column.length - 1), value = column[k] + (this.place - k) * (column[next] - column[k]);
    p.other.abscissa(between(p.here, p.there, value), p.against);
  }

  private touch(mark: Mark | null): void {
    for (const s of this.solids) s.hit(mark !== null && mark.bodies.includes(s.body.name));
    for (const t of this.tools.values()) t.hit(mark && mark.kind === "collision" ? mark.bodies[0] : "");
    this.overlay.message(mark ? mark.text : this.measure.wanted, !mark || mark.kind === "critical");
    this.dirty = true;
  }

  private advance(now: number): void {
    if (this.rate <= 0 || !this.path) return;
    const t = this.path.t, k = Math.floor(this.place), n = Math.min(k + 1, t.length - 1);
    const clock = t[k] + (this.place - k) * (t[n] - t[k]) + this.rate * (now - this.before) / 1000;
    this.before = now;
    const over = clock >= t[t.length - 1];
    this.stand(over ? t.length - 1 : this.path.at(t, clock));
    if (over) this.rate = 0;
    if (over || now - this.told > 100) {
      this.told = now;
      this.tellRow(this.row, over ? "ended" : "playing");
    }
  }

  private tellRow(row: number, why: Why): void { this.host.dispatchEvent(new CustomEvent("viewrow", { detail: { row, why } })); }

  private follow(): void {
    const p = this.pair?.other;
    if (!p) return;
    p.camera.position.copy(this.camera.position);
    p.half = this.half;
    p.camera.zoom = this.camera.zoom;
    p.camera.far = this.camera.far;
    p.controls.target.copy(this.controls.target);
    p.camera.lookAt(p.controls.target);
    p.dirty = true;
  }

  private draw(): void {
    const w = this.overlay.stage.clientWidth, h = this.overlay.stage.clientHeight;
    if (w < 2 || h < 2 || !this.header) return;
    this.dirty = false;
    this.frames++;
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== w || size.y !== h) {
      this.renderer.setSize(w, h, false);
    }
    Object.assign(this.camera, { top: this.half, bottom: -this.half, left: -this.half * w / h, right: this.half * w / h });
    this.camera.updateProjectionMatrix();
    const pixel = this.pixel();
    for (const ring of this.marks.children) ring.scale.setScalar(RING * pixel);
    this.renderer.setViewport(0, 0, w, h);
    this.renderer.render(this.scene, this.camera);
    const away = this.camera.position.clone().sub(this.controls.target);
    this.cube.draw(this.renderer, away, this.camera.up, w, 4);
    this.overlay.ruler(pixel);
  }

  /** Size of a pixel [mm]. */
  private pixel(): number { return 2 * this.half / this.camera.zoom / this.overlay.stage.clientHeight; }

  /** Drawn point of the path within some pixels of the pointer, the nearest to the camera. */
  private near(x: number, y: number, within = NEAR): number {
    const w = this.overlay.stage.clientWidth, h = this.overlay.stage.clientHeight, v = new THREE.Vector3();
    let best = -1, closest = within * within;
    const p = this.path.drawn;
    for (let k = 0; k < p.length / 3; k++) {
      v.set(p[3 * k], p[3 * k + 1], p[3 * k + 2]).applyMatrix4(this.work.matrixWorld).project(this.camera);
      if (v.z > 1) continue;
      const far = ((v.x + 1) * w / 2 - x) ** 2 + ((1 - v.y) * h / 2 - y) ** 2;
      if (far < closest) { closest = far; best = k; }
    }
    return best;
  }

  private hover(e: PointerEvent): void {
    if (e.buttons || !this.header || this.hidden.has("path")) { this.overlay.values(""); return; }
    const box = this.overlay.stage.getBoundingClientRect(), x = e.clientX - box.left, y = e.clientY - box.top;
    const k = this.near(x, y);
    if (k < 0) { this.overlay.values(""); return; }
    const row = this.path.drawnRows[k], d = this.path.place(row), p = this.path.drawn, c = this.colouring, v = this.path.values;
    const lines = [`step ${row + 1}` + (this.path.line ? `, line ${this.path.line[d]}` : "")];
    if (c && v) lines.push(`${c.label} ${c.words.length ? c.words.find((_, i) => i === v[k])?.[0] ?? "" : number(v[k])} ${c.unit}`);
    lines.push(`X ${p[3 * k].toFixed(3)}  Y ${p[3 * k + 1].toFixed(3)}  Z ${p[3 * k + 2].toFixed(3)}`, `${number(this.path.t[d])} s`);
    this.overlay.values(lines.join("\n"), x, y);
  }

  private click(e: MouseEvent): void {
    const box = this.overlay.stage.getBoundingClientRect(), x = e.clientX - box.left, y = e.clientY - box.top;
    const fromRight = box.width - 4 - x, fromBottom = box.height - 4 - y;
    if (fromRight > 0 && fromRight < SIZE && fromBottom > 0 && fromBottom < SIZE) {
      const side = this.cube.side(1 - (2 * fromRight) / SIZE, (2 * fromBottom) / SIZE - 1);
      if (side) { this.lookFrom(side); this.follow(); return; }
    }
    if (this.measure.on) { this.pick(x, y); return; }
    const hit = this.hit(x, y), k = this.hidden.has("path") ? -1 : this.near(x, y, hit ? GRAB : NEAR);
    if (k >= 0 && !(hit && this.behind(k, hit.point))) {
      const row = this.path.drawnRows[k], place = this.path.place(row);
      this.goAndSay(row, `step ${row + 1}`, place, this.path.tip(place, new THREE.Vector3()));
    } else if (hit) this.ask(hit);
  }

  /** Whether a place hides a drawn point of the path. */
  private behind(k: number, place: THREE.Vector3): boolean {
    const point = this.work.localToWorld(new THREE.Vector3().fromArray(this.path.drawn, 3 * k));
    return point.sub(place).dot(this.camera.getWorldDirection(new THREE.Vector3())) > ALONG * this.size();
  }

  /** Say which step cut the face that was hit, and go there. */
  private ask(hit: THREE.Intersection): void {
    const solid = this.solids.find((s) => s.mesh === hit.object);
    if (solid?.body.kind === "fixture") { this.overlay.message(`${solid.body.name}: is not cut`, true); return; }
    const own = hit.object === this.stock?.mesh, rows = own ? this.stock!.cutBy(hit.faceIndex!) : [0, this.path.count - 1] as [number, number];
    if (!rows) { this.overlay.message("this face is not cut: raw stock", true); return; }
    const at = this.work.worldToLocal(hit.object === this.shownMap?.mesh ? this.shownMap.unbent(hit) : hit.point.clone());
    const [place, far] = this.path.nearest(at, ...rows), row = this.path.rows[place], radius = this.toolAt(place)?.radius ?? 0;
    if (own) this.goAndSay(row, `cut in step ${row + 1}`, place, at);
    else if (far <= 1.05 * radius + ALONG * this.size()) this.goAndSay(row, `next to step ${row + 1}`, place, at);
    else this.overlay.message(["no step comes near this face", ...this.valuesAt(at)].join(" \u00b7 "), true);
  }

  /** Go to a row, and say its line, tool, time and load, and the values of the surface maps at a place. */
  private goAndSay(row: number, begin: string, place: number, at: THREE.Vector3): void {
    this.go(row);
    const c = this.colouring, v = this.path.values, said = [begin];
    if (this.path.line) said.push(`line ${this.path.line[place]}`);
    if (this.path.tool[place]) said.push(`T${this.path.tool[place]}`);
    said.push(`${number(this.path.t[place])} s`);
    let d = 0;
    while (d < this.path.drawnRows.length - 1 && this.path.drawnRows[d] < row) d++;
    if (c && v) said.push(c.words.length ? c.words[v[d]]?.[0] ?? "" : `${c.label} ${number(v[d])} ${c.unit}`);
    this.overlay.message([...said, ...this.valuesAt(at)].join(" \u00b7 "), true);
    this.tellRow(row, "clicked");
  }

  /** Values at a place of the map that is shown, else of those of a deviation, as words. */
  private valuesAt(at: THREE.Vector3): string[] {
    const maps = this.shownMap ? [this.shownMap.map] : (this.doc.header.maps ?? []).filter((map) => map.tolerance);
    return maps.flatMap((map) => {
      const value = valueAt(this.doc, map, at, ALONG * this.size());
      return value === null ? [] : [`${map.label} ${number(value)} ${map.unit}`];
    });
  }

  private toolAt(place: number): Tool | undefined { return this.tools.get(this.path.tool[place]) ?? this.tools.get(0); }

  /** What is drawn at a pixel, of bodies, stock and map. */
  private hit(x: number, y: number): THREE.Intersection | undefined {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * x / this.overlay.stage.clientWidth - 1, 1 - 2 * y / this.overlay.stage.clientHeight), this.camera);
    return this.first(ray.ray);
  }

  /** What a ray meets first, of bodies, stock and map as they are shown. */
  private first(along: THREE.Ray): THREE.Intersection | undefined {
    const ray = new THREE.Raycaster(along.origin, along.direction);
    const meshes = this.solids.filter((s) => s.group.visible).map((s) => s.mesh as THREE.Object3D);
    if (this.stock?.group.visible) meshes.push(this.stock.mesh);
    if (this.shownMap) meshes.push(this.shownMap.mesh);
    const hits = ray.intersectObjects(meshes, false).filter((i) => !this.plane || this.plane.distanceToPoint(i.point) >= 0);
    // where a part ends in the plane of the stock the stock is what is seen
    const same = hits.find((i) => i.object === this.stock?.mesh && i.distance - hits[0].distance < 1e-3 * this.size());
    return same ?? hits[0];
  }

  private pick(x: number, y: number): void {
    const hit = this.hit(x, y);
    if (!hit) return;
    const caught = snapped(hit.object as THREE.Mesh, this.work.worldToLocal(hit.point.clone()), this.pixel());
    const said = this.measure.add(caught, this.size() * 0.005);
    if (said) this.overlay.message(said, true);
    this.dirty = true;
  }
}
