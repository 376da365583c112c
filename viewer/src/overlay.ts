/** What is laid over the 3D view as HTML: the scale of the colours, a scale bar, values under the pointer, messages. */

import { Colouring, Header, MapLegend } from "./document";

const STYLE = `
.cv { position: relative; width: 100%; height: 100%; overflow: hidden; touch-action: none;
  font: 12px/1.35 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #1f2933; }
.cv canvas { display: block; width: 100%; height: 100%; outline-offset: -2px; }
.cv-bar, .cv-scale, .cv-tip, .cv-note { position: absolute; background: rgba(255,255,255,.86); border-radius: 4px;
  padding: 4px 8px; pointer-events: none; }
.cv-bar { left: 6px; bottom: 6px; max-width: calc(100% - 210px); font-size: 11.5px; display: flex; flex-wrap: wrap; gap: 2px 16px; }
.cv-bar > div { min-width: 150px; }
.cv-title { font-weight: 600; }
.cv-ramp { height: 10px; border-radius: 2px; margin: 4px 0 1px; position: relative; }
.cv-ramp i { position: absolute; top: -3px; bottom: -3px; width: 0; border-left: 2.5px solid #c81e1e; }
.cv-ends, .cv-map-ends { display: flex; justify-content: space-between; font-variant-numeric: tabular-nums; }
.cv-red { color: #b01818; font-weight: 600; }
.cv-dot { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin-right: 6px; }
.cv-scale { right: 104px; bottom: 8px; padding: 2px 6px; text-align: center; font-size: 11px; }
.cv-scale div { border: 1.5px solid #1f2933; border-top: 0; height: 5px; }
.cv-tip { display: none; white-space: pre; font-size: 11.5px; font-variant-numeric: tabular-nums; z-index: 3; }
.cv-note { left: 50%; top: 46px; transform: translateX(-50%); color: #b01818; font-weight: 600; max-width: 70%; }
.cv-note:empty { display: none; }
.cv-box { height: 520px; border: 1px solid #d9dde2; }
.cv-controls { display: flex; flex-wrap: wrap; gap: 4px 12px; align-items: center; padding: 4px 0; font-size: 13px; }
.cv-controls button, .cv-controls select { font: inherit; padding: 3px 10px; }
.cv-controls input[type=range] { flex: 1; min-width: 160px; }
.cv-cut { font: 12px/1.35 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #1f2933; }
.cv-cut-said { padding: 4px 2px; font-variant-numeric: tabular-nums; }
.cv-cut-body { display: grid; grid-template-columns: repeat(auto-fit, minmax(210px, 1fr)); gap: 6px; }
.cv-chip { min-height: 200px; border: 1px solid #d9dde2; position: relative; touch-action: none; }
.cv-chip canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block; }
.cv-cut-plots { display: contents; }
.cv-plot { width: 100%; max-height: 240px; background: #fff; border: 1px solid #edf0f3; }
.cv-print { display: none; width: 100%; }
@media print { .cv-box, .cv-controls { display: none; } .cv-cut { font: 12px/1.35 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #1f2933; }
.cv-cut-said { padding: 4px 2px; font-variant-numeric: tabular-nums; }
.cv-cut-body { display: grid; grid-template-columns: repeat(auto-fit, minmax(210px, 1fr)); gap: 6px; }
.cv-chip { min-height: 200px; border: 1px solid #d9dde2; position: relative; touch-action: none; }
.cv-chip canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block; }
.cv-cut-plots { display: contents; }
.cv-plot { width: 100%; max-height: 240px; background: #fff; border: 1px solid #edf0f3; }
.cv-print { display: block; } }
@media (max-width: 600px) { .cv-bar { max-width: 46%; } .cv-bar > div { min-width: 120px; } .cv-scale { display: none; }
  .cv-note { top: auto; bottom: 84px; left: 4px; transform: none; max-width: 68%; } }
`;

export function number(x: number): string {
  return Number.isFinite(x) ? String(Number(x.toPrecision(4))) : "not known";
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
    this.root.append(this.bar, this.scale, this.tip, this.note);
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

  private add(cls: string, text = ""): HTMLElement {
    const e = document.createElement("div");
    e.className = cls;
    e.textContent = text;
    this.group.append(e);
    return e;
  }

  private word(word: string, colour: string): void {
    const row = this.add(""), dot = document.createElement("span");
    dot.className = "cv-dot";
    dot.style.background = colour;
    row.append(dot, word);
  }

  /** What the colours of a body mean. */
  private map(m: MapLegend): void {
    this.add("cv-title", m.title);
    const n = m.stops.length, low = m.stops[0]?.[0] ?? 0, span = (m.stops[n - 1]?.[0] ?? 1) - low || 1;
    if (n > 1) {
      const ramp = this.add("cv-ramp cv-map");
      ramp.style.background = `linear-gradient(to right, ${m.stops.map(([v, x]) => `${x} ${100 * (v - low) / span}%`).join(", ")})`;
      const ends = this.add("cv-map-ends");
      for (const [v] of n === 3 ? m.stops : [m.stops[0], m.stops[n - 1]]) {
        const e = document.createElement("span");
        e.textContent = number(v);
        ends.append(e);
      }
    }
    for (const [word, colour] of m.words) this.word(word, colour);
  }

  private column(header: Header, c: Colouring): void {
    const add = (cls: string, text = "") => this.add(cls, text);
    add("cv-title", c.unit ? `${c.label} [${c.unit}]` : c.label);
    if (c.words.length) {
      for (const [word, colour] of c.words.slice(0, 12)) this.word(word, colour);
      return;
    }
    const ramp = add("cv-ramp");
    ramp.style.background = `linear-gradient(to right, ${header.scale.map(([s, x]) => `${x} ${100 * s}%`).join(", ")})`;
    const ends = add("cv-ends");
    for (const x of [c.low, c.high]) {
      const e = document.createElement("span");
      e.textContent = number(x);
      ends.append(e);
    }
    if (c.limit === null) return;
    const share = c.high > c.low ? (c.limit - c.low) / (c.high - c.low) : 2;
    if (share >= 0 && share <= 1) {
      const mark = document.createElement("i");
      mark.style.left = `calc(${100 * share}% - 1px)`;
      ramp.append(mark);
    }
    const worse = c.least ? c.low < c.limit : c.high > c.limit;
    const text = worse ? `red and thick: ${c.least ? "below" : "above"} ${number(c.limit)}` : `limit ${number(c.limit)}`;
    add(worse ? "cv-red" : "", text);
  }

  /** A bar of a round length: mm per pixel is that at the middle of what is looked at. */
  ruler(perPixel: number): void {
    const most = 110 * perPixel, power = 10 ** Math.floor(Math.log10(most));
    const length = power * (most / power >= 5 ? 5 : most / power >= 2 ? 2 : 1);
    this.scale.textContent = `${number(length)} mm`;
    const line = document.createElement("div");
    line.style.width = `${length / perPixel}px`;
    this.scale.append(line);
  }

  values(text: string, x = 0, y = 0): void {
    this.tip.style.display = text ? "block" : "none";
    this.tip.textContent = text;
    const left = x + 14 + 220 > this.root.clientWidth ? Math.max(0, x - 200) : x + 14;
    this.tip.style.left = `${left}px`;
    this.tip.style.top = `${Math.max(0, Math.min(y + 12, this.root.clientHeight - 90))}px`;
  }

  message(text: string): void {
    this.note.textContent = text;
  }

  private part(cls: string): HTMLElement {
    const e = document.createElement("div");
    e.className = cls;
    return e;
  }
}
