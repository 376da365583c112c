/** What the page and the report call: views and panels by the elements that they fill. */

import { CutPanel } from "./cut";
import { fetched } from "./document";
import { Abscissa } from "./pair";
import { View } from "./view";

export { ownKeys } from "./keys";
export { printsPlots } from "./print";
export { send } from "./send";

const views = new Map<string, View>(), cuts = new Map<string, CutPanel>();

/** The view in an element, made where it is not there yet. */
export function of(id: string): View {
  const host = document.getElementById(id)!;
  let view = views.get(id);
  if (!view || !host.contains(view.host)) views.set(id, (view = new View(host)));
  return view;
}

/** Show in an element what the teeth cut where a view stands. */
export function cut(id: string, leader: string): CutPanel {
  const host = document.getElementById(id)!;
  let own = cuts.get(id);
  if (!own || own.host !== host) cuts.set(id, (own = new CutPanel(host, of(leader))));
  own.refresh(true);
  return own;
}

/** Show the document of an address in an element. */
export async function open(id: string, url: string, keep = false): Promise<void> {
  const view = of(id);
  view.overlay.message("loading the picture \u2026", true);
  try {
    view.load(await fetched(url), keep);
  } catch (e) {
    view.overlay.message(`The picture cannot be shown: ${e instanceof Error ? e.message : e}`);
    throw e;
  }
}

/** Show the document of an address beside a view that leads it. */
export async function beside(id: string, url: string, leader: string, against: Abscissa, here: number[], there: number[]): Promise<void> {
  const view = of(id), first = of(leader), leads = first.leads;
  view.load(await fetched(url), view.paired);
  // what was asked for while the document came counts
  if (first.leads === leads) first.lead(view, against, here, there);
  else first.leadsAgain();
}

/** Colour the path of a view by the document of an address. */
export async function paint(id: string, url: string): Promise<void> {
  const doc = await fetched(url), view = of(id);
  view.colour(doc, doc.header.colouring);
}

/** Fill an element with the view of documents that are held as text, by the names of their tracks, and its controls. */
export async function report(id: string, texts: [string, string][]): Promise<void> {
  const host = document.getElementById(id)!;
  try {
    const { panel } = await import("./panel");
    const view = await panel(host, texts);
    views.set(id, view);
  } catch (e) {
    host.textContent = `The 3D view cannot be shown: ${e instanceof Error ? e.message : e}`;
  }
}
