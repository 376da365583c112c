/** The 3D view with its own controls, as a report holds it: no server moves it. */

import { CutPanel } from "./cut";
import { Document, unpacked } from "./document";
import { BANDED, View, Why } from "./view";

type Told = { row: number; why: Why };
const WHOLE = 30, SIDES = ["iso", "top", "front", "side"];

function made<K extends keyof HTMLElementTagNameMap>(tag: K, text = "", label = ""): HTMLElementTagNameMap[K] {
  const e = document.createElement(tag);
  e.textContent = text;
  if (label) e.setAttribute("aria-label", label);
  return e;
}

function row(): HTMLDivElement {
  const e = made("div");
  e.className = "cv-controls";
  return e;
}

/** Fill an element with the view of documents that are held as text, by the names of their tracks, and with controls. */
export async function panel(host: HTMLElement, texts: [string, string][]): Promise<View> {
  const first = await unpacked(texts[0][1]), bar = row(), box = made("div"), foot = row(), cut = made("div");
  box.className = "cv-box";
  cut.id = `${host.id}-cut`;
  host.replaceChildren(bar, box, foot, cut);
  const view = new View(box);
  view.load(first);
  for (const name of covered(view)) view.layer(name, false);
  let panelled = false, told = (_: Told) => {};
  box.addEventListener("viewrow", (e) => told((e as CustomEvent<Told>).detail));
  const show = (doc: Document) => {
    choices(view, doc, first, bar, tracks);
    const { marks, engagement } = doc.header;
    if (marks.length) view.show(0, false);
    else view.go(view.path.count - 1);
    told = player(view, foot);
    cut.style.display = engagement ? "" : "none";
    if (engagement && !panelled) { panelled = true; new CutPanel(cut, view); }
  };
  const tracks = made("select", "", "program");
  texts.forEach(([name], k) => tracks.append(new Option(name, String(k))));
  tracks.style.display = texts.length > 1 ? "" : "none";
  tracks.onchange = async () => {
    view.play(0);
    const doc = tracks.value === "0" ? first : await unpacked(texts[Number(tracks.value)][1]);
    view.load(doc, true, first);
    show(doc);
  };
  show(first);
  // what a printer gets: the picture with its message, length and scales of colours
  const print = made("div"), image = made("img");
  print.className = "cv-print";
  image.alt = "the 3D view";
  const photograph = () => {
    image.src = view.picture();
    print.replaceChildren(image, ...view.overlay.printed());
  };
  host.append(print);
  requestAnimationFrame(photograph);
  addEventListener("beforeprint", photograph);
  return view;
}

/** Painted surfaces behind others of the same surface, by the number that their names begin with. */
function covered(view: View): string[] {
  const numbers = new Set<string>();
  return view.solids.map((s) => s.body).filter((b) => {
    const number = /^(\d+)-/.exec(b.name)?.[1];
    if (b.kind !== "body" || !b.legend || !number) return false;
    const behind = numbers.has(number);
    numbers.add(number);
    return behind;
  }).map((b) => b.name);
}

/** What is shown, from where, in which colours. */
function choices(view: View, doc: Document, shared: Document, bar: HTMLElement, tracks: HTMLElement): void {
  const { header } = doc, columns = header.columns ?? [], maps = shared.header.maps ?? [];
  bar.replaceChildren(tracks);
  const choose = made("select", "", "column that colours the path");
  columns.forEach((c, k) => choose.append(new Option(c.unit ? `${c.label} [${c.unit}]` : c.label, String(k))));
  choose.onchange = () => view.colour(doc, columns[Number(choose.value)]);
  if (columns.length > 1) bar.append(choose);
  for (const name of SIDES) {
    const b = made("button", name, `look from ${name}`);
    b.onclick = () => view.look(name);
    bar.append(b);
  }
  const check = (name: string, on: boolean, act: (on: boolean) => void) => {
    const label = made("label"), c = made("input");
    c.type = "checkbox";
    c.checked = on;
    c.onchange = () => act(c.checked);
    label.append(c, " ", name);
    bar.append(label);
  };
  const names = [...view.solids.map((s) => s.body.name), ...(view.stock ? ["stock"] : []), "path", "cutter",
    ...(header.engagement ? ["engagement"] : [])];
  for (const name of names) check(name, view.shows(name), (on) => view.layer(name, on));
  check("see through", false, (on) => view.glass(on));
  if (header.path.axes) check("tool upright", false, (on) => view.stands(on));
  if (view.stock) check("values on stock", false, (on) => view.drape(on));
  if (!maps.length) return;
  const chosen = made("select", "", "surface map"), bent = made("input", "", "scale of the deflection");
  chosen.append(new Option("no map", ""), ...maps.flatMap((m) => [
    new Option(`map: ${m.name}, ${m.label}`, m.name),
    ...(m.tolerance ? [new Option(`tolerance: ${m.name}, ${m.label}`, m.name + BANDED)] : []),
  ]));
  Object.assign(bent, { type: "range", min: "0", max: "1", step: "any", value: "0" });
  bent.style.flex = "0 1 120px";
  const show = () => { view.map(chosen.value, Number(bent.value)); bent.style.display = maps.find((m) => m.name === chosen.value.replace(BANDED, ""))?.moved ? "" : "none"; };
  chosen.onchange = bent.oninput = show;
  bar.append(chosen, bent);
  show();
}

/** Play, and the slider of time; what follows the row of the view. */
function player(view: View, foot: HTMLElement): (told: Told) => void {
  const play = made("button", "play"), slider = made("input", "", "time"), where = made("span");
  slider.type = "range";
  const t = view.path.t, first = t[0] ?? 0, last = t[t.length - 1] ?? 1;
  slider.min = String(first);
  slider.max = String(last);
  slider.step = "any";
  const said = () => {
    const k = view.path.place(view.row);
    where.textContent = `${t[k].toFixed(2)} of ${last.toFixed(2)} s, step ${view.row + 1}` +
      (view.path.line ? `, line ${view.path.line[k]}` : "");
    play.textContent = view.playing ? "pause" : "play";
  };
  slider.oninput = () => { view.play(0); view.abscissa(Number(slider.value)); said(); };
  play.onclick = () => {
    if (!view.playing && view.row >= view.path.count - 1) view.go(0);
    view.play(view.playing ? 0 : Math.max(last - first, 1e-3) / WHOLE);
    said();
  };
  const stand = () => { slider.value = String(t[view.path.place(view.row)]); said(); };
  foot.replaceChildren(play, slider, where);
  stand();
  return ({ row, why }) => {
    if (why === "clicked") { view.play(0); view.go(row); }
    stand();
  };
}
