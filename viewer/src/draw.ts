/** Small plots as SVG. */

const NS = "http://www.w3.org/2000/svg";
const INK = "#1f2933", GREY = "#5f6b7a", GRID = "#e3e7ec";

export function svg<K extends keyof SVGElementTagNameMap>(tag: K, set: Record<string, string | number>, text = ""): SVGElementTagNameMap[K] {
  const e = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(set)) e.setAttribute(name, String(value));
  if (text) e.textContent = text;
  return e;
}

/** A few round values from low to high. */
export function ticks(low: number, high: number, most = 5): number[] {
  const span = high - low || 1, raw = span / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5, 10].find((f) => f * power >= raw * 0.999) ?? 10), out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; k++) out.push(Number((k * step).toPrecision(12)));
  return out;
}

export interface Series { name: string; colour: string; x: number[]; y: number[]; dash?: string }

const W = 320, H = 200, LEFT = 46, RIGHT = 8, TOP = 18, FOOT = 34;

/** Lines over one axis; `marks` are values drawn across as limits. */
export function lines(title: string, across: string, series: Series[], xs: [number, number], limits: [number, string][] = []): SVGSVGElement {
  const all = series.flatMap((s) => s.y), high = Math.max(0, ...all), low = Math.min(0, ...all);
  const near = limits.filter(([v]) => v <= 1.8 * high), top = Math.max(high, ...near.map(([v]) => v)) * 1.05 || 1;
  const x = (v: number) => LEFT + (W - LEFT - RIGHT) * (v - xs[0]) / (xs[1] - xs[0]);
  const y = (v: number) => H - FOOT - (H - FOOT - TOP) * (v - low) / (top - low);
  const out = svg("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": title, class: "cv-plot" });
  for (const v of ticks(low, top, 4)) {
    out.append(svg("line", { x1: LEFT, x2: W - RIGHT, y1: y(v), y2: y(v), stroke: GRID }));
    out.append(svg("text", { x: LEFT - 4, y: y(v) + 3.5, "text-anchor": "end", fill: GREY, "font-size": 10 }, String(v)));
  }
  for (const v of [0, 90, 180, 270, 360].filter((d) => d >= xs[0] && d <= xs[1])) {
    out.append(svg("line", { x1: x(v), x2: x(v), y1: TOP, y2: H - FOOT, stroke: GRID }));
    out.append(svg("text", { x: x(v), y: H - FOOT + 13, "text-anchor": "middle", fill: GREY, "font-size": 10 }, String(v)));
  }
  out.append(svg("text", { x: LEFT, y: 11, fill: INK, "font-size": 11, "font-weight": 600 }, title));
  out.append(svg("text", { x: (LEFT + W) / 2, y: H - 6, "text-anchor": "middle", fill: GREY, "font-size": 10 }, across));
  for (const [v, name] of near) {
    out.append(svg("line", { x1: LEFT, x2: W - RIGHT, y1: y(v), y2: y(v), stroke: "#c81e1e", "stroke-dasharray": "5 3" }));
    out.append(svg("text", { x: W - RIGHT, y: y(v) - 3, "text-anchor": "end", fill: "#b01818", "font-size": 10 }, name));
  }
  series.forEach((s, k) => {
    const points = s.x.map((v, n) => `${x(v).toFixed(1)},${y(s.y[n]).toFixed(1)}`).join(" ");
    out.append(svg("polyline", { points, fill: "none", stroke: s.colour, "stroke-width": 1.6, "stroke-dasharray": s.dash ?? "none" }));
    if (series.length > 1) {
      out.append(svg("text", { x: LEFT + 6 + 62 * (k % 4), y: TOP + 10 + 12 * Math.floor(k / 4), fill: s.colour, "font-size": 10 }, s.name));
    }
  });
  return out;
}

