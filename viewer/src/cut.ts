/** The cut at the step: the undeformed chip as a body, its thickness, force and torque over a revolution. */

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Header } from "./document";
import { MarginChart, Series, lines, marginChart, polar } from "./draw";
import { Sample, Teeth, chip, profile, sectors, teethOf, thickest, volume } from "./engagement";
import { number } from "./overlay";
import { shade } from "./path";

const COLOURS = ["#3457a6", "#c9821a", "#0b7a75", "#8a4fa3", "#7a8a2e", "#b0567a", "#4d8fb8", "#6b5b4b"];
/** thickness of the drawn chip over the diameter; angles of a profile */
const DRAWN = 0.14, COUNT = 360;

/** What is followed: a view. */
export interface Source {
  header: Header; teeth: Teeth | null; row: number; stood: Set<() => void>;
  operating(): { tool: number; rpm: number; margin: number } | null;
}

/** A chip that is looked at from any side. */
class ChipView {
  private readonly renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(32, 1, 0.01, 1000);
  private readonly controls: OrbitControls;
  private readonly shown = new THREE.Group();
  private size = 0;
  frames = 0;

  constructor(private readonly host: HTMLElement) {
    const canvas = this.renderer.domElement;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "undeformed chip");
    host.append(canvas);
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene.background = new THREE.Color(0xf6f8fa);
    const lamp = new THREE.DirectionalLight(0xffffff, 1.6);
    lamp.position.set(0.4, 0.7, 1);
    this.camera.add(lamp);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d99a8, 1.6), this.camera, this.shown);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(host);
  }

  show(s: Sample, body: THREE.BufferGeometry): void {
    for (const o of this.shown.children as (THREE.Mesh | THREE.Line)[]) { o.geometry.dispose(); (o.material as THREE.Material).dispose(); }
    this.shown.clear();
    const material = new THREE.MeshStandardMaterial({ vertexColors: true, flatShading: true, side: THREE.DoubleSide, roughness: 0.7 });
    this.shown.add(new THREE.Mesh(body, material));
    const rho = Math.max(...s.ranges.map((r) => Math.max(...r.rho))), heights = s.ranges.flatMap((r) => r.z);
    const low = Math.min(...heights), high = Math.max(...heights), line = () => new THREE.LineBasicMaterial({ color: 0x8b97a6 });
    for (const z of [low, high]) {
      const ring = Array.from({ length: 97 }, (_, k) => s.n.clone().multiplyScalar(rho * Math.cos(k * Math.PI / 48))
        .addScaledVector(s.T, rho * Math.sin(k * Math.PI / 48)).addScaledVector(s.A, z));
      this.shown.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(ring), line()));
    }
    const feed = new THREE.ArrowHelper(s.T, s.A.clone().multiplyScalar(high), 1.25 * rho, 0x1b4fd0, 0.18 * rho, 0.1 * rho);
    this.shown.add(feed.line, feed.cone);
    for (const o of [feed.line, feed.cone]) {
      o.position.copy(s.A).multiplyScalar(high).addScaledVector(s.T, o === feed.cone ? 1.25 * rho : 0);
      o.quaternion.copy(feed.quaternion);
    }
    // the same scale while it plays, a new one where the engaged edge has another size
    const size = Math.hypot(2 * rho, high - low);
    if (!(Math.abs(size - this.size) < 0.3 * this.size)) {
      this.size = size;
      const middle = s.A.clone().multiplyScalar(0.5 * (low + high));
      this.controls.target.copy(middle);
      const away = s.T.clone().multiplyScalar(0.85).addScaledVector(s.n, 0.9).addScaledVector(s.A, 1.0).normalize();
      this.camera.position.copy(middle).addScaledVector(away, 2.1 * size);
      this.camera.near = 0.01 * size;
      this.camera.far = 20 * size;
      this.controls.update();
    }
    this.draw();
  }

  draw(): void {
    const w = this.host.clientWidth, h = this.host.clientHeight;
    if (w < 2 || h < 2) return;
    this.frames++;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
  }
}

export class CutPanel {
  private readonly said = document.createElement("div");
  private readonly body = document.createElement("div");
  private readonly chipBox = document.createElement("div");
  private readonly plots = document.createElement("div");
  private readonly chartBox = document.createElement("div");
  private view: ChipView | null = null;
  private sample = -2;
  private teeth: Teeth | null = null;
  private shown: Sample | null = null;
  private charts = new Map<number, MarginChart>();
  private header: Header | null = null;

  constructor(readonly host: HTMLElement, readonly source: Source) {
    host.classList.add("cv-cut");
    this.said.className = "cv-cut-said";
    this.body.className = "cv-cut-body";
    this.chipBox.className = "cv-chip";
    this.plots.className = "cv-cut-plots";
    this.body.append(this.chipBox, this.plots);
    this.chartBox.className = "cv-cut-body";
    host.replaceChildren(this.said, this.body, this.chartBox);
    source.stood.add(() => this.refresh());
    this.refresh(true);
  }

  /** What is shown, for tests. */
  state(): Record<string, unknown> | null {
    const s = this.shown;
    if (!s) return null;
    const teeth = teethOf(s);
    return {
      row: s.row, teeth, thickest: teeth.map((t) => thickest(s, t)), volume: teeth.map((t) => volume(s, t)),
      sectors: sectors(s), force: Math.max(...this.sizes(s)), frames: this.view?.frames ?? 0,
    };
  }

