/** Send a dropped or chosen file to the page in parts that its websocket takes; nothing else is accepted there. */

const PART = 300_000;

/** `most`: largest program, `mostModel`: largest file whose name ends as one of `models`, in bytes. */
export async function send(
  file: File | undefined, most: number, mostModel: number, models: string[], emit: (part: object) => void,
): Promise<void> {
  if (!file) return;
  const { name, size } = file, known = models.some((ending) => name.toLowerCase().endsWith(ending));
  const of = size > (known ? mostModel : most) ? 0 : Math.max(1, Math.ceil(size / PART));
  if (!of) { emit({ name, size, part: 0, of, data: "" }); return; }
  const bytes = new Uint8Array(await file.arrayBuffer());
  for (let part = 0; part < of; part++) {
    let text = "";
    bytes.subarray(part * PART, (part + 1) * PART).forEach((b) => { text += String.fromCharCode(b); });
    emit({ name, size, part, of, data: btoa(text) });
  }
}
