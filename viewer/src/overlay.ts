/** What is laid over the 3D view as HTML: the scale of the colours, a scale bar, values under the pointer, messages. */

import { Colouring, Header, MapLegend } from "./document";
import { AIR, hex } from "./path";

const STYLE = `
.cv { width: 100%; height: 100%; overflow: hidden; display: flex; flex-direction: column;
  font: 12px/1.35 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: var(--ink, #1f2933); }
.cv-stage { position: relative; flex: 1; min-height: 0; touch-action: none; }
.cv-stage canvas { position: absolute; inset: 0; display: block; width: 100%; height: 100%; outline-offset: -2px; }
.cv-scale, .cv-tip, .cv-note { position: absolute; background: var(--veil, rgba(255,255,255,.86)); border-radius: 4px; padding: 4px 8px;
  pointer-events: none; }
.cv-bar { flex: none; display: flex; flex-wrap: wrap; gap: 2px 20px; padding: 3px 8px 4px; max-height: 40%; overflow-y: auto;
  background: var(--paper, #fff); border-top: 1px solid var(--rule, #e3e7ec); font-size: 11.5px; }
.cv-bar > div { flex: 1 1 190px; max-width: 380px; min-width: 0; }
.cv-head, .cv-ends, .cv-map-ends { display: flex; flex-wrap: wrap; gap: 0 10px; align-items: center; }
.cv-ends, .cv-map-ends { flex-wrap: nowrap; gap: 6px; font-variant-numeric: tabular-nums; }
.cv-title { font-weight: 600; }
.cv-ramp { flex: 1; height: 12px; border-radius: 2px; position: relative; text-align: center; font-size: 10px; line-height: 12px; }
.cv-ramp i { position: absolute; top: -2px; bottom: -2px; width: 0; border-left: 2.5px solid #c81e1e; }
.cv-red { color: var(--bad, #b01818); font-weight: 600; }
.cv-dot { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin-right: 6px; }
.cv-scale { right: 100px; bottom: 6px; padding: 2px 6px; text-align: center; font-size: 11px; }
.cv-scale div { border: 1.5px solid var(--ink, #1f2933); border-top: 0; height: 5px; }
.cv-tip { display: none; white-space: pre; font-size: 11.5px; font-variant-numeric: tabular-nums; z-index: 3; }
.cv-note { left: 6px; top: 6px; color: var(--bad, #b01818); font-weight: 600; max-width: 70%; }
.cv-note:empty { display: none; }
.cv-plain { color: var(--ink, #1f2933); }
.cv-box { height: 520px; border: 1px solid #d9dde2; }
.cv-controls { display: flex; flex-wrap: wrap; gap: 4px 12px; align-items: center; padding: 4px 0; font-size: 13px; }
.cv-controls button, .cv-controls select { font: inherit; padding: 3px 10px; }
.cv-controls input[type=range] { flex: 1; min-width: 160px; }
.cv-cut { font: 12px/1.35 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: var(--ink, #1f2933); }
.cv-cut-said { padding: 4px 2px; font-variant-numeric: tabular-nums; }
.cv-cut-body { display: grid; grid-template-columns: repeat(auto-fit, minmax(210px, 1fr)); gap: 6px; }
.cv-chip { min-height: 200px; border: 1px solid #d9dde2; position: relative; touch-action: none; }
.cv-chip canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block; }
.cv-cut-plots { display: contents; }
.cv-plot { width: 100%; max-height: 240px; background: #fff; border: 1px solid #edf0f3; }
.cv-print { display: none; position: relative; }
.cv-print * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.cv-print img { width: 100%; } .cv-print .cv-bar, .cv-print .cv-note { position: static; max-width: none; }
.cv-print .cv-scale { position: static; display: block; padding: 2px 0; text-align: left; }
@media print { .cv-box, .cv-controls { display: none; } .cv-print { display: block; } }
@media (max-width: 600px) { .cv-scale { display: none; } .cv-note { max-width: calc(100% - 110px); } }
`;

export function number(x: number, digits = 3): string {
  if (!Number.isFinite(x)) return "not known";
  return String(Number(Math.abs(x) >= 10 ** digits ? x.toFixed(0) : x.toPrecision(digits)));
}

/** Legends that mean the same as one, with the words of all of them. */
export function joined(legends: MapLegend[]): MapLegend[] {
  const out: MapLegend[] = [];
  for (const one of legends) {
    const same = out.find((m) => m.title === one.title && JSON.stringify(m.stops) === JSON.stringify(one.stops));
    if (!same) { out.push({ ...one, words: [...one.words] }); continue; }
    same.words.push(...one.words.filter(([word]) => !same.words.some(([w]) => w === word)));
  }
  return out;
}

export class Overlay {
  readonly root: HTMLElement;
  /** where the scene is drawn; the scales stand below it and cover nothing */
  readonly stage: HTMLElement;
  private readonly bar = this.part("cv-bar");
  /** of the bar, what belongs to one scale */
  private group = this.bar;
  private readonly scale = this.part("cv-scale");
  private readonly tip = this.part("cv-tip");
  private readonly note = this.part("cv-note");

