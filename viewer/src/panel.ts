/** The 3D view with its own controls, as a report holds it: no server moves it. */

import { CutPanel } from "./cut";
import { Colouring, Header, unpacked } from "./document";
import { View, Why } from "./view";

const WHOLE = 30, SIDES = ["iso", "top", "front", "side"];

function made<K extends keyof HTMLElementTagNameMap>(tag: K, text = "", label = ""): HTMLElementTagNameMap[K] {
  const e = document.createElement(tag);
  e.textContent = text;
  if (label) e.setAttribute("aria-label", label);
  return e;
}

/** Fill an element with the view of a document that is held as text, and with its controls. */
export async function panel(host: HTMLElement, text: string): Promise<View> {
  const doc = await unpacked(text), bar = made("div"), box = made("div"), foot = made("div");
  bar.className = "cv-controls";
  foot.className = "cv-controls";
  box.className = "cv-box";
  host.replaceChildren(bar, box, foot);
  const view = new View(box), header: Header = doc.header;
  view.load(doc);
  const columns: Colouring[] = header.columns ?? [];
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
  const names = [...header.bodies.map((b) => b.name), ...(view.stock ? ["stock"] : []), "path", "cutter",
    ...(header.engagement ? ["engagement"] : [])];
  for (const name of names) check(name, true, (on) => view.layer(name, on));
  check("see through", false, (on) => view.glass(on));
  if (view.stock) check("values on stock", false, (on) => view.drape(on));
  if (header.maps?.length) {
    const maps = made("select", "", "surface map"), bent = made("input", "", "how far the map is bent");
    maps.append(new Option("no map", ""), ...header.maps.map((m) => new Option(`map: ${m.name}, ${m.label}`, m.name)));
    Object.assign(bent, { type: "range", min: "0", max: "1", step: "any", value: "0" });
    bent.style.flex = "0 1 120px";
    const show = () => { view.map(maps.value, Number(bent.value)); bent.style.display = header.maps!.find((m) => m.name === maps.value)?.moved ? "" : "none"; };
    maps.onchange = bent.oninput = show;
    bar.append(maps, bent);
    show();
  }
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
  const toggle = () => {
    if (!view.playing && view.row >= view.path.count - 1) view.go(0);
    view.play(view.playing ? 0 : Math.max(last - first, 1e-3) / WHOLE);
    said();
  };
  play.onclick = toggle;
  box.addEventListener("viewrow", (e) => {
    const { row, why } = (e as CustomEvent<{ row: number; why: Why }>).detail;
    if (why === "clicked") { view.play(0); view.go(row); }
    slider.value = String(t[view.path.place(view.row)]);
    said();
  });
  foot.append(play, slider, where);
  if (header.marks.length) view.show(0, false);
  else view.go(view.path.count - 1);
  slider.value = String(t[view.path.place(view.row)]);
  said();
  if (header.engagement) {
    const cut = made("div");
    cut.id = `${host.id}-cut`;
    host.append(cut);
    new CutPanel(cut, view);
  }
  // what a printer gets
  const image = made("img");
  image.alt = "the 3D view";
  image.className = "cv-print";
  const photograph = () => { image.src = view.picture(); };
  host.append(image);
  requestAnimationFrame(photograph);
  addEventListener("beforeprint", photograph);
  return view;
}