/** The end of a vector over a revolution, from its root; `limit` is a circle. */
export function polar(title: string, x: number[], y: number[], limit: number | null): SVGSVGElement {
  const size = H, reach = Math.max(...x.map((v, k) => Math.hypot(v, y[k])), 1e-9);
  const circle = limit !== null && limit <= 1.8 * reach ? limit : null, most = Math.max(reach, circle ?? 0) * 1.1;
  const middle = size / 2 + 4, across = W / 2, scale = (size / 2 - 22) / most;
  const out = svg("svg", { viewBox: `0 0 ${W} ${size}`, role: "img", "aria-label": title, class: "cv-plot" });
  out.append(svg("text", { x: LEFT, y: 11, fill: INK, "font-size": 11, "font-weight": 600 }, title));
  for (const v of ticks(0, most, 3).slice(1)) {
    out.append(svg("circle", { cx: across, cy: middle, r: v * scale, fill: "none", stroke: GRID }));
    out.append(svg("text", { x: across + 2, y: middle - v * scale - 1, fill: GREY, "font-size": 10 }, String(v)));
  }
  for (const [a, b, name] of [[1, 0, "X"], [0, 1, "Y"]] as [number, number, string][]) {
    const far = size / 2 - 16;
    out.append(svg("line", { x1: across - a * far, x2: across + a * far, y1: middle + b * far, y2: middle - b * far, stroke: "#c4ccd6" }));
    out.append(svg("text", { x: across + a * (far + 4), y: middle - b * (far - 8) + (b ? 0 : 4), fill: GREY, "font-size": 10 }, name));
  }
  if (circle !== null) {
    out.append(svg("circle", { cx: across, cy: middle, r: circle * scale, fill: "none", stroke: "#c81e1e", "stroke-dasharray": "5 3" }));
  }
  const points = [...x.keys(), 0].map((k) => `${(across + x[k] * scale).toFixed(1)},${(middle - y[k] * scale).toFixed(1)}`).join(" ");
  out.append(svg("polyline", { points, fill: "rgba(52,87,166,.12)", stroke: "#3457a6", "stroke-width": 1.6, class: "cv-locus" }));
  return out;
}

export interface MarginChart { picture: SVGSVGElement; stand(rpm: number, margin: number): void }

/** Least margin over spindle speed, what is wanted, and the point of a step. */
export function marginChart(rpm: number[], margin: number[], wanted: number): MarginChart {
  const most = Math.max(1.2 * wanted, ...margin) * 1.08, low = Math.log(rpm[0]), span = Math.log(rpm[rpm.length - 1]) - low || 1;
  const x = (v: number) => LEFT + (W - LEFT - RIGHT) * Math.min(Math.max((Math.log(Math.max(v, 1e-9)) - low) / span, 0), 1);
  const y = (v: number) => H - FOOT - (H - FOOT - TOP) * Math.min(v, most) / most;
  const title = "stability margin over spindle speed";
  const out = svg("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": title, class: "cv-plot cv-margin" });
  for (const v of ticks(0, most, 4)) {
    out.append(svg("line", { x1: LEFT, x2: W - RIGHT, y1: y(v), y2: y(v), stroke: GRID }));
    out.append(svg("text", { x: LEFT - 4, y: y(v) + 3.5, "text-anchor": "end", fill: GREY, "font-size": 10 }, String(v)));
  }
  for (let k = 0; k <= 4; k++) {
    const v = Math.exp(low + span * k / 4);
    out.append(svg("text", { x: x(v), y: H - FOOT + 13, "text-anchor": k === 4 ? "end" : k ? "middle" : "start", fill: GREY, "font-size": 10 },
      String(Number(v.toPrecision(3)))));
  }
  out.append(svg("text", { x: LEFT, y: 11, fill: INK, "font-size": 11, "font-weight": 600 }, title));
  out.append(svg("text", { x: (LEFT + W) / 2, y: H - 6, "text-anchor": "middle", fill: GREY, "font-size": 10 }, "spindle speed [1/min]; below the line a cut of the tool chatters"));
  const points = rpm.map((v, k) => `${x(v).toFixed(1)},${y(margin[k]).toFixed(1)}`).join(" ");
  out.append(svg("polyline", { points, fill: "none", stroke: "#0b7a75", "stroke-width": 1.6 }));
  out.append(svg("line", { x1: LEFT, x2: W - RIGHT, y1: y(wanted), y2: y(wanted), stroke: "#c81e1e", "stroke-dasharray": "5 3" }));
  out.append(svg("text", { x: W - RIGHT, y: y(wanted) - 3, "text-anchor": "end", fill: "#b01818", "font-size": 10 }, `wanted ${wanted}`));
  const dot = svg("circle", { r: 5, stroke: "#fff", class: "cv-operating" }), said = svg("text", { "font-size": 11, "font-weight": 600, fill: INK });
  out.append(dot, said);
  const stand = (at: number, value: number) => {
    const seen = at > 0 && value > 0 ? "" : "none", bad = value < wanted, right = x(at) > W / 2;
    for (const e of [dot, said]) e.style.display = seen;
    dot.setAttribute("cx", x(at).toFixed(1));
    dot.setAttribute("cy", y(value).toFixed(1));
    dot.setAttribute("fill", bad ? "#c81e1e" : "#3457a6");
    said.setAttribute("x", (x(at) + (right ? -8 : 8)).toFixed(1));
    said.setAttribute("y", (y(value) - 7).toFixed(1));
    said.setAttribute("text-anchor", right ? "end" : "start");
    said.textContent = `${Math.round(at)} 1/min, margin ${Number(value.toPrecision(3))}`;
  };
  return { picture: out, stand };
}