  constructor(host: HTMLElement) {
    if (!document.getElementById("cv-style")) {
      const style = document.createElement("style");
      style.id = "cv-style";
      style.textContent = STYLE;
      document.head.append(style);
    }
    this.root = document.createElement("div");
    this.root.className = "cv";
    this.stage = this.part("cv-stage");
    this.stage.append(this.scale, this.tip, this.note);
    this.root.append(this.stage, this.bar);
    this.note.setAttribute("role", "status");
    host.append(this.root);
  }

  /** The scale of the path with the limit marked on it, and those of painted bodies. */
  legend(header: Header, c: Colouring | null, maps: MapLegend[]): void {
    this.bar.replaceChildren();
    this.bar.style.display = c || maps.length ? "" : "none";
    const group = () => { this.group = document.createElement("div"); this.bar.append(this.group); };
    if (c) { group(); this.column(header, c); }
    for (const m of joined(maps)) { group(); this.map(m); }
  }

  private add(cls: string, text = "", to = this.group): HTMLElement {
    const e = document.createElement("div");
    e.className = cls;
    e.textContent = text;
    to.append(e);
    return e;
  }

  /** A title, beside it words with their colours. */
  private head(title: string, words: [string, string][] = []): HTMLElement {
    const head = this.add("cv-head");
    this.add("cv-title", title, head);
    for (const [word, colour] of words) {
      const row = this.add("", "", head), dot = document.createElement("span");
      dot.className = "cv-dot";
      dot.style.background = colour;
      row.append(dot, word);
    }
    return head;
  }

  /** Colours [share, colour] between the values at their ends, of the path or `-map`. */
  private ramp(low: number, high: number, stops: [number, string][], of = "", middle = ""): HTMLElement {
    const ends = this.add(`cv${of}-ends`);
    this.add("", number(low), ends);
    const ramp = this.add(`cv-ramp cv${of}`, middle, ends);
    ramp.style.background = `linear-gradient(to right, ${stops.map(([s, x]) => `${x} ${100 * s}%`).join(", ")})`;
    this.add("", number(high), ends);
    return ramp;
  }

  /** What the colours of a body mean. */
  private map(m: MapLegend): void {
    this.head(m.title, m.words);
    const n = m.stops.length;
    if (n < 2) return;
    const low = m.stops[0][0], high = m.stops[n - 1][0], span = high - low || 1;
    this.ramp(low, high, m.stops.map(([v, x]) => [(v - low) / span, x]), "-map", n === 3 ? number(m.stops[1][0]) : "");
  }

  private column(header: Header, c: Colouring): void {
    const air: [string, string][] = c.air ? [["in air", hex(AIR)]] : [];
    const head = this.head(c.unit ? `${c.label} [${c.unit}]` : c.label, [...c.words.slice(0, 12), ...air]);
    if (c.words.length) return;
    const ramp = this.ramp(c.low, c.high, header.scale);
    if (c.limit === null) return;
    const share = c.high > c.low ? (c.limit - c.low) / (c.high - c.low) : 2;
    if (share >= 0 && share <= 1) {
      const mark = document.createElement("i");
      mark.style.left = `calc(${100 * share}% - 1px)`;
      ramp.append(mark);
    }
    const worse = c.least ? c.low < c.limit : c.high > c.limit;
    const text = worse ? `red and thick: ${c.least ? "below" : "above"} ${number(c.limit, 6)}` : `limit ${number(c.limit, 6)}`;
    this.add(worse ? "cv-red" : "", text, head);
  }

  /** Message, length and scales as a print shows them below the picture, which is as wide as the page. */
  printed(): HTMLElement[] {
    const [note, scale, bar] = [this.note, this.scale, this.bar].map((e) => e.cloneNode(true) as HTMLElement);
    const line = scale.querySelector("div");
    if (line) line.style.width = `${100 * Number(line.dataset.share ?? 0)}%`;
    note.removeAttribute("role");
    return [note, scale, bar];
  }

  /** A bar of a round length: mm per pixel is that at the middle of what is looked at. */
  ruler(perPixel: number): void {
    const most = 110 * perPixel, power = 10 ** Math.floor(Math.log10(most));
    const length = power * (most / power >= 5 ? 5 : most / power >= 2 ? 2 : 1);
    this.scale.textContent = `${number(length)} mm`;
    const line = document.createElement("div");
    line.style.width = `${length / perPixel}px`;
    // a print has the picture in another width
    if (this.stage.clientWidth) line.dataset.share = String(length / perPixel / this.stage.clientWidth);
    this.scale.append(line);
  }

  values(text: string, x = 0, y = 0): void {
    this.tip.style.display = text ? "block" : "none";
    this.tip.textContent = text;
    const left = x + 14 + 220 > this.stage.clientWidth ? Math.max(0, x - 200) : x + 14;
    this.tip.style.left = `${left}px`;
    this.tip.style.top = `${Math.max(0, Math.min(y + 12, this.stage.clientHeight - 90))}px`;
  }

  /** A message at the edge; `plain`: it tells of nothing that is wrong. */
  message(text: string, plain = false): void {
    this.note.textContent = text;
    this.note.classList.toggle("cv-plain", plain);
  }

  private part(cls: string): HTMLElement {
    const e = document.createElement("div");
    e.className = cls;
    return e;
  }
}
