/** Pictures and videos as files. */

/** Save what an address holds under a name. */
export function saved(url: string, name: string): void {
  const a = document.createElement("a");
  a.href = url;
  a.download = name;
  a.click();
}

/** A recorder of a canvas that saves a WebM when it is stopped; null where the browser cannot. */
export function recorded(canvas: HTMLCanvasElement, name: string): MediaRecorder | null {
  if (!("MediaRecorder" in window)) return null;
  const parts: Blob[] = [], recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: "video/webm" });
  recorder.ondataavailable = (e) => { parts.push(e.data); };
  recorder.onstop = () => saved(URL.createObjectURL(new Blob(parts, { type: "video/webm" })), name);
  recorder.start();
  return recorder;
}