  refresh(always = false): void {
    if (!this.host.isConnected || !this.host.clientWidth || !this.source.header) return;
    this.operate();
    const teeth = this.source.teeth;
    if (!teeth) { this.say("This result keeps no tooth engagement."); return; }
    const k = teeth.at(this.source.row);
    if (!always && k === this.sample && teeth === this.teeth) return;
    this.sample = k;
    this.teeth = teeth;
    if (k < 0) { this.say(`Step ${this.source.row + 1}: the teeth do not cut.`); return; }
    this.body.style.display = "";
    this.show(teeth.sample(k), teeth);
  }

  /** Put the point of the step into the chart of its tool. */
  private operate(): void {
    const now = this.source.operating(), h = this.source.header;
    if (h !== this.header) {
      this.header = h;
      this.charts = new Map(Object.entries(h.stability?.charts ?? {}).map(([tool, c]) => [Number(tool), marginChart(c.rpm, c.margin, h.stability!.wanted)]));
    }
    const own = now ? this.charts.get(now.tool) ?? [...this.charts.values()][0] : undefined;
    if (!own || !now) { this.chartBox.replaceChildren(); return; }
    if (own.picture.parentNode !== this.chartBox) this.chartBox.replaceChildren(own.picture);
    own.stand(now.rpm, now.margin);
  }

  private say(text: string): void {
    this.said.textContent = text;
    this.body.style.display = "none";
    this.shown = null;
  }

  private sizes(s: Sample): number[] {
    return Array.from({ length: s.turn.length / 4 }, (_, k) => Math.hypot(s.turn[4 * k], s.turn[4 * k + 1], s.turn[4 * k + 2]));
  }

  private show(s: Sample, teeth: Teeth): void {
    this.shown = s;
    const own = teethOf(s), tooth = own.reduce((a, b) => (thickest(s, b) > thickest(s, a) ? b : a)), h = thickest(s, tooth);
    const size = this.sizes(s), m = size.length, turn = Array.from({ length: m }, (_, k) => 360 * k / m);
    const rho = Math.max(...s.ranges.map((r) => Math.max(...r.rho))), wide = sectors(s).reduce((a, [p, q]) => a + q - p, 0);
    const times = round(2 * rho * DRAWN / Math.max(h, 1e-9)), scale = this.source.header.scale;
    const colour = (v: number) => {
      const [r, g, b] = shade(scale, h > 0 ? v / h : 0);
      return new THREE.Color().setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace);
    };
    const which = tooth < 0 ? "each tooth" : `tooth ${tooth + 1}`, near = s.row === this.source.row ? "" : ` (for step ${this.source.row + 1})`;
    this.said.textContent = `Step ${s.row + 1}${near}, tool ${s.tool}, ${s.flutes} teeth. Chip of ${which}: thickest ${number(h)} mm, ` +
      `${number(volume(s, tooth))} mm\u00b3; drawn ${number(times)} times as thick. In cut over ${number(wide * 180 / Math.PI)}\u00b0. ` +
      `Greatest force ${number(Math.max(...size))} N.`;
    this.view ??= new ChipView(this.chipBox);
    this.view.show(s, chip(s, tooth, times, colour));
    const angle = Array.from({ length: COUNT + 1 }, (_, k) => 360 * k / COUNT);
    const profiles: Series[] = own.map((t) => {
      const p = profile(s, t, COUNT);
      return { name: t < 0 ? "each tooth" : `tooth ${t + 1}`, colour: COLOURS[Math.max(t, 0) % COLOURS.length], x: angle, y: angle.map((_, k) => 1000 * p[k % COUNT]) };
    });
    const part = (n: number) => Array.from({ length: m }, (_, k) => s.turn[4 * k + n]), bounds = teeth.bounds;
    const limit = (name: string, unit: string): [number, string][] => (name in bounds ? [[bounds[name], `limit ${number(bounds[name], 6)} ${unit}`]] : []);
    const over = "rotation [\u00b0]", along: Series[] = ["Fx", "Fy", "Fz"].map((name, n) => ({ name, colour: COLOURS[n], x: turn, y: part(n) }));
    along.push({ name: "size", colour: "#1f2933", x: turn, y: size });
    this.plots.replaceChildren(
      lines("chip thickness [\u00b5m]", "angle of the tooth [\u00b0], 90: along the feed", profiles, [0, 360],
        "chip_max_mm" in bounds ? [[1000 * bounds.chip_max_mm, `limit ${number(1000 * bounds.chip_max_mm, 6)} \u00b5m`]] : []),
      polar("force over a revolution, X and Y [N]", part(0), part(1), bounds.force_xy_n ?? bounds.force_n ?? null),
      lines("force on the cutter [N]", over, along, [0, 360], limit("force_n", "N")),
      lines("torque [N m]", over, [{ name: "torque", colour: COLOURS[2], x: turn, y: part(3) }], [0, 360], limit("torque_nm", "N m")),
    );
  }
}

function round(x: number): number {
  const power = 10 ** Math.floor(Math.log10(Math.max(x, 1)));
  return power * (x / power >= 5 ? 5 : x / power >= 2 ? 2 : 1);
}
